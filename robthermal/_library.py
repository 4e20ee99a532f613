"""Libraries compiled from the package's own C sources, named by a hash of the source: an older one is never loaded."""

from __future__ import annotations

import ctypes
import hashlib
import os
from contextlib import suppress
from pathlib import Path

LANES = (8, 4, 2)  # numbers of a vector: with AVX-512, with AVX2, on any processor


def library_name(stem: str, text: bytes) -> str:
    """Name of the library that belongs to a source, as hatch_build.py gives it.

    Parameters
    ----------
    stem : str
        Name of the source without its suffix.
    text : bytes
        What the source holds.
    """
    return f"{stem}_{hashlib.sha256(text).hexdigest()[:16]}.so"


def library(source: Path, folder: Path | None = None) -> ctypes.CDLL | None:
    """The library of a source; None where it was not built, or from another source.

    Parameters
    ----------
    source : Path
        Source in the package.
    folder : Path, optional
        Where the library is; default beside the source.
    """
    try:
        name = library_name(source.stem, source.read_bytes())
        return ctypes.CDLL(os.fspath((source.parent if folder is None else folder) / name))
    except OSError:
        return None


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
