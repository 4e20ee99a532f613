"""Certificate files among files and folders."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ...errors import InputError


def certificate_files(paths: Sequence[Path]) -> list[Path]:
    """Certificate files among files and folders.

    Parameters
    ----------
    paths : sequence of Path
        Files, or folders: every file of every ``certificates`` folder below, or else the folder's own JSON files.

    Returns
    -------
    list of Path

    Raises
    ------
    InputError
        A folder without certificates.

    Examples
    --------
    >>> from pathlib import Path
    >>> import robthermal as rt
    >>> rt.jobs.verify.certificate_files([Path("c.json")]) == [Path("c.json")]
    True
    """
    found: list[Path] = []
    for path in paths:
        if path.is_dir():
            inside = sorted(path.rglob("certificates/*.json")) or sorted(path.glob("*.json"))
            if not inside:
                raise InputError("holds no certificates", where=str(path),
                                 expected="*.json, or folders called certificates below it")
            found += inside
        else:
            found.append(path)
    return found
