"""Kind "scheduled" with samples: simulated machines, exact sampled maps, brute force, mutants, both checkers."""

from __future__ import annotations

import copy
import json

import numpy as np
import pytest
from scipy.linalg import expm

import recheck
import robthermal as rt
from robthermal.errors import InputError
from robthermal.verification import establish

STAGE = rt.System(
    ambients={"room": {"temperature": 298.0}},
    lumps={"plate": {"capacity": 60.0}, "module": {"capacity": 12.0}, "sink": {"capacity": 90.0}},
    links=[{"between": ("plate", "module"), "conductance": 5.0}, {"between": ("sink", "room"), "conductance": 4.0},
           {"between": ("plate", "room"), "conductance": 0.15}],
    modules={"m": {"hot": "sink", "cold": "module", "seebeck": {"value": 0.052}, "resistance": {"value": 2.1},
                   "conductance": {"value": 0.5}, "reference_temperature": 298.0}})
BOX = {"temperature": (265.0, 335.0), "current": {"m": (0.2, 1.8)}}
E = np.array([60.0, 12.0, 90.0])


def slope(x, current, room=298.0, load=0.0):
    """E^-1 f, written out."""
    plate, module, sink = x.T
    cold = -0.052 * module * current + 1.05 * current**2 + 0.5 * (sink - module)
    hot = 0.052 * sink * current + 1.05 * current**2 + 0.5 * (module - sink)
    return np.stack([5 * (module - plate) + 0.15 * (room - plate) + load, 5 * (plate - module) + cold,
                     4 * (room - sink) + hot], axis=-1) / E


@pytest.fixture(scope="module")
def design():
    return rt.design.tem_feedback(STAGE, temperature=BOX["temperature"], current=(0.2, 1.8), operating=1.0, rate=0.012)


def certified(d, T, share=1.0, **more):
    return rt.certify.scheduled(STAGE, gain=share * d.gain, matrix=d.matrix, level=1.0, rate=d.rate,
                                operating_temperatures=d.operating_temperatures, operating_current={"m": 1.0},
                                sample_time=T, **BOX, **more)


def linear(d):
    x0 = np.array(list(d.operating_temperatures.values()))
    eye = 1e-30j * np.eye(3)
    A = np.array([slope(x0 + row, 1.0).imag / 1e-30 for row in eye]).T
    return A, (slope(x0, 1.0 + 1e-30j).imag / 1e-30)[:, None]


def moved(A, B, F, T):
    """The exact map from sample to sample of the linearized machine with held currents."""
    both = expm(np.block([[A, B], [np.zeros((1, 4))]]) * T)
    return both[:3, :3] + both[:3, 3:] @ F


def norm_in(P, M):
    L = np.linalg.cholesky(P)
    return float(np.linalg.norm(L.T @ M @ np.linalg.inv(L.T), 2))


@pytest.mark.parametrize(("T", "load"), [(1.0, 0.0), (2.0, 0.0), (1.0, 0.1)])
def test_the_simulated_machine_does_what_the_sentence_says(design, T, load):
    """40 starts on the boundary, Runge-Kutta between the samples; heat and room at their ends, changing at random."""
    ranges = {"heat": {"plate": (-load, load)}, "ambient": {"room": (298.0 - load, 298.0 + load)}} if load else {}
    cert = certified(design, T, **ranges)
    assert cert.holds and rt.verify(cert).valid and f"sampled every {T:g} s and the currents held" in cert.claim
    rate, rng = cert.region["sampled_rate"], np.random.default_rng(2)
    assert 0 < rate < design.rate
    x0, root = np.array(list(design.operating_temperatures.values())), np.linalg.cholesky(np.linalg.inv(design.matrix))
    e = rng.standard_normal((40, 3))
    x, steps = x0 + (e / np.linalg.norm(e, axis=1)[:, None]) @ root.T, 10
    for _ in range(60):
        current = 1.0 + (x - x0) @ design.gain[0]
        assert 0.2 <= current.min() and current.max() <= 1.8
        before = np.einsum("ki,ij,kj->k", x - x0, design.matrix, x - x0)
        sign = rng.choice([-1.0, 1.0], 2)
        for _ in range(steps):
            h, more = T / steps, (298.0 + load * sign[0], load * sign[1])
            a = slope(x, current, *more)
            b = slope(x + h / 2 * a, current, *more)
            c = slope(x + h / 2 * b, current, *more)
            x = x + h / 6 * (a + 2 * b + 2 * c + slope(x + h * c, current, *more))
            V = np.einsum("ki,ij,kj->k", x - x0, design.matrix, x - x0)
            assert V.max() <= 1 + 1e-9
        if not load:
            assert (V <= before * np.exp(-2 * rate * T) + 1e-9).all()


