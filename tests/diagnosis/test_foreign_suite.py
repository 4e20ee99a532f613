"""The suite with foreign truth: its integrator against scipy's, its tables on known answers, and a null of its own."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import robthermal as rt

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))
from foreign.cases import SUB, Case, H, _Bench, all_cases, made  # noqa: E402 - beside the benchmarks
from foreign.hidden import CATALOG, MAKE, OUTSIDE, Hidden, lagged  # noqa: E402
from foreign.judge import answer, one_path, print_sizes, sizes, wilson  # noqa: E402
from foreign.machines import MACHINES, ROOM  # noqa: E402
from foreign.march import march  # noqa: E402
from foreign.peers import beta_of, risks, unfalsified  # noqa: E402


@pytest.mark.parametrize("machine", MACHINES)
def test_machines_are_fine_and_networks_small(machine):
    made_ = MACHINES[machine](np.random.default_rng(0))
    assert len(made_.plant.capacity) >= 150
    assert 4 <= len(made_.plant.zones) <= (8 if machine in OUTSIDE else 9)
    zones = np.concatenate(list(made_.plant.zones.values()))
    assert zones.size == np.unique(zones).size == len(made_.plant.capacity)
    _, K, B = made_.plant.matrices()
    lost = -np.asarray(K.sum(axis=1)).ravel()  # at equal temperatures only the ambients take heat
    assert np.allclose(lost, B[:, -len(made_.ambients):].sum(axis=1))


@pytest.mark.parametrize(("machine", "effect"), [("stack", "seebeck_slope"), ("bar", "radiation"),
                                                 ("housing", "missing_link")])
def test_the_integrator_agrees_with_scipy(machine, effect):
    """Stiff cells, legs with a current, heat that is not linear: second order in the step."""
    rng = np.random.default_rng(3)
    one = MACHINES[machine](rng)
    where = CATALOG[machine][effect][0][0]
    hidden = MAKE[effect](one, where, CATALOG[machine][effect][1])
    n = 40
    U = np.repeat([[rng.uniform(*one.limits[name]) if name in one.limits else ROOM for name in one.plant.columns]], n,
                  axis=0)
    C, K, B = one.plant.matrices()
    T0 = np.full(C.size, ROOM)

    def rate(t, T):
        Q = B @ U[0] + K @ T
        for legs in one.plant.legs:
            legs.heat(T, U[0], Q)
        for heat in hidden.heats:
            heat(t, T, U[0], Q)
        return Q / C

    exact = solve_ivp(rate, (0, (n - 1) * H / SUB), T0, method="BDF", rtol=1e-9, atol=1e-9,
                      t_eval=[(n - 1) * H / SUB]).y[:, -1]
    seen = np.array([exact[cells].mean() for cells in one.plant.sensors.values()])
    own = march(one.plant, U, T0, H, SUB, hidden.heats)[-1]
    assert np.abs(own - seen).max() < 2e-3 * np.abs(seen - ROOM).max()


def test_a_lag_is_the_closed_form():
    t = np.arange(0.0, 300.0, 2.0)
    ramp = 0.1 * t
    assert np.allclose(lagged(ramp, 30.0, 2.0), 0.1 * (t - 30.0 * (1 - np.exp(-t / 30.0))), atol=0.02)


def test_a_null_is_as_coarse_as_asked_for_and_says_nothing():
    one = made(Case("bar", "nothing", "nothing", 0))
    assert one.truth == [] and 1.4 < one.discrete < 11.0
    fit = rt.diagnosis.refit(one.system, one.train)
    noise = next(iter(one.system.sensors.values())).noise
    assert fit.rms / noise == pytest.approx(one.discrete**0.5, rel=0.05)
    assert one.coarse == pytest.approx((fit.rms**2 - noise**2) ** 0.5, rel=0.1)


def test_seeds_and_keys():
    keys = [case.key for case in all_cases([0, 1])]
    assert len(keys) == len(set(keys)) == 2 * sum(len(CATALOG[machine]) for machine in OUTSIDE) + 16 + 2 * 10
    assert Hidden().heats == []


LINK, LAG = ["missing_link", ["x1", "x4"]], ["sensor_lag", ["T1"]]


@pytest.mark.parametrize(("verdict", "names", "others", "truth", "expected"), [
    ("named", [LINK], [[]], [["missing_link", ["x4", "x1"]]], "unique"),
    ("named_with_remainder", [LAG], [[]], [LINK], "WRONG"),
    ("named_with_remainder", [LINK, LAG], [[], []], [LINK], "WRONG"),
    ("ambiguous", [LAG], [[LINK]], [LINK], "in the set"),
    ("ambiguous", [LAG], [[LINK]], [], "set without"),
    ("unexplained", [], [], [LINK], "refused"),
])
def test_answers_are_judged(verdict, names, others, truth, expected):
    assert answer({"verdict": verdict, "names": names, "others": others, "truth": truth}) == expected


@pytest.mark.parametrize(("names", "others", "one"), [
    ([["missing_link", ["sample", "sink"]]], [[["missing_link", ["sample", "hot"]]]], True),
    ([["missing_link", ["sample", "hot"]]], [[["missing_link", ["sample", "sink"]]]], True),
    ([["missing_link", ["sample", "sink"]]], [[]], True),
    ([["missing_link", ["sample", "sink"]]], [[["missing_link", ["hot", "spreader"]]]], True),
    ([["missing_link", ["sample", "sink"]]], [[["missing_link", ["cold", "hot"]]]], False),
    ([["missing_link", ["sample", "sink"]]], [[["missing_link", ["sink", "cold"]]]], False),
    ([["missing_link", ["sample", "sink"]]], [[["natural_convection", ["sample", "hot"]]]], False),
    ([["missing_link", ["sample", "hot"]]], [[]], False)])
def test_a_path_at_neighboring_lumps_is_one_answer(names, others, one):
    row = {"key": "stack/hidden/missing_link/1", "verdict": "ambiguous", "names": names, "others": others,
           "truth": [["missing_link", ["sample", "sink"]]]}
    assert one_path(row) is one


def test_sizes_are_compared_with_the_truth(capsys):
    """Of right names only; 0.4 off is 4 deviations of the first, 0.3 off 0.3 of the second."""
    named = [{"effect": name, "where": where, "parameters": {"first": {"value": value, "std": std}, "other": {}}}
             for (name, where), value, std in ((LINK, 1.4, 0.1), (LAG, 9.0, 0.1), (LINK, 0.7, 1.0))]
    found = sizes(named, [("missing_link", ("x4", "x1"), 1.0)])
    assert found == [{"found": 1.4, "std": 0.1, "true": 1.0}, {"found": 0.7, "std": 1.0, "true": 1.0}]
    print_sizes(found)
    assert capsys.readouterr().out == ("size within 1.96 stated deviations of the truth 50 % of 2, within 3 50 %; "
                                       "median off by 35.0 %, stated 55.0 %\n")


def test_a_slope_of_legs_is_in_the_unit_of_the_catalog():
    """Relative in the legs, absolute in the catalog; the plain machine has one already."""
    bench = _Bench(Case("stack", "hidden", "seebeck_slope", 3))
    (legs,) = bench.machine().plant.legs
    assert bench.as_cataloged(0.0) == legs.S * legs.S_slope != 0.0
    assert bench.as_cataloged(1e-3) - bench.as_cataloged(0.0) == pytest.approx(1e-3 * legs.S)
    assert _Bench(Case("stack", "hidden", "sensor_lag", 3)).as_cataloged(12.0) == 12.0


@pytest.mark.parametrize(("r", "v"), [(1.0, 0.5), (0.2, 1e-4), (5.0, 8.0), (3.0, 0.4)])
def test_increments_have_the_center_and_the_metric_variance_asked_for(r, v):
    """By sampling: the mean of ln(x / (1 - x)) is ln r, its variance v (Rene and Longtin 2025, supplement)."""
    x = np.random.default_rng(2).beta(*beta_of(r, v), 200_000)
    odds = np.log(x) - np.log1p(-x)
    assert odds.mean() == pytest.approx(np.log(r), abs=4 * np.sqrt(v / x.size))
    assert odds.var() == pytest.approx(v, rel=0.05)


def test_a_model_that_holds_falsifies_bad_ones_and_no_equal():
    z = np.random.default_rng(0).standard_normal(6000)
    good, alike, bad = 0.5 * z**2, 0.5 * z[::-1] ** 2, 0.5 * (3.0 * z) ** 2
    assert unfalsified([bad, good, alike], 2.0**-6) == [1, 2]
    drawn = risks(good, 2.0**-6, np.random.default_rng(1))
    assert drawn.mean() == pytest.approx(0.5, rel=0.1) and drawn.std() < 0.02
    assert unfalsified([bad, good, alike], 4.0) == [0, 1, 2]  # a scale that lets the bad one vary that much


@pytest.mark.parametrize(("k", "n"), [(0, 8), (15, 17), (9, 9)])
def test_intervals_are_those_of_wilson(k, n):
    """The ends p solve |k/n - p| = z sqrt(p (1 - p) / n)."""
    ends = np.array(wilson(k, n))
    assert np.abs(k / n - ends) == pytest.approx(1.959964 * np.sqrt(ends * (1 - ends) / n), abs=1e-9)
