"""joblib, imported when a name of it is first used: only maps and fleets on several processes need it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ._first_use import OnFirstUse

__all__ = ["joblib"]

if TYPE_CHECKING:
    import joblib
else:
    joblib = OnFirstUse("joblib")
