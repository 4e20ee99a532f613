"""Which programs and which inputs made a result."""

from __future__ import annotations

import hashlib
import platform
from importlib import metadata
from pathlib import Path

from ..errors import InputError

_PACKAGES = ("robthermal", "numpy", "scipy", "python-flint")


def versions() -> dict[str, str]:
    """Versions of everything the numbers depend on.

    Returns
    -------
    dict
        {name: version} of robthermal, Python, numpy, scipy, python-flint and the platform.

    Examples
    --------
    >>> import robthermal as rt
    >>> list(rt.report.versions())
    ['robthermal', 'python', 'numpy', 'scipy', 'python-flint', 'platform']
    """
    found = {name: _version(name) for name in _PACKAGES}
    return {"robthermal": found.pop("robthermal"), "python": platform.python_version(), **found,
            "platform": platform.platform(terse=True)}


def file_hash(path: str | Path) -> str:
    """SHA-256 of a file, as hexadecimal digits.

    Parameters
    ----------
    path : str or Path
        File to read.

    Returns
    -------
    str

    Raises
    ------
    InputError
        The file cannot be read.

    Examples
    --------
    >>> import pathlib, tempfile, robthermal as rt
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "abc.txt"
    >>> _ = path.write_bytes(b"abc")
    >>> rt.report.file_hash(path)[:16]
    'ba7816bf8f01cfea'
    """
    try:
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", where=str(path), expected="a readable file",
                         remedy="Check the path.") from None


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:  # robthermal used straight from a checkout
        return "not installed"
