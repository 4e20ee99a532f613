"""What makes long records short gives the same numbers: covariances by blocks, plans of few samples, kept fits."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

import robthermal as rt
from robthermal.diagnosis.fit import exact
from robthermal.diagnosis.path._riccati import filtered, spread
from robthermal.diagnosis.plan import trial_conditions

Array = np.ndarray


def steps(n: int, n_z: int, n_s: int) -> tuple[Array, Array, Array, Array]:
    """Transitions that vary, one of them of a fast sensor, with heat into half of the lumps and one missing reading."""
    rng = np.random.default_rng(n)
    kinds = np.stack([expm(0.3 * (rng.random((n_z, n_z)) - np.diag(rng.uniform(n_z, 3 * n_z, n_z)))) for _ in range(5)])
    C = rng.standard_normal((n, n_s, n_z))
    R = np.tile(np.diag(rng.uniform(0.005, 0.02, n_s) ** 2), (n, 1, 1))
    R[n // 3] += 1e12 * np.eye(n_s)
    Q = np.tile(np.diag((np.arange(n_z) % 2) * 1e-4), (n, 1, 1))
    return kinds[rng.integers(5, size=n)], C, R, Q


@pytest.mark.parametrize("n", [1, 40, 128, 150, 1003])
def test_gains_by_blocks_are_those_of_the_loop_over_the_samples(n: int) -> None:
    A, C, R, Q = steps(n, 4, 2)
    start = np.diag([0.0, 1.0, 0.0, 0.5])
    gains, roots = filtered(A, C, R, Q, start)
    assert len(gains) == len(roots) == n
    P = start
    for k in range(n):
        S = C[k] @ P @ C[k].T + R[k]
        gain = P @ C[k].T @ np.linalg.inv(S)
        assert gains[k] == pytest.approx(gain, rel=1e-7, abs=1e-10)
        assert roots[k] @ S @ roots[k].T == pytest.approx(np.eye(2), abs=1e-8)
        P = A[k] @ (P - gain @ S @ gain.T) @ A[k].T + Q[k]


@pytest.mark.parametrize("n", [1, 130, 700])
def test_spread_of_random_heat_is_that_of_the_sums_over_all_steps_before(n: int) -> None:
    A, _, _, Q = steps(n, 3, 1)
    found, P = spread(A, Q), np.zeros((3, 3))
    assert len(found) == n
    for k in range(n):
        assert found[k] == pytest.approx(P, rel=1e-9, abs=1e-15)
        P = A[k] @ P @ A[k].T + Q[k]


@pytest.fixture(scope="module")
def long_fit() -> rt.diagnosis.Refit:
    bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 100.0}},
                    links=[{"between": ("bar", "room"), "conductance": 0.5}],
                    inputs={"heater": {"lump": "bar", "limits": (0.0, 8.0)}},
                    sensors={"T": {"lump": "bar", "noise": 0.05}})
    heater = np.repeat(np.random.default_rng(1).uniform(0.0, 6.0, 48), 50)
    drive = rt.Record(sample_time=10.0, inputs=heater, outputs=np.zeros((2400, 0)), input_names=["heater"],
                      output_names=[])
    run = rt.thermal.simulate(bar, drive)
    noisy = run.with_outputs(run.outputs + 0.05 * np.random.default_rng(2).standard_normal((2400, 1)))
    return rt.diagnosis.refit(bar, noisy, parameters={"lumps.bar.capacity": (10.0, 500.0)})


def test_a_plan_after_a_long_record_has_two_thousand_samples(long_fit: rt.diagnosis.Refit) -> None:
    conditions = trial_conditions(long_fit)
    assert conditions is not None and len(conditions.one.record) == len(conditions.one.readings) == 2000
    assert np.array_equal(conditions.one.record.inputs, long_fit.structure.data[0].record.inputs[:2000])
    scores = rt.diagnosis.score(long_fit, ["radiation", "natural_convection"])
    entries = rt.diagnosis.refit_short_list(long_fit, scores).entries
    plan = rt.diagnosis.next_experiment(entries, trials=1)
    assert len(plan.record) == 2000 and set(plan.inputs) == {"heater"}


def test_the_fit_with_the_network_taken_to_be_right_is_made_once(long_fit: rt.diagnosis.Refit) -> None:
    assert exact(long_fit) is exact(long_fit)
