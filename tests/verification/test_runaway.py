"""Runaway of one module against the hot-side equilibrium itself, solved numerically."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from flint import fmpq
from scipy.optimize import minimize_scalar

from robthermal.errors import InputError
from robthermal.verification import establish
from robthermal.verification._box_sign import positive_on

MODULE = {"seebeck": 0.053743, "resistance": 4.6298, "conductance": 0.2968, "sink_conductance": 0.689,
          "sink_temperature": 298.15, "setpoint": 278.15}


def load(system, current):
    """Heat taken from the cold face at the hot-side equilibrium, from the two energy balances [W]."""
    S, R, K, g, w, cold = (float(system[key]) for key in MODULE)
    hot = (R * current**2 / 2 + K * cold + g * w) / (g + K - S * current)
    assert abs(S * hot * current + R * current**2 / 2 + K * (cold - hot) - g * (hot - w)) < 1e-9 * g * hot
    return S * cold * current - R * current**2 / 2 - K * (hot - cold)


def fold(system):
    S, K, g = (float(system[key]) for key in ("seebeck", "conductance", "sink_conductance"))
    found = minimize_scalar(lambda i: -load(system, i), bounds=(0.0, 0.999 * (g + K) / S), method="bounded",
                            options={"xatol": 1e-9})
    return found.x, -found.fun


def make(system, current, heat):
    return establish("runaway", system=system, region={}, evidence={"current": current, "load": heat}, made_by={})


def enclosed(system, *, shift=0.0, width=1e-3, lift=0.0):
    current, heat = fold(system)
    return make(system, [current + shift - width, current + shift + width],
                [heat + lift - 1e-3, heat + lift + 1e-3])


@pytest.mark.parametrize(("g", "current", "heat"), [
    (0.25, 0.73, -0.31), (0.5, 1.25, 2.02), (0.689, 1.54, 3.76), (1.0, 1.89, 6.14), (2.0, 2.46, 10.6),
    (5.0, 2.94, 14.9)])
def test_published_table(g, current, heat):
    """The table of the surrogate module at x_c = 278 K, w = 298 K, to its rounding, with S and R taken at 300 K."""
    offset = 300 - 308.15
    system = {**MODULE, "seebeck": 0.053743 + 7.421e-5 * offset, "resistance": 4.6298 + 0.022751 * offset,
              "sink_conductance": g, "setpoint": 278.0, "sink_temperature": 298.0}
    assert fold(system)[0] == pytest.approx(current, abs=0.01)
    assert fold(system)[1] == pytest.approx(heat, abs=0.08)
    assert enclosed(system).holds


@pytest.mark.exhaustive
def test_random_modules_only_the_true_fold():
    rng = np.random.default_rng(0)
    held = 0
    for _ in range(60):
        system = {key: value * float(rng.uniform(0.8, 1.25)) if "temp" not in key and key != "setpoint" else value
                  for key, value in MODULE.items()}
        current, _ = fold(system)
        if current < 0.01:
            continue
        held += 1
        assert enclosed(system).holds
        for wrong in (dict(shift=0.01), dict(shift=-0.01), dict(lift=0.01), dict(lift=-0.01)):
            refused = enclosed(system, **wrong)
            assert not refused.holds and refused.reason
    assert held > 50


def test_very_narrow_enclosure():
    current, heat = fold(MODULE)
    assert make(MODULE, [current - 1e-6, current + 1e-6], [heat - 1e-6, heat + 1e-6]).holds


def test_interval_that_contains_no_fold_or_starts_wrong():
    current, heat = fold(MODULE)
    assert not make(MODULE, [current + 1, current + 2], [heat - 1, heat + 1]).holds
    assert not make(MODULE, [0.0, current / 2], [heat - 9, heat + 9]).holds
    assert not make(MODULE, [-1.0, current + 0.1], [heat - 9, heat + 9]).holds
    beyond = (MODULE["sink_conductance"] + MODULE["conductance"]) / MODULE["seebeck"] + 1e-3
    assert not make(MODULE, [current - 0.1, beyond], [-1e6, 1e6]).holds


def test_no_useful_current_at_all():
    """A sink so hot that the load falls from the first ampere on: q'(0) < 0, no fold to certify."""
    system = {**MODULE, "sink_temperature": 900.0, "sink_conductance": 0.3}
    assert not make(system, [0.0, 1.0], [-1e3, 1e3]).holds


