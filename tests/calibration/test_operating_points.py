"""One model for all operating points, from frequency responses at several: S(T), R(T) and K of a foreign rig."""

from __future__ import annotations

import numpy as np
import pytest
import scipy
from voltage_rig import ROOM, TRUE, drive, system, voltage

import robthermal as rt

pytestmark = pytest.mark.exhaustive

H, N, NOISE = 4.0, 700, np.array([0.02, 0.002])  # s, samples, K and V
POINTS = (-0.8, 0.5, 1.8)  # A
NAMES = {"modules.m1.seebeck.value": "S", "modules.m1.seebeck.slope": "dS", "modules.m1.resistance.value": "R",
         "modules.m1.resistance.slope": "dR", "modules.m1.conductance.value": "K"}
RANGES = {"modules.m1.seebeck.value": (0.03, 0.08), "modules.m1.seebeck.slope": (0.0, 5e-4),
          "modules.m1.resistance.value": (1.0, 4.0), "modules.m1.resistance.slope": (0.0, 0.05),
          "modules.m1.conductance.value": (0.1, 1.5)}
START = {"modules.m1.seebeck.value": 0.06, "modules.m1.resistance.value": 2.8, "modules.m1.conductance.value": 0.7,
         "modules.m1.seebeck.slope": 2e-4, "modules.m1.resistance.slope": 0.02}


def rate(T: np.ndarray, current: np.ndarray, p: dict[str, float] = TRUE) -> np.ndarray:
    """Balances of both faces by hand, the columns of T are runs."""
    hot, cold = T
    above = 0.5 * (hot + cold) - p["T_ref"]
    S, R = p["S"] + p["dS"] * above, p["R"] + p["dR"] * above
    back, joule = p["K"] * (hot - cold), 0.5 * R * current**2
    return np.stack([(S * hot * current + joule - back - 1.1 * (hot - ROOM)) / 70.0,
                     (-S * cold * current + joule + back - 0.06 * (cold - ROOM)) / 35.0])


def log(currents: np.ndarray) -> np.ndarray:
    """T_cold and V1 of several runs at once (n, runs, 2), currents (n, runs): Runge and Kutta, eight steps a sample."""
    T, h, read = np.full((2, currents.shape[1]), ROOM), H / 8, []
    for current in currents:
        read.append(np.stack([T[1], voltage(T[0], T[1], current)], axis=-1))
        for _ in range(8):
            a = rate(T, current)
            b = rate(T + h / 2 * a, current)
            c = rate(T + h / 2 * b, current)
            d = rate(T + h * c, current)
            T = T + h / 6 * (a + 2 * b + 2 * c + d)
    return np.array(read)


def record(currents: np.ndarray, clean: np.ndarray, rng: np.random.Generator) -> rt.Record:
    return drive(currents, H).with_outputs(clean + NOISE * rng.standard_normal(clean.shape), ["T_cold", "V1"])


@pytest.fixture(scope="module")
def responses() -> list[rt.FrequencyResponse]:
    """Multisines of 0.1 A about each current, after half an hour at it."""
    wait, rng = 450, np.random.default_rng(1)
    small = np.array([rt.signals.multisine(N, sample_time=H, band=(0.0, 0.12), rms=0.1, seed=k) for k in range(3)])
    currents = np.array(POINTS) + np.vstack([np.zeros((wait, 3)), small.T])
    clean = log(currents)[wait:]
    return [rt.identify.lpm(record(currents[wait:, k], clean[:, k], rng)) for k in range(3)]


@pytest.fixture(scope="module")
def sweep() -> rt.Record:
    """A trajectory that no response has seen: large steps between the operating points."""
    currents = np.repeat([0.0, 1.5, -0.5, 1.0, 1.9, 0.3, -0.8, 0.6], 60)
    return record(currents, log(currents[:, None])[:, 0], np.random.default_rng(2))


@pytest.fixture(scope="module")
def joint(responses: list[rt.FrequencyResponse], sweep: rt.Record) -> rt.calibration.Fit:
    return rt.calibrate(system().with_parameters(START), responses, parameters=RANGES, validation=sweep)


