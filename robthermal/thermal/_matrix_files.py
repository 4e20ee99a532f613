"""Matrices of a network from files: Matrix Market (.mtx) and NumPy (.npz)."""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import scipy
from numpy.typing import NDArray

from ..errors import InputError
from ._matrix_market import read_market

_MOST_BYTES = 8e9  # unpacked: a small archive must not ask for all memory
_NPZ_SPARSE = {"format", "data", "shape"}
# What the readers of text, gzip and zip files, numpy and scipy raise. RuntimeError: an archive that is encrypted, or
# packed in a way that zipfile does not know. MemoryError: a damaged shape.
_UNREADABLE = (ValueError, OSError, OverflowError, EOFError, KeyError, AttributeError, TypeError, RuntimeError,
               MemoryError, zipfile.BadZipFile, zlib.error)


def read_matrices(E: str | Path, A: str | Path | None = None, B: str | Path | None = None
                  ) -> tuple[scipy.sparse.csr_array, scipy.sparse.csr_array, scipy.sparse.csr_array | None]:
    """Read the matrices of E ẋ = A x + B u.

    Parameters
    ----------
    E : str or Path
        Matrix Market file (.mtx, .mtx.gz), .npz written by ``scipy.sparse.save_npz``, or one .npz with the arrays E,
        A and, if there are inputs, B; E may be a vector [J/K].
    A : str or Path, optional
        File of A [W/K]; left out when the first file holds all.
    B : str or Path, optional
        File of B.

    Returns
    -------
    E, A, B : csr_array
        B is None if there is no such matrix.

    Raises
    ------
    InputError
        File missing, unknown ending, content that is not a real matrix.

    Examples
    --------
    >>> import tempfile, numpy as np, robthermal as rt
    >>> path = tempfile.mkdtemp() + "/model.npz"
    >>> np.savez(path, E=[10.0, 20.0], A=[[-3.0, 1.0], [1.0, -1.0]])
    >>> E, A, B = rt.thermal.read_matrices(path)
    >>> rt.thermal.system_from_matrices(E, A, B).system.parameter("links.n1-room.conductance")
    2.0
    """
    if A is None:
        return _together(Path(E), B)
    return _column(_read(Path(E))), _read(Path(A)), None if B is None else _read(Path(B))


def _together(path: Path, B: str | Path | None
              ) -> tuple[scipy.sparse.csr_array, scipy.sparse.csr_array, scipy.sparse.csr_array | None]:
    if path.suffix != ".npz":
        raise InputError("only one file", where=str(path), expected="E and A", remedy="Give the file of A too, or one "
                         ".npz with the arrays E, A and B.")
    arrays = _npz(path)
    missing = [key for key in ("E", "A") if key not in arrays]
    if missing or B is not None:
        raise InputError(f"holds {', '.join(sorted(arrays)) or 'nothing'}" if missing else "A is missing, B is given",
                         where=str(path), expected="the arrays E and A (and B)",
                         remedy="Give the files of E and A, or one .npz with all arrays.")
    return (_column(_matrix(arrays["E"], f"{path} E")), _matrix(arrays["A"], f"{path} A"),
            _matrix(arrays["B"], f"{path} B") if "B" in arrays else None)


def _read(path: Path) -> scipy.sparse.csr_array:
    if path.name.endswith((".mtx", ".mtx.gz")):
        with _reading(path):
            return read_market(path)
    if path.suffix == ".npz":
        arrays = _npz(path)
        if _NPZ_SPARSE <= set(arrays):
            with _reading(path):
                stored = scipy.sparse.load_npz(path)
                if hasattr(stored, "check_format"):  # indices outside would crash the interpreter
                    stored.check_format(full_check=True)
            return _matrix(stored, str(path))
        if len(arrays) == 1:
            return _matrix(next(iter(arrays.values())), str(path))
        raise InputError(f"holds {', '.join(sorted(arrays)) or 'nothing'}", where=str(path), expected="one matrix",
                         remedy="Write it with scipy.sparse.save_npz, or pass one .npz with E, A, B alone.")
    raise InputError(f"unknown ending {path.suffix!r}", where=str(path), expected=".mtx, .mtx.gz or .npz",
                     remedy="Write it with scipy.io.mmwrite or scipy.sparse.save_npz.")


def _npz(path: Path) -> dict[str, NDArray[np.generic]]:
    with _reading(path):
        with zipfile.ZipFile(path) as archive:
            size = sum(member.file_size for member in archive.infolist())
        if size > _MOST_BYTES:
            raise InputError(f"is {size / 1e9:.0f} GB large when unpacked", where=str(path),
                             expected=f"at most {_MOST_BYTES / 1e9:.0f} GB", remedy="Is this the right file?")
        with np.load(path, allow_pickle=False) as file:  # a pickle could run code
            return {key: file[key] for key in file.files}


@contextmanager
def _reading(path: Path) -> Iterator[None]:
    """Turn what readers raise on bad files into one message."""
    try:
        yield
    except InputError:
        raise
    except _UNREADABLE as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise InputError(f"cannot be read ({reason})", where=str(path), expected="a Matrix Market or .npz file",
                         remedy="Check the path, and that the file is complete.") from None


def _matrix(values: object, where: str) -> scipy.sparse.csr_array:
    """Real sparse matrix of whatever was stored."""
    try:
        if isinstance(values, np.ndarray) and values.ndim == 1:
            values = values.reshape(-1, 1)
        matrix = scipy.sparse.csr_array(values)
    except (TypeError, ValueError) as error:
        raise InputError(f"is not a matrix ({error})", where=where, expected="a real matrix of at most two dimensions",
                         remedy="Write numbers only.") from None
    if matrix.dtype.kind not in "iuf":
        raise InputError(f"holds values of type {matrix.dtype}", where=where, expected="real numbers",
                         remedy="A thermal network has real entries only.")
    return matrix.astype(np.float64)


def _column(E: scipy.sparse.csr_array) -> scipy.sparse.csr_array:
    """A stored vector becomes a diagonal."""
    if 1 in E.shape and E.shape != (1, 1):
        values = E.toarray().ravel()
        at = np.arange(values.size)
        return scipy.sparse.csr_array((values, (at, at)), shape=(values.size, values.size))
    return E
