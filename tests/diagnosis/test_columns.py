"""Columns of a least-squares problem, of which some are the same everywhere, against the dense problem."""

from __future__ import annotations

import numpy as np
import pytest

import robthermal as rt
from robthermal.diagnosis.fit import Whitened, coarsened, turned
from robthermal.diagnosis.fit._columns import Beside, Plain, still
from robthermal.diagnosis.fit._turned import turned_again


def _lowest(rows: np.ndarray, right: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(rows, axis=0)
    return np.asarray(np.linalg.lstsq(rows / length, right, rcond=None)[0] / length)


def _problem(near: float) -> tuple[Beside, np.ndarray, np.random.Generator]:
    """Four columns that stay, in the places 2 to 5, beside five others, and all of them as one matrix.

    The others are within `near` of the span of those that stay.
    """
    rng = np.random.default_rng(3)
    n, k = 900, 4
    J = np.zeros((n + 9, 9))
    J[:n] = rng.standard_normal((n, 9)) * np.geomspace(1e-3, 1e4, 9)
    J[:n, [0, 1, 6, 7, 8]] = near * J[:n, [0, 1, 6, 7, 8]] + J[:n, 2:6] @ rng.standard_normal((4, 5))
    J[n + np.arange(9), np.arange(9)] = 1.0  # priors, in the order of the unknowns
    own = slice(n + 2, n + 2 + k)
    columns = still(np.concatenate([J[:n, 2:6], J[own, 2:6]]))
    return Beside(np.delete(J, slice(2, 6), axis=1), columns, slice(2, 6), own), J, rng


@pytest.mark.parametrize("near", [1.0, 1e-3, 1e-6])
def test_columns_that_stay_are_turned_once(near: float) -> None:
    split, J, rng = _problem(near)
    z = rng.standard_normal(len(J))
    rows, right = split.turned(z)
    length = np.linalg.norm(J, axis=0)
    np.testing.assert_allclose(np.linalg.norm(rows, axis=0), length, rtol=1e-9)
    for _ in range(5):
        a = rng.standard_normal(9) / length
        assert np.linalg.norm(right - rows @ a) == pytest.approx(np.linalg.norm(z - J @ a), rel=1e-9)
        np.testing.assert_allclose(split.along(a), J @ a, atol=1e-11)
    np.testing.assert_allclose(_lowest(rows, right) * length, _lowest(J, z) * length, rtol=1e-4, atol=1e-8 / near)


@pytest.mark.parametrize("near", [1.0, 1e-3, 1e-6])
def test_another_right_side_is_turned_alike(near: float) -> None:
    split, J, rng = _problem(near)
    for columns in (split, Plain(J)):
        rows, _ = columns.turned(rng.standard_normal(len(J)))
        z = rng.standard_normal(len(J))
        again, right = columns.again(rows, z)
        a = rng.standard_normal(9) / np.linalg.norm(J, axis=0)
        assert again is rows
        assert np.linalg.norm(right - again @ a) == pytest.approx(np.linalg.norm(z - J @ a), rel=1e-8)


def test_columns_that_cannot_be_told_from_each_other_are_turned_anew() -> None:
    rng = np.random.default_rng(4)
    J = rng.standard_normal((50, 3))[:, [0, 1, 2, 0]]
    rows, _ = turned(J, rng.standard_normal(50))
    z = rng.standard_normal(50)
    assert turned_again(rows, z @ J, z) is None
    again, right = Plain(J).again(rows, z)
    assert again is not rows and np.linalg.norm(right) == pytest.approx(np.linalg.norm(z))


def test_a_network_that_is_too_coarse_has_the_same_problem_in_parts() -> None:
    """What a finer network would change is linear: its columns are those of every other point, too."""
    names = ("a", "b", "c")
    system = rt.System(ambients={"room": {"temperature": 295.0}},
                       lumps={name: {"capacity": 50.0, "disturbance": 0.02} for name in names},
                       links=[{"between": ("a", "b"), "conductance": 1.0}, {"between": ("b", "c"), "conductance": 1.0},
                              {"between": ("c", "room"), "conductance": 0.3}],
                       inputs={"heater": {"lump": "a"}},
                       sensors={f"T{name}": {"lump": name, "noise": 0.02} for name in ("a", "c")},
                       fit={"links.a-b.conductance": {"lower": 0.1, "upper": 10.0, "sigma": 0.3},
                            "lumps.c.capacity": {"lower": 5.0, "upper": 500.0}})
    rng = np.random.default_rng(0)
    drive = rt.Record(sample_time=5.0, inputs=np.repeat(rng.uniform(0.0, 6.0, 20), 20), outputs=np.zeros((400, 0)),
                      input_names=["heater"], output_names=[])
    run = rt.thermal.simulate(system.with_parameters({"links.b-c.conductance": 1.4}), drive)
    noisy = run.with_outputs(run.outputs + 0.02 * rng.standard_normal(run.outputs.shape))
    fit = coarsened(rt.diagnosis.refit(system, noisy))
    problem = Whitened(fit.structure, fit.whiteners)
    for v in (fit.v, fit.v + 0.05 * rng.standard_normal(fit.v.size)):
        split, J = problem.columns(v), problem.slopes(v)
        assert isinstance(split, Beside) and J.shape[1] - split.moving.shape[1] == fit.structure.n_coarse > 5
        a = rng.standard_normal(v.size)
        np.testing.assert_allclose(split.along(a), J @ a, atol=1e-10 * np.abs(J @ a).max())
        step = 1e-4 * rng.standard_normal(v.size)
        moved = (problem.residual(v - step) - problem.residual(v + step)) / 2.0
        np.testing.assert_allclose(J @ step, moved, atol=1e-4 * np.abs(moved).max())
    assert problem.columns(fit.v).still is split.still