def test_responses_at_several_currents_give_one_model(joint: rt.calibration.Fit) -> None:
    assert joint.outcome.code == "converged", joint.outcome
    off = np.array([(joint.parameters[name] - TRUE[key]) / joint.std[name] for name, key in NAMES.items()])
    assert (abs(off) < 4).all(), off
    assert joint.std["modules.m1.resistance.slope"] < 0.1 * TRUE["dR"]
    assert [each.operating_point["m1"] for each in joint.responses] == pytest.approx(POINTS, abs=1e-3)
    assert all(0.7 < each.misfit < 1.5 for each in joint.responses)


def test_one_operating_point_leaves_the_slopes_open(joint: rt.calibration.Fit, responses: list[rt.FrequencyResponse],
                                                   sweep: rt.Record) -> None:
    """What several points add: the slopes at least ten times better, and a model that predicts."""
    local = rt.calibrate(system().with_parameters(START), responses[1], parameters=RANGES, validation=sweep)
    assert local.outcome.code == "undetermined"
    for slope in ("modules.m1.seebeck.slope", "modules.m1.resistance.slope"):
        assert local.std[slope] > 10 * joint.std[slope]
    assert local.validation[0].rmse["V1"] > 2 * joint.validation[0].rmse["V1"]


def test_it_predicts_a_trajectory_between_the_points(joint: rt.calibration.Fit, sweep: rt.Record) -> None:
    """Large steps: 70 mK and 6 mV off, as the uncertainty of the parameters says, noise included."""
    run = joint.validation[0]
    rng, root = np.random.default_rng(3), np.linalg.cholesky(joint.covariance)
    first = {"hot": ROOM, "cold": ROOM}
    mean = rt.thermal.simulate(joint.system, sweep, initial=first)
    spread = []
    for _ in range(12):
        values = np.array([*joint.parameters.values()]) + root @ rng.standard_normal(len(RANGES))
        other = joint.system.with_parameters(dict(zip(joint.parameters, values.tolist(), strict=True)))
        spread.append(rt.thermal.simulate(other, sweep, initial=first).outputs - mean.outputs)
    expected = np.sqrt(np.mean(np.square(spread), axis=(0, 1)) + NOISE**2)
    assert 0.3 * expected[0] < run.rmse["T_cold"] < 2.5 * expected[0] < 0.3
    assert 0.3 * expected[1] < run.rmse["V1"] < 2.5 * expected[1] < 0.03


def test_predictions_at_two_points_share_their_error(joint: rt.calibration.Fit) -> None:
    """Voltages at rest at 0.2 and 1.2 A, where nothing was measured: true values within what the covariance of the
    parameters says, and their errors are correlated, because one set of parameters makes both."""
    def at_rest(values: np.ndarray) -> np.ndarray:
        p = TRUE | dict(zip(NAMES.values(), values.tolist(), strict=True))
        rest = [scipy.optimize.fsolve(lambda T, i=i: rate(T, i, p), [ROOM, ROOM], xtol=1e-10) for i in (0.2, 1.2)]
        return np.array([voltage(*T, i, p) for T, i in zip(rest, (0.2, 1.2), strict=True)])

    found = np.array([joint.parameters[name] for name in NAMES])
    J = np.array([(at_rest(found + h) - at_rest(found - h)) / (2 * h.sum()) for h in np.diag(1e-4 * found)]).T
    covariance = J @ joint.covariance @ J.T
    off = at_rest(found) - at_rest(np.array([TRUE[key] for key in NAMES.values()]))
    assert off @ np.linalg.solve(covariance, off) < 18.4  # of chi-squared with 2 degrees, 1 in 10 000
    assert abs(covariance[0, 1]) > 0.3 * np.sqrt(covariance[0, 0] * covariance[1, 1])
    assert (np.sqrt(np.diag(covariance)) < 0.01).all()


def test_the_model_with_its_uncertainty_becomes_a_certified_law(joint: rt.calibration.Fit) -> None:
    law = rt.design.tem_feedback(joint.system, temperature=(265.0, 335.0), current=(0.3, 1.3), operating=0.8,
                                 rate=0.004, covariance=joint, ambient={"room": (294.0, 297.0)})
    assert law.holds and rt.verify(law.certificates[0]).valid
    assert "5 uncertain parameters" in str(law.robust_against)