def test_certified_means_that_the_exact_sampled_map_contracts(design):
    """Gains from 0 to 1 times, samples from 0.1 to 300 s: the P-norm of the linear map bears every certified rate."""
    A, B = linear(design)
    counts = [0, 0]
    for share in (0.0, 0.5, 1.0):
        for T in np.geomspace(0.1, 300, 12):
            cert = certified(design, float(T), share)
            size = norm_in(design.matrix, moved(A, B, share * design.gain, T))
            if cert.holds:
                assert size <= np.exp(-cert.region["sampled_rate"] * T) * (1 + 1e-6)
            counts[0] += cert.holds
            counts[1] += "decay is lost between the samples" in cert.reason
    assert counts[0] >= 5 and counts[1] >= 6
    F = -8.0 * np.sign(B).T  # oscillates and is unstable when sampled slowly
    T = next(T for T in np.geomspace(0.1, 100, 60) if np.abs(np.linalg.eigvals(moved(A, B, F, T))).max() > 1)
    cert = rt.certify.scheduled(STAGE, gain=F, matrix=design.matrix, level=0.01, rate=1e-4, sample_time=float(T),
                                operating_temperatures=design.operating_temperatures, operating_current={"m": 1.0},
                                temperature=BOX["temperature"], current={"m": (-40.0, 42.0)})
    assert not cert.holds


def test_bounds_of_the_slopes_by_brute_force(design):
    """C and C' of 4000 points of the box lie below the checker's, and reach half of them."""
    from flint import arb_mat

    from robthermal.verification import _scheduled
    from robthermal.verification._scheduled_sampled import sampled_gains
    cert = certified(design, 1.0)
    problem = _scheduled.read(cert.system, cert.region, cert.evidence, {})
    P = arb_mat(design.matrix.tolist())
    C, pushed = (float(value) for value in sampled_gains(problem.system, problem.region, problem.heats, problem.gain, P,
                                                         P.inv()))
    rng, W, F = np.random.default_rng(0), np.linalg.inv(design.matrix), design.gain[0]

    def dual(row):
        return np.sqrt(row @ W @ row)

    strength = speed = push = 0.0
    for _ in range(1000):
        x, current = rng.choice([265.0, 335.0], 3), rng.choice([0.2, 1.8])
        J = np.array([slope(x + row, current).imag / 1e-30 for row in 1e-30j * np.eye(3)]).T
        b = slope(x, current + 1e-30j).imag / 1e-30
        strength, speed = max(strength, np.sqrt(b @ design.matrix @ b)), max(speed, dual(F @ J))
        push = max(push, abs(F @ b))
    assert strength * (speed + push * dual(F)) <= C * (1 + 1e-9) <= 2 * strength * (speed + push * dual(F))
    assert strength * dual(F) <= pushed * (1 + 1e-9) <= 1.01 * strength * dual(F)


def second(document):
    return recheck.check(json.loads(json.dumps(document, default=dict))).status


def document_of(cert):
    return {"format": cert.format, "kind": cert.kind, "claim": cert.claim,
            **{key: getattr(cert, key) for key in ("system", "region", "evidence", "margin", "made_by")}}


