"""Files of exports: chosen by their ending."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from .._write import write
from ..errors import InputError
from ._program import Program


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


def write_export(path: str | Path, document: Callable[[], Mapping[str, Any]], program: Callable[[], Program]) -> None:
    """Write C99 (.c, .h), MATLAB (.mat) or JSON (.json), as the ending says.

    Parameters
    ----------
    path : str or path
        File to write, whole or not at all.
    document : callable
        Makes the content of the MATLAB and JSON files: plain values and arrays; in JSON numbers that are not finite
        become null. The test vector of the C source is added to it.
    program : callable
        Makes the C source.
    """
    def source() -> bytes:
        return program().text().encode("ascii")

    def content() -> dict[str, Any]:
        made = program()
        return {**document(), "test_vector": {"inputs": made.n_in, "columns": list(made.columns),
                                              "rows": np.array(made.vector, float)}}

    by_suffix(path, {".c": source, ".h": source, ".mat": lambda: matlab_bytes(content()),
                     ".json": lambda: json_bytes(plain(content()))})


def plain(content: Any) -> Any:
    """Content of a JSON file: arrays as lists, numbers that are not finite as null.

    Parameters
    ----------
    content : mapping, sequence, array, number or text
        What is to be written, nested as it may be.

    Examples
    --------
    >>> plain({"gain": np.array([1.0, np.inf]), "name": "K"})
    {'gain': [1.0, None], 'name': 'K'}
    """
    if isinstance(content, Mapping):
        return {key: plain(value) for key, value in content.items()}
    if isinstance(content, np.ndarray):
        return plain(content.tolist())
    if isinstance(content, (list, tuple)):
        return [plain(value) for value in content]
    if isinstance(content, (np.bool_, np.integer)):
        return content.item()
    if isinstance(content, (float, np.floating)):
        return float(content) if math.isfinite(content) else None
    return content


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
    scipy.io.savemat(file, dict(content), oned_as="row", long_field_names=True)
    return file.getvalue()
