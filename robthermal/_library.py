"""Libraries compiled from the package's own C sources, named by a hash of the source: an older one is never loaded."""

from __future__ import annotations

import ctypes
import hashlib
import os
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

LANES = (8, 4, 2)  # numbers of a vector: with AVX-512, with AVX2, on any processor


def library_name(source: Path, headers: Sequence[str]) -> str:
    """Name of the library that belongs to a source and its headers, as hatch_build.py gives it.

    Parameters
    ----------
    source : Path
        Source in the package.
    headers : sequence of str
        What it includes, by their places from its folder.

    Raises
    ------
    OSError
        One of them cannot be read.
    """
    text = b"".join(path.read_bytes() for path in (source, *(source.parent / name for name in headers)))
    return f"{source.stem}_{hashlib.sha256(text).hexdigest()[:16]}.so"


def library(source: Path, headers: Sequence[str], folder: Path | None = None) -> ctypes.CDLL | None:
    """The library of a source; None where it was not built, or from another source.

    Parameters
    ----------
    source : Path
        Source in the package.
    headers : sequence of str
        What it includes, by their places from its folder.
    folder : Path, optional
        Where the library is; default beside the source.
    """
    try:
        return ctypes.CDLL(os.fspath((source.parent if folder is None else folder) / library_name(source, headers)))
    except OSError:
        return None


def functions(source: Path, headers: Sequence[str], folder: Path, lanes: int | None, names: Sequence[str]
              ) -> list[Any] | None:
    """Functions of the widest part of a library that this processor can run; None where there is none.

    Parameters
    ----------
    source : Path
        Source in the package.
    headers : sequence of str
        What it includes, by their places from its folder.
    folder : Path
        Where the library is.
    lanes : int, optional
        The only width to be asked for.
    names : sequence of str
        Of the functions, without what all begin and end with.
    """
    found = library(source, headers, folder)
    wide = None if found is None else widest(found, lanes)
    return None if found is None or wide is None else [found[f"robthermal_{name}_{wide}"] for name in names]


def widest(found: ctypes.CDLL, lanes: int | None = None) -> int | None:
    """Width of the vectors [numbers] of the widest part of a library that this processor can run; None without one.

    Parameters
    ----------
    found : CDLL
        Library whose parts end with the width of their vectors.
    lanes : int, optional
        The only width to be asked for.
    """
    for wide in LANES if lanes is None else (lanes,):
        with suppress(AttributeError):  # the compiler had no such instructions
            if found[f"robthermal_runs_here_{wide}"]():
                return wide
    return None
