"""Files of exports: chosen by their ending, written whole or not at all."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Callable, Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

from scipy.io import savemat

from ..errors import InputError


def by_suffix(path: str | Path, writers: Mapping[str, Callable[[], bytes]], remedy: str = "") -> None:
    """Write a file with the writer of its ending.

    Parameters
    ----------
    path : str or path
        File to write.
    writers : mapping of str to callable
        Ending, with its dot, to what makes the content.
    remedy : str
        For an ending that has no writer.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in writers:
        raise InputError(f'file type "{suffix}"', where=ascii(str(path)), expected=" or ".join(writers), remedy=remedy)
    write(path, writers[suffix]())


def json_bytes(content: Mapping[str, Any]) -> bytes:
    """JSON; NaN and infinity have no place in it.

    Parameters
    ----------
    content : mapping
        Of plain values.
    """
    return json.dumps(content, indent=1, allow_nan=False).encode()


def matlab_bytes(content: Mapping[str, Any]) -> bytes:
    """MATLAB file with one variable per key.

    Parameters
    ----------
    content : mapping
        Of arrays, numbers, texts and mappings of them.
    """
    file = BytesIO()
    savemat(file, dict(content), oned_as="row", long_field_names=True)
    return file.getvalue()


def write(path: str | Path, content: bytes) -> None:
    """Write any file whole, or not at all.

    Parameters
    ----------
    path : str or path
        File to write.
    content : bytes
        What it will hold.
    """
    target = Path(path)
    try:
        handle, part = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.", suffix=".part")
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(content)
            os.chmod(part, 0o644)
            os.replace(part, target)
        except BaseException:
            Path(part).unlink(missing_ok=True)
            raise
    except OSError as error:
        raise InputError(f"cannot write: {error.strerror}", where=ascii(str(target))) from error
