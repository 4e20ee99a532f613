"""Frequency responses on disk: JSON for people, .mat for MATLAB, .npz for speed, CSV from elsewhere.

The content tells the format, not the ending. Nothing is pickled.
"""

from __future__ import annotations

import json
import math
import sys
import zipfile
import zlib
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy
from numpy.typing import NDArray

from robthermal._checks import excerpt, quoted
from robthermal._matfile import kind_of, read_matlab
from robthermal._write import whole_file
from robthermal.errors import InputError

from ._response_csv import is_table, read_table
from ._response_shapes import shapes_of

if TYPE_CHECKING:
    from ._response import FrequencyResponse

FORMAT = "robthermal frequency response 1"

_ARRAYS = (
    "frequencies",
    "response",
    "covariance",
    "noise_covariance",
    "degrees_of_freedom",
    "transient",
    "coherence",
    "suspect",
    "nonlinear_covariance",
    "ratio_uncertainty",
    "operating_point_values",
)
_LISTS = ("input_names", "output_names", "notes", "operating_point_names")
_OPTIONAL = ("operating_point_names",)  # files of earlier versions have none
_SCALARS = {"sample_time": float, "n_samples": int, "half_width": int, "method": str}
# What the readers of json, zip archives and numpy raise for damaged files, and the conversions below for content of
# another form. RuntimeError: an archive that is encrypted, or packed in a way that zipfile does not know; nesting.
# MemoryError: a damaged shape.
_UNREADABLE = (ValueError, TypeError, KeyError, OSError, EOFError, OverflowError, RuntimeError, MemoryError,
               zipfile.BadZipFile, zlib.error)
_LARGEST = 500_000_000  # bytes, unpacked
_LARGEST_TABLE = 100_000_000  # bytes of CSV
_SUFFIXES = (".json", ".mat", ".npz")
_HEAD = 65_536  # bytes that tell the format; the header row of a CSV file is among them
_EXPECTED = "a frequency response: a file that robthermal frf wrote, or CSV with frequency [Hz], real, imag"


def save(result: FrequencyResponse, path: str | PathLike[str]) -> None:
    """Write `result`; the suffix of `path` chooses the format."""
    path = _checked(path)
    if not result.n_samples:
        raise InputError("the response was read from CSV and has no covariance", where="save",
                         remedy="Keep the CSV file it was read from.")
    means = result.operating_point
    arrays = {name: getattr(result, name) for name in _ARRAYS[:-1] if getattr(result, name) is not None}
    arrays["operating_point_values"] = np.array(list(means.values()), float)
    texts = {name: list(getattr(result, name)) for name in _LISTS[:-1]} | {"operating_point_names": list(means)}
    scalars = {name: getattr(result, name) for name in _SCALARS}
    head = {"format": FORMAT, **scalars}
    with whole_file(path) as part:
        if path.suffix == ".json":
            content = {**head, **texts, **{name: _to_json(a) for name, a in arrays.items()}}
            part.write_text(json.dumps(content, allow_nan=False), encoding="utf-8")
        elif path.suffix == ".npz":
            lists = {name: np.array(value, dtype=str) for name, value in texts.items()}
            np.savez_compressed(part, allow_pickle=False, **head, **lists, **arrays)
        else:
            cells = {name: np.array(value, dtype=object) for name, value in texts.items()}
            scipy.io.savemat(part, {**head, **cells, **arrays}, long_field_names=True)


def format_of(path: Path) -> str:
    """What a file holds, by its first bytes: "json", "npz", "mat", "csv", or "" for none of them.

    Parameters
    ----------
    path : Path
        File to look into.

    Raises
    ------
    OSError
        If it cannot be opened.
    """
    with path.open("rb") as file:
        head = file.read(_HEAD)
    if head.startswith(b"PK"):
        return "npz"
    if head.startswith(b"MATLAB"):
        return "mat"
    text = head.decode("utf-8-sig", errors="replace")
    if text.lstrip().startswith(("{", "[")):
        return "json"
    return "" if "\0" in text or text.count("\ufffd") > 1 else "csv"  # one: a character that the head ends in


