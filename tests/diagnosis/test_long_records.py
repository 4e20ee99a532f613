"""What makes long records short gives the same numbers: covariances by blocks, plans of few samples, kept fits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

import robthermal as rt
from robthermal.diagnosis import _other_log
from robthermal.diagnosis._read_otherwise import read_otherwise
from robthermal.diagnosis.effects import candidates
from robthermal.diagnosis.evidence import _fewer_trials
from robthermal.diagnosis.fit import ENOUGH, NoiseScaling, Refit, Structure, exact, fitted, turned
from robthermal.diagnosis.fit._refitting import _fitted
from robthermal.diagnosis.path import LinearizedRecord, Whitener, averaged_record
from robthermal.diagnosis.path._riccati import filtered, spread
from robthermal.diagnosis.plan import trial_conditions
from robthermal.diagnosis.search import accept, begin, refit_candidates, shortlist

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


BAR = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 100.0, "disturbance": 0.5}},
                links=[{"between": ("bar", "room"), "conductance": 0.5}],
                inputs={"heater": {"lump": "bar", "limits": (0.0, 8.0)}},
                sensors={"T": {"lump": "bar", "noise": 0.05}})
UNKNOWN = {"lumps.bar.capacity": (10.0, 500.0), "links.bar-room.conductance": (0.05, 5.0)}
TRUE = {"lumps.bar.capacity": 130.0, "links.bar-room.conductance": 0.65}


def long_fit(first: float = 6.0) -> Refit:
    """5000 samples with unit steps of the heater; `first`: its largest level in the first 2000."""
    rng = np.random.default_rng(1)
    heater = np.repeat(np.concatenate([rng.uniform(0.0, first, 40), rng.uniform(0.0, 6.0, 60)]), 50)
    drive = rt.Record(sample_time=10.0, inputs=heater, outputs=np.zeros((5000, 0)), input_names=["heater"],
                      output_names=[])
    run = rt.thermal.simulate(BAR.with_parameters(TRUE), drive, initial=295.0)
    noisy = run.with_outputs(run.outputs + 0.05 * np.random.default_rng(2).standard_normal((5000, 1)))
    return rt.diagnosis.refit(BAR, noisy, parameters=UNKNOWN)


@pytest.fixture(scope="module")
def heated() -> Refit:
    return long_fit()


def deviations(one: Refit, other: Refit) -> Array:
    """Differences of the unknowns, in standard deviations."""
    return np.abs(one.v - other.v) / np.sqrt(np.diag(other.covariance))


@pytest.mark.parametrize("first", [6.0, 0.0])
def test_a_fit_that_starts_from_a_part_of_the_record_is_the_fit_to_the_record(
        heated: Refit, first: float, monkeypatch: pytest.MonkeyPatch) -> None:
    # without a heater in the first part, that says nothing of the capacity, and a wrong conductance
    fit = heated if first else long_fit(first)
    cold = fit.structure.start(fit.structure.ranges.start, [])
    simulated = []
    paths = Structure.paths
    monkeypatch.setattr(Structure, "paths", lambda self, v: simulated.append((self.n_readings, v.tobytes()))
                        or paths(self, v))
    whole = _fitted(replace(fit.structure), cold, fit.floor, NoiseScaling(1.0, {}))
    alone = len({v for n, v in simulated if n == 5000})
    simulated.clear()
    found = fitted(replace(fit.structure), cold, fit.floor, NoiseScaling(1.0, {}))
    assert found.outcome.ok and whole.outcome.ok and found.levels == whole.levels
    assert deviations(found, whole).max() < np.sqrt(ENOUGH * found.rss)  # where a descent ends
    assert deviations(found, replace(found, v=found.structure.start(np.array(list(TRUE.values())), []))).max() < 4.0
    if first:
        assert len({v for n, v in simulated if n == 5000}) < alone


def test_a_plan_after_a_long_record_has_two_thousand_samples(heated: Refit) -> None:
    conditions = trial_conditions(heated)
    assert conditions is not None and len(conditions.one.record) == len(conditions.one.readings) == 2000
    assert np.array_equal(conditions.one.record.inputs, heated.structure.data[0].record.inputs[:2000])
    scores = rt.diagnosis.score(heated, ["radiation", "natural_convection"])
    entries = rt.diagnosis.refit_short_list(heated, scores).entries
    plan = rt.diagnosis.next_experiment(entries, trials=1)
    assert len(plan.record) == 2000 and set(plan.inputs) == {"heater"}


def test_the_fit_with_the_network_taken_to_be_right_is_made_once(heated: Refit) -> None:
    assert exact(heated) is exact(heated)


@pytest.mark.parametrize(("m", "p"), [(3, 6), (700, 5), (1100, 20)])
def test_rows_turned_piece_by_piece_leave_every_distance_as_it_is(m: int, p: int) -> None:
    rng = np.random.default_rng(m)
    J, z, a = rng.standard_normal((m, p)), rng.standard_normal(m), rng.standard_normal((p, 4))
    rows, right = turned(J, z)
    assert rows.shape == (p + 1, p)
    assert np.linalg.norm(right[:, None] - rows @ a, axis=0) == pytest.approx(
        np.linalg.norm(z[:, None] - J @ a, axis=0), rel=1e-12)
    assert rows.T @ right == pytest.approx(J.T @ z, rel=1e-10, abs=1e-10)


@pytest.mark.parametrize("length", [1, 7])  # 5000 samples are no whole number of blocks of 7
def test_averages_of_constant_heat_are_those_of_its_innovations(heated: Refit, length: int) -> None:
    (path,), (white,) = heated.paths, heated.whiteners
    assert isinstance(path, LinearizedRecord) and isinstance(white, Whitener) and white.gains.any()
    averaged = averaged_record(path, white, length)
    heat = [one for one in candidates(heated.system, ["heat_source"]) if one.where == ("bar",)]
    z = heated.whiten([path.columns(heat)])[:5000]
    rows = -(-5000 // length)
    mean = np.pad(z, ((0, rows * length - 5000), (0, 0))).reshape(rows, length).sum(axis=1) / np.sqrt(length)
    found = averaged.columns(heat)
    assert found is not None
    assert found[:-1, 0] == pytest.approx(mean[:-1], rel=1e-8)  # the heat fills only a part of the last block
    assert averaged.of(z[:, None, :])[:, 0] == pytest.approx(mean, rel=1e-12)
    lag = candidates(heated.system, ["sensor_lag"])[0]
    assert averaged.columns([replace(lag, shape={"time_constant": 30.0})]) is None


@pytest.mark.parametrize("name", ["periodic_load", "conductance_step"])
def test_a_long_record_scores_the_best_of_all_trials(heated: Refit, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scored: list[int] = []
    columns = LinearizedRecord.columns
    monkeypatch.setattr(LinearizedRecord, "columns", lambda self, trials: scored.append(len(trials))
                        or columns(self, trials))
    rng = np.random.default_rng(5)
    noisy = replace(heated, z=heated.z + 0.3 * rng.standard_normal(heated.z.size))  # any residual will do
    tried = candidates(heated.system, [name])
    few = rt.diagnosis.evidence.score_candidates(noisy, tried)
    short, scored[:] = sum(scored), []
    monkeypatch.setattr(_fewer_trials, "_MANY", 10**6)
    every = rt.diagnosis.evidence.score_candidates(noisy, tried)
    assert short <= 12 < sum(scored) and few.n_trials == every.n_trials > 20
    assert few.candidates[0].shape == pytest.approx(every.candidates[0].shape)
    assert few.statistic == pytest.approx(every.statistic, rel=1e-9)
    assert few.p_value == pytest.approx(every.p_value, rel=1e-9)


def test_a_finished_fit_keeps_what_it_found_only(heated: Refit) -> None:
    structure, v = replace(heated.structure), heated.v
    structure.paths(v + 1e-3)
    kept = structure.paths(v)
    structure.keep_only(v)
    assert structure.paths(v) is kept and len(structure._last) == 1
    assert len(heated.structure._last) <= 1  # and so did the fit itself
    (path,) = heated.records
    A, by_start, by_end = path.steps  # one matrix in memory where all samples have the same
    assert A.strides[0] == by_start.strides[0] == by_end.strides[0] == path.C.strides[0] == 0
    leaves = np.exp(-0.5 * 10.0 / heated.system.lumps["bar"].capacity * heated.system.links[0].conductance / 0.5)
    assert A[-1, 0, 0] == pytest.approx(leaves, rel=1e-9)


def test_derivatives_that_were_forgotten_are_the_same_again(heated: Refit) -> None:
    J, basis = heated.J.copy(), heated.basis.copy()
    heated.without_derivatives()
    assert not {"J", "basis"} & set(vars(heated)) and all(one.slopes is None for one in heated.structure._last)
    assert np.array_equal(heated.J, J) and np.array_equal(heated.basis, basis)


def test_a_round_of_the_search_keeps_no_derivatives_of_what_it_left_behind() -> None:
    lossy = rt.diagnosis.refit(BAR, convecting(), parameters=UNKNOWN)
    state = accept(refit_candidates(shortlist(begin(lossy, ["natural_convection", "radiation"]))))
    left = [entry.fit for round_ in state.rounds for entry in (*round_.contenders, *round_.beaten)]
    assert left and not state.short.entries
    assert not any("J" in vars(fit) for fit in left)


def wandering() -> rt.Record:
    """The bar with a heat that wanders."""
    return read_bar(np.cumsum(np.random.default_rng(6).standard_normal(5000)) * 0.02, 0.0)


def convecting() -> rt.Record:
    """The bar with a loss by natural convection."""
    return read_bar(np.zeros(5000), 0.05)


def read_bar(heat: Array, convection: float) -> rt.Record:
    """5000 samples of the bar with a heat [W] that no column holds, by Euler steps of a tenth of a sample."""
    rng = np.random.default_rng(5)
    heater = np.repeat(rng.uniform(0.0, 6.0, 100), 50)
    T, read = 295.0, []
    for power, other in zip(heater, heat, strict=True):
        read.append(T)
        for _ in range(10):
            above = T - 295.0
            T += (power + other - 0.65 * above - convection * abs(above) ** 0.25 * above) / 130.0
    outputs = np.array(read)[:, None] + 0.05 * rng.standard_normal((5000, 1))
    return rt.Record(sample_time=10.0, inputs=heater, outputs=outputs, input_names=["heater"], output_names=["T"])


def test_a_remainder_that_wanders_is_asked_of_a_part_of_a_long_log_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fits to 1500 samples leave less there than fits to all: they were compared with those, and all were refitted."""
    asked: list[int] = []

    def seen(records: list[rt.Record], *others: object) -> list[object]:
        asked.append(len(records[0]))
        return read_otherwise(records, *others)

    monkeypatch.setattr(_other_log, "read_otherwise", seen)
    found = rt.diagnose(BAR.with_parameters(TRUE), wandering(), parameters=UNKNOWN, effects=["sensor_lag", "radiation"])
    assert found.verdict == "unexplained" and found.means == ""
    assert asked == [1500]