def test_mutants_are_rejected_where_they_are_false_and_both_checkers_agree(design):
    """Sample time, rates, level, gain and matrix changed by factors: what is accepted passes the exact sampled map."""
    start = document_of(certified(design, 2.0))
    assert second(start) == "valid"
    A, B = linear(design)
    rng, accepted, refused = np.random.default_rng(7), 0, 0
    for trial in range(30):
        one = copy.deepcopy(start)
        factor = float(10 ** rng.uniform(-1, 1)) if trial % 2 else float(1 + 10 ** rng.uniform(-9, -1))
        key = ("sample_time", "sampled_rate", "rate", "level", "gain", "matrix")[trial % 6]
        if key == "gain":
            one["system"]["gain"][0][trial % 3] *= factor
        elif key == "matrix":
            one["evidence"]["matrix"][trial % 3][trial % 3] *= factor
        else:
            one["region"][key] = float(one["region"][key]) * factor
        first = establish("scheduled", **{part: one[part] for part in ("system", "region", "evidence", "margin")},
                          made_by={})
        one["claim"] = first.claim.removeprefix("Not certified: ")
        other = second(one)
        assert not (first.holds and other == "not valid") and not (other == "valid" and not first.holds), first.reason
        if first.holds:
            P, F = np.array(one["evidence"]["matrix"], float), np.array(one["system"]["gain"], float)
            T, rate = (float(one["region"][name]) for name in ("sample_time", "sampled_rate"))
            assert norm_in(P, moved(A, B, F, T)) <= np.exp(-rate * T) * (1 + 1e-6)
        accepted, refused = accepted + first.holds, refused + (not first.holds)
    assert accepted >= 8 and refused >= 8


def test_the_second_checker_reads_the_sentence(design):
    one = document_of(certified(design, 2.0))
    assert second({**one, "claim": one["claim"].replace("every 2 s", "every 3 s")}) == "not valid"


def test_design_for_samples(design):
    d = rt.design.tem_feedback(STAGE, temperature=BOX["temperature"], current=(0.2, 1.8), operating=1.0, rate=0.009,
                               sample_time=5.0)
    assert d.holds and d.rate == 0.009 and d.sample_time == 5.0 and rt.verify(d.certificates[0]).valid
    assert d.certificates[0].region["rate"] > 0.009 and d.semi_axes[0] > 5
    A, B = linear(d)
    assert norm_in(d.matrix, moved(A, B, d.gain, 5.0)) <= np.exp(-0.009 * 5.0)
    slow = rt.design.tem_feedback(STAGE, temperature=BOX["temperature"], current=(0.2, 1.8), operating=1.0, rate=0.012,
                                  sample_time=600.0)
    assert not slow.holds and "sampled every 600 s" in slow.outcome.text and not slow.certificates


@pytest.mark.parametrize(("change", "words"), [
    ({"sample_time": 1.0}, "'sampled_rate' is missing"), ({"sampled_rate": 0.01}, "'sample_time' is missing"),
    ({"sample_time": 0, "sampled_rate": 0.01}, "sample_time"), ({"sample_time": 1, "sampled_rate": -1}, "sampled_rate"),
    ({"sample_time": "x", "sampled_rate": 0.01}, "sample_time")])
def test_malformed_samples(design, change, words):
    one = document_of(certified(design, 1.0))
    region = {key: value for key, value in one["region"].items() if not key.startswith("sample")} | change
    with pytest.raises(InputError, match=words):
        establish("scheduled", system=one["system"], region=region, evidence=one["evidence"], margin={}, made_by={})
    assert second({**one, "region": region}) == "not valid"


@pytest.mark.parametrize("arguments", [{"sample_time": 0.0}, {"sample_time": -1.0}, {"sample_time": "fast"},
                                       {"sample_time": 1.0, "sampled_rate": 0.0}])
def test_bad_sample_times_are_named(design, arguments):
    with pytest.raises(InputError, match="sample"):
        certified(design, arguments.pop("sample_time"), **arguments)