def is_response(path: str | PathLike[str]) -> bool:
    """Whether a file is a frequency response, or means to be one, rather than a record.

    Parameters
    ----------
    path : str or path-like
        File of any format; False where there is none.

    Returns
    -------
    bool
        True for JSON and NumPy archives, which records never are; for MATLAB files that `FrequencyResponse.save` wrote;
        for CSV with the columns of a frequency response.

    Examples
    --------
    >>> from pathlib import Path
    >>> import robthermal as rt
    >>> _ = Path("G.csv").write_text("frequency,real,imag\\n1,2,3\\n2,2,3\\n")
    >>> rt.identify.is_response("G.csv"), rt.identify.is_response("absent.csv")
    (True, False)
    """
    path = Path(path)
    try:
        kind = format_of(path)
        if kind == "csv":
            with path.open(encoding="utf-8-sig", errors="replace") as file:
                return is_table(file.read(_HEAD))
        if kind == "mat":
            return "response" in read_matlab(path.read_bytes(), _LARGEST)
    except (OSError, ValueError, MemoryError):  # whoever reads it says what is wrong
        return False
    return kind in ("json", "npz")


def load(path: str | PathLike[str], sample_time: float = math.nan) -> dict[str, Any]:
    """Arguments for `FrequencyResponse` from a file of any of the formats; `sample_time` is for CSV, which has none."""
    path = Path(path)
    if not path.is_file():
        raise InputError(f"no such file: {path}", where="path", remedy="Check the path.")
    try:
        kind = format_of(path)
        _refuse_large(path, kind)
        if kind == "csv":
            return {**read_table(path.read_bytes().decode("utf-8-sig"), path), "sample_time": sample_time}
        if not kind:
            raise ValueError("binary data of another kind")
        content = {"json": _read_json, "npz": _read_npz, "mat": _read_mat}[kind](path)
    except InputError:  # says it better than what follows
        raise
    except _UNREADABLE as error:
        raise InputError(f"cannot be read: {excerpt(error)}", where=str(path), expected=_EXPECTED) from None
    if content.get("format") != FORMAT:
        raise InputError(f"its format is {quoted(content.get('format'))}", where=str(path),
                         expected=f"{FORMAT!r}, as robthermal frf writes it")
    missing = [name for name in (*_ARRAYS[:5], *_LISTS, *_SCALARS) if name not in content and name not in _OPTIONAL]
    if missing:
        raise InputError(f"lacks {', '.join(missing)}", where=str(path), remedy="Write it again with save.")
    arguments = {name: content[name] for name in _ARRAYS if name in content}
    arguments |= {name: _texts(content.get(name, []), name, path) for name in _LISTS}
    arguments |= {name: _scalar(content[name], name, kind, path) for name, kind in _SCALARS.items()}
    shape = len(arguments["output_names"]), len(arguments["input_names"]), arguments["frequencies"].size
    if arguments["response"].shape != shape:
        raise InputError(f"its response has shape {excerpt(arguments['response'].shape)}", where=str(path),
                         expected=f"{shape}, from its names and frequencies", remedy="Write it again with save.")
    return arguments | {"operating_point": _operating_point(arguments, path)}


def _operating_point(arguments: dict[str, Any], path: Path) -> dict[str, float]:
    """Means of the inputs from the two lists of a file, which are taken out of the arguments."""
    names = arguments.pop("operating_point_names")
    values = np.ravel(arguments.pop("operating_point_values", []))
    if len(names) != values.size or values.dtype.kind not in "fi" or not np.isfinite(values).all():
        raise InputError(f"its operating point has {len(names)} names and values {excerpt(values.tolist())}",
                         where=str(path), expected="one finite number per name", remedy="Write it again with save.")
    return dict(zip(names, values.astype(float).tolist(), strict=True))


def _refuse_large(path: Path, kind: str) -> None:
    """Refuse files that would fill the memory, also once an archive is unpacked."""
    size, most = path.stat().st_size, _LARGEST_TABLE if kind == "csv" else _LARGEST
    if kind == "npz" and size <= most:
        with zipfile.ZipFile(path) as archive:
            size = sum(member.file_size for member in archive.infolist())
    if size > most:
        raise _too_large(path, size, most)


def _too_large(path: Path, size: float, most: int) -> InputError:
    how_large = f"{size / 1e6:.0f} MB large" if math.isfinite(size) else "larger when unpacked"
    return InputError(f"it is {how_large}", where=str(path), expected=f"at most {most / 1e6:.0f} MB",
                      remedy="Keep fewer frequencies or channels in one file.")


