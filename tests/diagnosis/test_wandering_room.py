"""A room under air conditioning that was not recorded: what is told from it, and that it alone is no name."""

from __future__ import annotations

from dataclasses import replace

import air_conditioned as machine
import numpy as np
import pytest
from scipy.linalg import cholesky, expm, toeplitz

import robthermal as rt
from robthermal.diagnosis.data import as_measured
from robthermal.diagnosis.fit import NoiseScaling, with_random_ambients
from robthermal.diagnosis.path import LinearizedRecord, RandomAmbients, linearized_record, settled_cost, whitener
from robthermal.jobs.diagnose._answer import answer_sentence, number_that_matters

KEYS = {"path": ("missing_link", ("a", "b")), "mass": ("hidden_mass", ("p",)), "share": ("input_feedthrough",
                                                                                         ("q1", "p"))}
SIZES = {"path": ("conductance", machine.PATH), "mass": ("capacity", machine.MASS), "share": ("share", machine.SHARE)}
STD, POLE, NOISE = 0.7, 0.97, np.array([0.05, 0.02])


def diagnosed(hidden: str, seed: int, **keys: bool | float) -> rt.diagnosis.Diagnosis:
    train, unseen = (machine.day(one, hidden, **keys) for one in (seed, seed + 100))  # type: ignore[arg-type]
    return rt.diagnose(machine.model(), train, validation=unseen)


@pytest.mark.parametrize(("hidden", "seed"), [
    ("path", 11), ("mass", 12), pytest.param("share", 13, marks=pytest.mark.exhaustive),
    pytest.param("path", 14, marks=pytest.mark.exhaustive)])
def test_what_is_missing_is_named_beside_a_room_that_wanders(hidden: str, seed: int) -> None:
    """All were "unexplained", with swings of the room and steps of conductances as the nearest."""
    found = diagnosed(hidden, seed)
    others = [one.key for one in found.effects if one.effect != "ambient_drift"]  # it does drift, too
    (name, true), (key,) = SIZES[hidden], others
    value, std, _ = next(one for one in found.effects if one.key == key).values[name]
    assert key == KEYS[hidden] and abs(value - true) < 3.5 * std < true
    assert found.verdict in ("named", "named_with_remainder") and not any(found.alternatives)
    (said,) = [one for one in found.caveats if "taken to wander" in one]
    assert "room, which was not recorded, is taken to wander by 0." in said and "No room does that" not in said
    assert said in answer_sentence(found) and 0.1 < found.fit.levels.wander < 1.0


@pytest.mark.parametrize("seed", [23, pytest.param(24, marks=pytest.mark.exhaustive)])
def test_a_room_that_wanders_alone_is_said_to_be_enough(seed: int) -> None:
    found = diagnosed("nothing", seed)
    assert found.verdict == "unexplained" and not found.effects
    assert any("which explains these records: nothing else need be missing" in one for one in found.caveats)


def test_the_drift_of_a_room_that_wanders_is_no_heat_of_the_machine() -> None:
    found = diagnosed("nothing", 21)
    assert [one.key for one in found.effects] == [("ambient_drift", ("room",))]


def test_a_room_that_is_recorded_or_stands_still_does_not_wander() -> None:
    system = machine.model()
    for record in (machine.day(31, "path", recorded=True), machine.day(31, "nothing", swing=1e-3)):
        fit = rt.diagnosis.refit(system, record, rt.diagnosis.noise_floor(system, record))
        assert with_random_ambients(fit) is None


def at_rest(n: int) -> LinearizedRecord:
    """Two lumps, of which one is joined to the room; the room is not recorded."""
    links = [{"between": ("a", "room"), "conductance": 0.2}, {"between": ("a", "b"), "conductance": 0.3}]
    system = rt.System(ambients={"room": {"temperature": 300.0}}, links=links,
                       lumps={"a": {"capacity": 10.0}, "b": {"capacity": 4.0}},
                       inputs={"q": {"lump": "a"}},
                       sensors={"Ta": {"lump": "a", "noise": 0.05}, "Tb": {"lump": "b", "noise": 0.02}})
    record = rt.Record(sample_time=3.0, inputs=np.zeros(n), outputs=np.full((n, 2), 300.0), input_names=["q"],
                       output_names=["Ta", "Tb"])
    return linearized_record(system, as_measured(system, record, "records")[0])


