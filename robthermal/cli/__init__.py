"""The command ``robthermal``: arguments in, what `rt.jobs` answers out."""

from .app import app as app
from .app import main as main

__all__ = ["app", "main"]
