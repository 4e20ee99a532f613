"""Systems from matrices: what goes in comes out, rounding makes no heat, and what is no heat conduction is refused."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
from scipy.io import mmwrite
from scipy.sparse import coo_array, csr_array, diags_array, save_npz

import robthermal as rt
from robthermal.thermal import Equations, read_matrices, system_from_matrices

# Three lumps: 1-2 (1 W/K), 2-3 (2 W/K), 3-room (0.5 W/K)
CAPACITY = np.array([10.0, 20.0, 30.0])
A3 = np.array([[-1.0, 1.0, 0.0], [1.0, -3.0, 2.0], [0.0, 2.0, -2.5]])


def random_network(n: int, seed: int = 3) -> tuple[np.ndarray, csr_array, np.ndarray]:
    """Capacities, A and conductances to two ambients of a random network, all exact in the last digit."""
    rng = np.random.default_rng(seed)
    a = np.r_[np.arange(n - 1), rng.integers(0, n, 2 * n)]
    b = np.r_[np.arange(1, n), rng.integers(0, n, 2 * n)]
    keep = a != b
    g = rng.integers(1, 200, keep.sum()) / 64.0
    W = coo_array((np.r_[g, g], (np.r_[a[keep], b[keep]], np.r_[b[keep], a[keep]])), shape=(n, n)).tocsr()
    outside = np.zeros((n, 2))
    outside[rng.integers(0, n, 5), 0] = 0.5
    outside[rng.integers(0, n, 5), 1] = 0.25
    diagonal = np.asarray(W.sum(axis=1)).ravel() + outside.sum(axis=1)
    return rng.uniform(1, 10, n), csr_array(W - diags_array(diagonal)), outside


def test_matrices_come_back_from_the_equations() -> None:
    E, A, outside = random_network(60)
    B = np.zeros((60, 2))
    B[4, 0], B[17, 1] = 1.5, -0.3
    made = system_from_matrices(E, A, np.hstack([B, outside]), inputs=["Q1", "Q2"],
                                ambients={"room": 298.15, "chuck": 295.0})
    equations = Equations(made.system)
    np.testing.assert_array_equal(equations.capacity, E)
    np.testing.assert_allclose(equations.A.toarray(), A.toarray(), atol=1e-12)
    np.testing.assert_allclose(equations.B.toarray(), np.hstack([B, outside]), atol=0)
    assert made.outcome.code == "closed" and made.false_heat < 1e-9 and not made.lumped


def test_row_sums_are_the_conductances_to_one_ambient() -> None:
    system = system_from_matrices(CAPACITY, A3, ambients={"lab": 300.0}, lump_names=["a", "b", "c"], name="bench",
                                  sensors={"T": {"lump": "b"}}).system
    assert [(link.between, link.conductance) for link in system.links] == [
        (("a", "b"), 1.0), (("b", "c"), 2.0), (("c", "lab"), 0.5)]
    assert system.name == "bench" and system.sensor_names == ("T",)
    assert system.parameter("ambients.lab.temperature") == 300.0


@pytest.mark.parametrize("convert", [np.asarray, csr_array, coo_array, lambda M: M.tolist()])
def test_dense_and_sparse_matrices_are_the_same(convert) -> None:
    reference = system_from_matrices(CAPACITY, A3, np.array([[0.0], [2.0], [0.0]]), inputs=["Q"]).system
    given = system_from_matrices(convert(np.diag(CAPACITY)), convert(A3), convert(np.array([[0.0], [2.0], [0.0]])),
                                 inputs=["Q"]).system
    assert given == reference
    assert system_from_matrices(CAPACITY, A3, [0.0, 2.0, 0.0], inputs=["Q"]).system == reference


def test_a_rounded_diagonal_makes_no_heat() -> None:
    """A printed diagonal is off by rounding; in kelvin a heat source, as in Evers (5.46). It is removed, and said."""
    E, A, outside = random_network(40)
    printed = A.toarray()
    at = np.arange(40)
    printed[at, at] += np.resize([0.004, -0.003, 0.001], 40)
    with pytest.raises(rt.InputError, match=r"rows 1, 2, 3.*do not close.*heat of nothing.*tolerance=") as refused:
        system_from_matrices(E, printed, outside, ambients={"room": 298.15, "chuck": 295.0})
    suggested = float(str(refused.value).split("tolerance=")[1].split()[0])
    made = system_from_matrices(E, printed, outside, ambients={"room": 298.15, "chuck": 295.0}, tolerance=suggested)
    assert made.outcome.code == "rounded" and "false heat" in str(made)
    assert made.false_heat == pytest.approx(np.resize([0.004, 0.003, 0.001], 40).sum() * 298.15)
    np.testing.assert_allclose(Equations(made.system).A.toarray(), A.toarray(), atol=1e-12)
    equations = Equations(made.system)
    rest = np.linalg.solve(equations.A.toarray(), -equations.B.toarray() @ [300.0, 300.0])
    np.testing.assert_allclose(rest, 300.0, atol=1e-9)  # surroundings of one temperature: so is everything
    fooled = np.linalg.solve(printed, -outside @ [300.0, 300.0])
    assert np.abs(fooled - 300.0).max() > 0.5


def test_rounding_below_the_tolerance_is_no_ambient_link() -> None:
    noisy = A3 + np.diag([1e-10, -1e-10, 0.0])
    made = system_from_matrices(CAPACITY, noisy)
    assert [link.between for link in made.system.links] == [("n1", "n2"), ("n2", "n3"), ("n3", "room")]
    np.testing.assert_allclose(made.residual, [1e-10, -1e-10, 0.0], rtol=1e-4)


def test_a_consistent_mass_matrix_is_lumped_only_on_request() -> None:
    """Linear elements on a line: row sums h/2, h, …, h/2; the heat of a uniform temperature stays."""
    M = np.array([[2.0, 1.0, 0.0], [1.0, 4.0, 1.0], [0.0, 1.0, 2.0]]) / 6 * 12.0
    with pytest.raises(rt.InputError, match=r"argument E: is not diagonal.*lump_mass=True"):
        system_from_matrices(M, A3)
    made = system_from_matrices(M, A3, lump_mass=True)
    assert made.lumped and "lumped by row sums" in str(made)
    assert [lump.capacity for lump in made.system.lumps.values()] == pytest.approx([6.0, 12.0, 6.0])


def test_obtuse_elements_are_refused_with_their_rows() -> None:
    """Linear triangles: the conductance of the side opposite an obtuse angle γ is ½ cot γ < 0."""
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.5, 0.1]])  # obtuse at node 3
    edges = np.roll(corners, -2, axis=0) - np.roll(corners, -1, axis=0)
    (x1, y1), (x2, y2) = edges[0], edges[1]
    K = edges @ edges.T / (4 * 0.5 * abs(x1 * y2 - x2 * y1))
    K[0, 0] += 0.5
    with pytest.raises(rt.InputError, match=r"negative conductances in rows 1, 2 \(.*W/K\).*cold to hot.*Delaunay"):
        system_from_matrices(CAPACITY, -K)


BAD_A = {
    "nan": (A3 * np.nan, r"argument A: holds NaN or infinite"),
    "K instead of A": (-A3, r"argument A: has a positive diagonal.*Pass -K"),
    "flow": (A3 + np.array([[0, 0, 0], [0.3, -0.3, 0], [0, 0, 0]]), r"is not symmetric in rows 1, 2.*certify\.network"),
    "shape": (A3[:2, :2], r"argument A: has the shape \(2, 2\).*\(3, 3\)"),
    "heat of nothing": (A3 + np.diag([0.1, 0, 0]), r"rows 1 sum to more than zero \(by up to 0\.1 W/K"),
    "no ambient": (A3 + np.diag([0, 0, 0.5]), r"no heat path to an ambient from lump n1, n2, n3"),
    "text": ([["a", "b", "c"]] * 3, r"argument A: is not a matrix"),
    "complex": (csr_array(A3 * 1j), r"argument A: has 2 dimensions and type complex"),
}


@pytest.mark.parametrize("fault", BAD_A)
def test_bad_conductance_matrices_are_refused(fault: str) -> None:
    matrix, message = BAD_A[fault]
    with pytest.raises(rt.InputError, match=message):
        system_from_matrices(CAPACITY, matrix)


@pytest.mark.parametrize(("options", "message"), [
    ({"E": [10.0, 0.0, 30.0]}, r"argument E: rows 2 have no positive heat capacity.*condensation"),
    ({"E": [10.0, -1.0, np.nan]}, r"argument E: holds NaN"),
    ({"E": np.ones((2, 3))}, r"argument E: has the shape \(2, 3\)"),
    ({"E": []}, r"argument E: has the shape \(0, 0\)"),
    ({"B": np.ones((3, 1)), "inputs": ["Q"]}, r"column 'Q' heats 3 lumps.*heater plate"),
    ({"B": np.zeros((3, 1)), "inputs": ["Q"]}, r"column 'Q' heats 0 lumps"),
    ({"B": np.ones((3, 4)), "inputs": ["Q"]}, r"argument B: has the shape \(3, 4\).*\(3, 1\).*\(3, 2\)"),
    ({"B": np.ones((2, 1)), "inputs": ["Q"]}, r"argument B: has the shape \(2, 1\)"),
    ({"inputs": ["Q"]}, r"argument B: has the shape \(3, 0\).*Name every heater"),
    ({"B": [[0.0], [0.0], [-0.5]]}, r"ambient columns are negative in rows 3"),
    ({"ambients": {}}, r"argument ambients: there is no ambient"),
    ({"ambients": {"a": 300.0, "b": 300.0}}, r"2 ambients without columns in B.*cannot be guessed"),
    ({"ambients": {"room": 25.0}}, r"ambients\['room'\].*looks like Celsius"),
    ({"lump_names": ["a", "b"]}, r"argument lump_names: 2 names.*3 different"),
    ({"lump_names": ["a", "b", "a"]}, r"argument lump_names: 3 names, 2 of them different"),
    ({"lump_names": ["a", "room", "c"]}, r"'room' is used twice"),
    ({"tolerance": 0.0}, r"argument tolerance.*positive number"),
    ({"sensors": {"T": {"lump": "n9"}}}, r"\[sensors\.T\] lump: 'n9' does not exist"),
])
def test_bad_arguments_are_refused(options: dict, message: str) -> None:
    arguments = {"E": CAPACITY, "A": A3, **options}
    with pytest.raises(rt.InputError, match=message):
        system_from_matrices(**arguments)


def written(folder: Path, ending: str) -> list[Path]:
    """E, A, B of the three lumps on disk."""
    paths = []
    for name, matrix in {"E": np.diag(CAPACITY), "A": A3, "B": np.array([[0.0], [2.0], [0.0]])}.items():
        path = folder / f"{name}{ending}"
        if ending == ".npz":
            save_npz(path, csr_array(matrix))
        elif ending == ".dense.npz":
            np.savez(path, matrix)
        else:
            mmwrite(path, csr_array(matrix), symmetry="symmetric" if name == "A" else "general")
        paths.append(path)
    return paths


@pytest.mark.parametrize("ending", [".mtx", ".npz", ".dense.npz"])
def test_files_hold_the_same_system(tmp_path: Path, ending: str) -> None:
    E, A, B = read_matrices(*written(tmp_path, ending))
    reference = system_from_matrices(CAPACITY, A3, [[0.0], [2.0], [0.0]], inputs=["Q"])
    assert system_from_matrices(E, A, B, inputs=["Q"]).system == reference.system


def test_one_npz_may_hold_all_and_a_vector_is_a_diagonal(tmp_path: Path) -> None:
    np.savez(tmp_path / "all.npz", E=CAPACITY, A=A3, B=np.array([0.0, 2.0, 0.0]))
    E, A, B = read_matrices(tmp_path / "all.npz")
    np.testing.assert_array_equal(E.toarray(), np.diag(CAPACITY))
    assert B.shape == (3, 1)
    mmwrite(tmp_path / "E.mtx", CAPACITY.reshape(-1, 1))
    mmwrite(tmp_path / "A.mtx", csr_array(A3))
    E, A, B = read_matrices(tmp_path / "E.mtx", tmp_path / "A.mtx")
    np.testing.assert_array_equal(E.toarray(), np.diag(CAPACITY))
    assert B is None


def bad_file(folder: Path, kind: str) -> Path:
    path = folder / {"ending": "A.csv", "npz junk": "A.npz", "pickle": "A.npz", "two": "A.npz", "cube": "A.npz",
                     "text": "A.npz"}.get(kind, "A.mtx")
    header = "%%MatrixMarket matrix coordinate {} general\n"
    content = {"junk": "\x00\x01\x02", "empty": "", "ending": "1,2", "npz junk": "PK nothing",
               "short": header.format("real") + "3 3 4\n1 1 -1.0\n",
               "outside": header.format("real") + "2 2 1\n7 7 1.0\n",
               "complex": header.format("complex") + "1 1 1\n1 1 1.0 2.0\n",
               "pattern": header.format("pattern") + "1 1 1\n1 1\n",
               "huge": header.format("real") + "900000000000 900000000000 1\n1 1 1.0\n"}
    if kind in content:
        path.write_bytes(content[kind].encode("latin-1"))
    arrays = {"pickle": {"A": np.array([{"code": 1}], dtype=object)}, "two": {"a": A3, "b": A3},
              "cube": {"A": np.zeros((2, 2, 2))}, "text": {"A": np.array([["a"]])}}
    if kind in arrays:
        np.savez(path, allow_pickle=True, **arrays[kind])
    return path


@pytest.mark.parametrize(("kind", "message"), [
    ("missing", r"A\.mtx: cannot be read.*Check the path"), ("junk", r"A\.mtx: cannot be read"),
    ("empty", r"A\.mtx: cannot be read"), ("short", r"A\.mtx: cannot be read"), ("outside", r"A\.mtx: cannot be read"),
    ("complex", r"A\.mtx: declares.*complex.*real numbers"), ("pattern", r"A\.mtx: declares.*pattern.*real numbers"),
    ("huge", r"A\.mtx: declares 900000000000.*at most"),
    ("ending", r"unknown ending '\.csv'.*\.mtx, \.mtx\.gz or \.npz"),
    ("npz junk", r"A\.npz: cannot be read"), ("pickle", r"A\.npz: cannot be read.*allow_pickle"),
    ("two", r"A\.npz: holds a, b.*one matrix"), ("cube", r"A\.npz: is not a matrix"),
    ("text", r"A\.npz: (is not a matrix|holds values of type)"),
])
def test_bad_files_are_refused(tmp_path: Path, kind: str, message: str) -> None:
    good = written(tmp_path, ".npz")[0] if kind == "missing" else tmp_path / "good.mtx"
    if kind != "missing":
        mmwrite(good, csr_array(np.diag(CAPACITY)))
    with pytest.raises(rt.InputError, match=message):
        read_matrices(good, bad_file(tmp_path, kind))


def test_one_file_must_hold_both_matrices(tmp_path: Path) -> None:
    np.savez(tmp_path / "half.npz", E=CAPACITY)
    with pytest.raises(rt.InputError, match=r"half\.npz: holds E.*the arrays E and A"):
        read_matrices(tmp_path / "half.npz")
    with pytest.raises(rt.InputError, match=r"only one file.*Give the file of A too"):
        read_matrices(tmp_path / "E.mtx")


@pytest.mark.exhaustive
def test_a_hundred_thousand_lumps_take_seconds() -> None:
    """A plane of 250 by 400 lumps, cooled at one side; about 3 s on a slow core, and linear in the links."""
    index = np.arange(100_000).reshape(250, 400)
    a = np.r_[index[:, :-1].ravel(), index[:-1].ravel()]
    b = np.r_[index[:, 1:].ravel(), index[1:].ravel()]
    W = coo_array((np.ones(2 * a.size), (np.r_[a, b], np.r_[b, a]))).tocsr()
    outside = np.zeros(index.size)
    outside[index[0]] = 0.5
    A = W - diags_array(np.asarray(W.sum(axis=1)).ravel() + outside)
    begin = time.process_time()
    system = system_from_matrices(np.ones(index.size), A).system
    assert time.process_time() - begin < 30.0
    assert len(system.links) == a.size + 400
    assert abs(Equations(system).A - A).max() == 0.0