@pytest.mark.parametrize("key", list(MODULE))
def test_malformed(key):
    for value in (-1.0, 0.0, None, "x"):
        with pytest.raises(InputError, match=key):
            make({**MODULE, key: value}, [1, 2], [1, 2])
    with pytest.raises(InputError, match=key):
        make({name: value for name, value in MODULE.items() if name != key}, [1, 2], [1, 2])


def family(ranges, current, heat):
    return establish("runaway", system=MODULE, region={"parameters": ranges}, made_by={},
                     evidence={"current": current, "load": heat})


def test_a_family_of_modules_holds_exactly_the_folds_of_its_members():
    rng = np.random.default_rng(4)
    for names in (["seebeck"], ["resistance", "sink_conductance"], ["sink_temperature", "conductance", "setpoint"]):
        ranges = {name: [0.97 * MODULE[name], 1.02 * MODULE[name]] if "temp" not in name and name != "setpoint" else
                  [MODULE[name] - 2, MODULE[name] + 1] for name in names}
        corners = [dict(zip(names, chosen, strict=True)) for chosen in itertools.product(*ranges.values())]
        folds = np.array([fold({**MODULE, **corner}) for corner in corners])
        inside = [fold({**MODULE, **{name: float(rng.uniform(*ranges[name])) for name in names}}) for _ in range(20)]
        low, high = folds.min(axis=0), folds.max(axis=0)
        for slack, holds in ((2e-3, True), (-2e-3, False)):
            currents, heats = [low[0] - slack, high[0] + slack], [low[1] - 10 * abs(slack), high[1] + 10 * abs(slack)]
            certificate = family(ranges, currents, heats)
            assert certificate.holds is holds, (names, slack, certificate.reason)
            if holds:
                assert all(currents[0] <= i <= currents[1] and heats[0] <= q <= heats[1] for i, q in inside)
                assert f"'{names[0]}' in" in certificate.claim
        assert not family(ranges, currents, [low[1] + 0.05, high[1] + 0.1]).holds
        assert not family(ranges, currents, [low[1] - 0.1, high[1] - 0.05]).holds


@pytest.mark.parametrize(("ranges", "message"), [
    ({"modules.m1.seebeck.value": [1, 2]}, "unknown key"), ({"seebeck": [0, 0.1]}, "above zero"),
    ({"seebeck": [0.2, 0.1]}, "is empty"), ([], "not an object")])
def test_malformed_families(ranges, message):
    with pytest.raises(InputError, match=message):
        family(ranges, [1.5, 1.6], [3, 4])


def test_polynomials_on_boxes_are_never_wrongly_called_positive():
    """Random polynomials in three variables against a fine grid."""
    rng = np.random.default_rng(1)
    yes = no = 0
    for _ in range(60):
        terms = {tuple(rng.integers(0, 3, 3).tolist()): fmpq(int(rng.integers(-9, 10))) for _ in range(5)}
        terms[0, 0, 0] = fmpq(int(rng.integers(0, 12)))
        box = [(fmpq(-1), fmpq(1)), (fmpq(0), fmpq(2)), (fmpq(1, 2), fmpq(1, 2))]
        x, y, z = np.meshgrid(np.linspace(-1, 1, 41), np.linspace(0, 2, 41), [0.5])
        least = sum(float(c.p) / float(c.q) * x**i * y**j * z**k for (i, j, k), c in terms.items()).min()
        proven = positive_on(terms, box)
        assert not (proven and least <= 0)
        assert proven or least < 0.5
        yes, no = yes + proven, no + (not proven)
    assert yes > 5 and no > 5


def test_zero_is_not_negative_and_not_positive():
    square = {(2,): fmpq(1)}
    assert positive_on(square, [(fmpq(0), fmpq(1))], strict=False)
    assert not positive_on(square, [(fmpq(0), fmpq(1))])
