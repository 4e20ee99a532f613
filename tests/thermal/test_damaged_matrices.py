"""Files of matrices that somebody or something has damaged: rejected with a message; whole ones read as by scipy."""

from __future__ import annotations

import gzip
import zipfile
from pathlib import Path

import numpy as np
import pytest
from scipy.io import mmread, mmwrite
from scipy.sparse import coo_array, csr_array, random_array, save_npz

import robthermal as rt
from robthermal.thermal import read_matrices
from robthermal.thermal._matrix_market import read_market


def symmetric(n: int = 12) -> np.ndarray:
    A = random_array((n, n), density=0.3, rng=np.random.default_rng(1)).toarray()
    return A + A.T - np.eye(n)


@pytest.mark.parametrize("dense", [False, True])
@pytest.mark.parametrize("symmetry", ["general", "symmetric", "skew-symmetric"])
@pytest.mark.parametrize("packed", [False, True])
def test_every_layout_is_read_as_scipy_reads_it(tmp_path: Path, symmetry: str, dense: bool, packed: bool) -> None:
    A = symmetric()
    A = A if symmetry == "symmetric" else np.tril(A, -1) - np.tril(A, -1).T if symmetry == "skew-symmetric" else A[:7]
    path = tmp_path / "A.mtx"
    mmwrite(path, A if dense else coo_array(A), comment="made\nhere", symmetry=symmetry, precision=17)
    reference = mmread(path)
    if packed:
        path = tmp_path / "A.mtx.gz"
        path.write_bytes(gzip.compress((tmp_path / "A.mtx").read_bytes()))
    np.testing.assert_array_equal(read_market(path).toarray(), reference if dense else reference.toarray())


@pytest.mark.exhaustive
@pytest.mark.parametrize("ending", [".mtx", ".mtx.gz", ".dense.npz", ".csr.npz", ".coo.npz"])
def test_a_thousand_damaged_files_never_crash(tmp_path: Path, ending: str) -> None:
    path, A = tmp_path / f"A{ending}", symmetric()
    if ending.endswith(".npz"):
        save_npz(path, {".csr": csr_array, ".coo": coo_array}[ending[:4]](A)) if ending[1] == "c" else np.savez(path, A)
    else:
        mmwrite(tmp_path / "A.mtx", coo_array(A), symmetry="general")
        text = (tmp_path / "A.mtx").read_bytes()
        path.write_bytes(gzip.compress(text) if ending.endswith(".gz") else text)
    stored, rng, refused = path.read_bytes(), np.random.default_rng(7), 0
    for _ in range(1000):
        damaged = bytearray(stored)
        for _ in range(rng.integers(1, 5)):
            damaged[int(rng.integers(len(damaged)))] = int(rng.integers(256))
        cut = int(rng.integers(len(damaged)))
        path.write_bytes(damaged[:cut] if rng.random() < 0.2 else damaged)
        try:
            _, matrix, _ = read_matrices(path, path)
        except rt.InputError as error:
            refused += 1
            assert path.name in str(error)
        else:
            assert (matrix @ np.ones(matrix.shape[1])).size == matrix.shape[0]
    assert refused > 300


def test_indices_outside_are_refused_before_anything_multiplies(tmp_path: Path) -> None:
    # save_npz checks nothing on the way out; the archive is whole, its matrix is not.
    A = csr_array(symmetric())
    np.savez(tmp_path / "A.npz", format=b"csr", shape=A.shape, data=A.data, indptr=A.indptr,
             indices=A.indices + 1_000_000)
    with pytest.raises(rt.InputError, match=r"A\.npz: cannot be read"):
        read_matrices(tmp_path / "A.npz", tmp_path / "A.npz")


def test_archives_that_are_large_only_unpacked_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    np.savez_compressed(tmp_path / "A.npz", np.zeros((1000, 1000)))
    assert (tmp_path / "A.npz").stat().st_size < 20_000
    monkeypatch.setattr("robthermal.thermal._matrix_files._MOST_BYTES", 1e6)
    with pytest.raises(rt.InputError, match="large when unpacked"):
        read_matrices(tmp_path / "A.npz", tmp_path / "A.npz")


def test_encrypted_archives_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "A.npz"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("A.npy", b"secret")
    content = bytearray(path.read_bytes())
    for head, flags in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        content[content.index(head) + flags] |= 1
    path.write_bytes(content)
    with pytest.raises(rt.InputError, match=r"A\.npz: cannot be read.*encrypted"):
        read_matrices(path, path)


@pytest.mark.parametrize("text", [
    "%%MatrixMarket matrix coordinate real general\n2 2 1\n1 1 nan\n",
    "%%MatrixMarket matrix coordinate real general\n2 2 1\n1.5 1 1\n",
    "%%MatrixMarket matrix coordinate real general\n2 2 1\n0 1 1\n",
    "%%MatrixMarket matrix coordinate real general\n2 2 1\n1 1 1\n2 2 1\n",
    "%%MatrixMarket matrix coordinate real general\n2 2 1\n1 1 1\n" + "% more\n" * 1000,
    "%%MatrixMarket matrix coordinate real symmetric\n2 3 1\n1 1 1\n",
    "%%MatrixMarket matrix coordinate real hermitian\n2 2 1\n1 1 1\n",
    "%%MatrixMarket matrix coordinate real general\n-2 2 1\n1 1 1\n",
    "%%MatrixMarket matrix array real general\n2 2\n1\n2\n3\n",
    "%%MatrixMarket vector array real general\n2\n1\n2\n",
    "%" * 5000])
def test_texts_that_are_no_matrix(tmp_path: Path, text: str) -> None:
    (tmp_path / "A.mtx").write_text(text, encoding="ascii")
    with pytest.raises(rt.InputError, match=r"A\.mtx: cannot be read"):
        read_matrices(tmp_path / "A.mtx", tmp_path / "A.mtx")


def test_an_empty_matrix_is_a_matrix(tmp_path: Path) -> None:
    mmwrite(tmp_path / "A.mtx", coo_array((3, 3)))
    assert read_market(tmp_path / "A.mtx").nnz == 0


@pytest.mark.parametrize("body", ["", "\n", "% nothing\n"])
def test_a_matrix_without_its_entries_is_refused_without_a_warning(tmp_path: Path, body: str) -> None:
    path = tmp_path / "A.mtx"
    path.write_text("%%MatrixMarket matrix coordinate real general\n2 2 1\n" + body, encoding="utf-8")
    with pytest.raises(rt.InputError, match="not 1 lines of 3"):
        read_matrices(path, path)


def test_comments_and_empty_lines_between_entries(tmp_path: Path) -> None:
    path = tmp_path / "A.mtx"
    path.write_text("%%MatrixMarket matrix coordinate real general\n2 2 2\n\n1 1 3\n% here\n2 2 4\n", encoding="utf-8")
    assert read_market(path).toarray().tolist() == [[3.0, 0.0], [0.0, 4.0]]
