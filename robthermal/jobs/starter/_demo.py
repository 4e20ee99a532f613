"""The embedded project."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path


def demo_project() -> Path:
    """Project file of the demo: the embedded two-module system with simulated records.

    Returns
    -------
    Path

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.jobs.demo_project().name
    'project.toml'
    """
    return Path(str(files("robthermal.systems"))) / "demo" / "project.toml"