def dense(n: int) -> np.ndarray:
    """Covariance (2n, 2n) of the readings: impulse responses of both lumps to the room, times that of the room."""
    M = np.array([[-0.5 / 10.0, 0.3 / 10.0], [0.3 / 4.0, -0.3 / 4.0]])
    wide = np.zeros((3, 3))
    wide[:2, :2], wide[0, 2] = M, 0.2 / 10.0
    step = expm(3.0 * wide)
    A, b = step[:2, :2], step[:2, 2]
    answer = [np.zeros(2), b]
    while len(answer) < n:
        answer.append(A @ answer[-1])
    L = np.zeros((n, 2, n))
    for k in range(n):
        for j in range(k):
            L[k, :, j] = answer[k - j]
    L = L.reshape(2 * n, n)
    return L @ (STD**2 * toeplitz(POLE ** np.arange(n))) @ L.T + np.diag(np.tile(NOISE**2, n))


def room() -> RandomAmbients:
    return RandomAmbients(np.array([STD]), POLE, np.array([[0.2], [0.0]]))


def test_the_filter_is_the_inverse_cholesky_factor() -> None:
    n = 60
    L_inverse = whitener(at_rest(n), NOISE, np.zeros(2), None, room())(np.eye(2 * n).reshape(n, 2, 2 * n))
    expected = np.linalg.inv(cholesky(dense(n), lower=True))
    np.testing.assert_allclose(L_inverse.reshape(2 * n, 2 * n), expected, atol=1e-9 * np.abs(expected).max())


def test_the_settled_cost_is_the_log_likelihood() -> None:
    n, path = 500, at_rest(500)
    S = dense(n)
    r = cholesky(S, lower=True) @ np.random.default_rng(3).standard_normal(2 * n)
    exact = float(r @ np.linalg.solve(S, r)) + float(np.linalg.slogdet(S)[1])
    assert settled_cost(path, r.reshape(n, 2), NOISE, np.zeros(2), None, room()) == pytest.approx(exact, abs=8.0)
    assert settled_cost(path, r.reshape(n, 2), NOISE, np.zeros(2)) > exact + 1000.0


def test_conductances_to_the_room_carry_it() -> None:
    path = at_rest(5)
    found = NoiseScaling(1.0, {}, wander=0.4, pace=300.0).wandering(path)
    assert found is not None and found.G.tolist() == [[0.2], [0.0]] and found.std.tolist() == [0.4]
    assert found.pole == pytest.approx(np.exp(-3.0 / 300.0)) and NoiseScaling(1.0, {}).wandering(path) is None


def test_the_first_sentence_says_what_is_left_of_the_gap() -> None:
    """Free runs know nothing of the room: with the mass their error may even rise, and no fall is claimed."""
    still = rt.diagnose(machine.model(), machine.day(41, "path", recorded=True), effects=["missing_link"])
    assert "falls from" in answer_sentence(still) and "a room that wanders" not in answer_sentence(still)
    assert number_that_matters(still)[2].startswith("Noise alone would give")
    fit = replace(still.fit, levels=replace(still.fit.levels, wander=0.4, pace=300.0))
    moved = replace(still, fit=fit, gap={"train": rt.diagnosis.Gap(0.20, 0.19, 0.18)})
    assert "goes from 0.2 to 0.19 K: what a room that wanders does is in both." in answer_sentence(moved)
    assert "falls" not in answer_sentence(moved)
    assert number_that_matters(moved)[2] == "Noise and a room that wanders would give 0.18 K."
