"""Files that are there, and fit into memory."""

from __future__ import annotations

import os
from pathlib import Path

from ..errors import InputError

_TWO_GIB = 2**31
_TEXT_TO_MEMORY = 4  # a file needs up to four times its size while it is parsed


def check_file(path: Path, max_bytes: float | None) -> None:
    """Refuse what is no file, empty, or larger than memory, before anything is read."""
    if not path.exists():
        raise InputError("there is no such file", where=f"{path}")
    if not path.is_file():
        raise InputError("this is not a file", where=f"{path}")
    try:
        size = path.stat().st_size
        with path.open("rb"):
            pass
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror or error})", where=f"{path}") from None
    if size == 0:
        raise InputError("the file is empty", where=f"{path}", expected="a header row and data rows")
    refuse_large(path, size, "bytes", max_bytes)


def refuse_large(path: Path, size: float, unit: str, max_bytes: float | None) -> None:
    """Refuse `size` [bytes] above the limit: given, or 2 GiB, or what the memory of this machine can hold."""
    limit = memory_limit(max_bytes)
    if size > limit:
        raise InputError(
            f"the data have {size:.4g} {unit}, more than the limit of {limit:.4g} (max_bytes)",
            where=f"{path}",
            expected="a record that fits into memory",
            remedy="Slice the file, or leave columns out; max_bytes= raises the limit.",
        )


def memory_limit(max_bytes: float | None) -> float:
    """Largest size of a record [bytes]."""
    return min(_TWO_GIB, _memory() / _TEXT_TO_MEMORY) if max_bytes is None else max_bytes


def _memory() -> float:
    """Physical memory [bytes]; infinite where the operating system does not tell."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE")) * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):  # no sysconf on Windows
        return float("inf")