def _texts(value: Any, name: str, path: Path) -> list[str]:
    if not isinstance(value, list | np.ndarray) or not all(isinstance(text, str) for text in value):
        raise InputError(f"its {name} are {quoted(value)}", where=str(path), expected="a list of texts")
    return [str(text) for text in value]


def _scalar(value: Any, name: str, kind: type, path: Path) -> Any:
    """A text, or a number that can be one: sample times and sample counts are positive, widths not negative."""
    if kind is str:
        good = isinstance(value, str)
    else:
        numeric = isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)
        good = numeric and abs(value) <= sys.float_info.max and value == kind(value)
        good = good and (value > 0 or (name == "half_width" and value == 0))
    if not good:
        raise InputError(f"its {name} is {quoted(value)}", where=str(path),
                         expected={float: "a number above 0", int: "a whole number", str: "a text"}[kind])
    return kind(value)


def _checked(path: str | PathLike[str]) -> Path:
    path = Path(path)
    if path.suffix not in _SUFFIXES:
        raise InputError(f"the suffix is {path.suffix!r}", where="path", expected=f"one of {', '.join(_SUFFIXES)}")
    return path


def _to_json(array: NDArray[Any]) -> dict[str, Any]:
    """Shape and flat lists; complex as two lists; NaN and infinities as text, which JSON has no numbers for."""
    coded: dict[str, Any] = {"shape": list(array.shape)}
    if np.iscomplexobj(array):
        return coded | {"real": _numbers(array.real), "imag": _numbers(array.imag)}
    return coded | {"values": _numbers(array) if array.dtype.kind == "f" else array.ravel().tolist()}


def _numbers(array: NDArray[Any]) -> list[Any]:
    return [x if math.isfinite(x) else repr(x) for x in array.ravel().tolist()]


def _from_json(coded: Any) -> NDArray[Any]:
    if "real" in coded:
        real, imag = (np.array([float(x) for x in coded[part]]) for part in ("real", "imag"))
        if real.size != imag.size:  # one value would be repeated
            raise ValueError(f"{real.size} real and {imag.size} imaginary parts")
        flat = np.empty(real.size, dtype=complex)  # not real + 1j*imag: that turns an infinity into NaN
        flat.real, flat.imag = real, imag
    else:
        values = coded["values"]
        flat = np.array([float(x) if isinstance(x, str) else x for x in values])
    return flat.reshape(coded["shape"])


def _read_json(path: Path) -> dict[str, Any]:
    content = json.loads(path.read_text(encoding="utf-8"))
    if not isinstance(content, dict):
        raise ValueError("no table of names and values")
    return {name: _from_json(value) if name in _ARRAYS else value for name, value in content.items()}


def _read_npz(path: Path) -> dict[str, Any]:
    with np.load(path, allow_pickle=False) as stored:
        content = {name: stored[name] for name in stored.files}
    return {name: value[()] if value.ndim == 0 else value for name, value in content.items()}


def _read_mat(path: Path) -> dict[str, Any]:
    stored = path.read_bytes()
    if stored.startswith(b"MATLAB 7.3"):
        raise ValueError("it has MATLAB's format 7.3; save it with save(..., '-v7')")
    try:
        variables = read_matlab(stored, _LARGEST)
    except MemoryError:
        raise _too_large(path, math.inf, _LARGEST) from None
    content: dict[str, Any] = {}
    for name, value in variables.items():
        if name in _LISTS:
            content[name] = value if isinstance(value, list) else [value]
        elif name in _SCALARS or name == "format":
            content[name] = value.item() if isinstance(value, np.ndarray) else value
        elif name in _ARRAYS:
            if not isinstance(value, np.ndarray):
                raise ValueError(f"{name} is a {kind_of(value)}, not a matrix")
            content[name] = value
    return _without_matlab_padding(content)


def _without_matlab_padding(content: dict[str, Any]) -> dict[str, Any]:
    """MATLAB has no vectors and drops trailing axes of one: the lengths of the names restore the shapes."""
    shapes = shapes_of(len(content["output_names"]), len(content["input_names"]), content["frequencies"].size)
    return {name: value.reshape(shapes[name]) if name in shapes else value for name, value in content.items()}
