"""A second checker of robthermal certificates: standard library only, exact rational arithmetic, its own methods."""

from __future__ import annotations

from ._check import Result as Result
from ._check import check as check
from ._document import Unreadable as Unreadable

__all__ = ["Result", "Unreadable", "check"]
