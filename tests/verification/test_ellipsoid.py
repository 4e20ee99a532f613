"""Kind "ellipsoid": closed forms to a thousandth, sets that are left and must not be certified, malformed content."""

from __future__ import annotations

import copy

import numpy as np
import pytest

from robthermal.errors import InputError
from robthermal.verification import establish, machine_hash

LAG = {"vertices": [{"A": [[-1]], "B": [[1]]}], "sample_time": 0}  # x' = -x + w
STATIC = {"A": [], "B": [], "C": [[]]}


def made(system, region, evidence):
    return establish("ellipsoid", system=system, region=region, evidence=evidence, made_by={}, margin={})


def test_reachable_set_of_a_lag_is_decided_to_a_thousandth():
    """|w| <= 1 drives x' = -x + w to |x| <= 1, x+ = x/2 + w to |x| <= 2: V = x², the level is its square."""
    for level, holds in ((1.001, True), (0.999, False)):
        for size, more in ((1, {}), ([1], {"multipliers": [level]})):
            evidence = {"matrix": [[1]], "decay": 1, **more}
            assert made(LAG, {"level": level, "disturbance": size}, evidence).holds is holds
    halved = {"vertices": [{"A": [["0.5"]], "B": [[1]]}], "sample_time": 1}
    for level, holds in ((4.001, True), (3.999, False)):
        assert made(halved, {"level": level, "disturbance": 1}, {"matrix": [[1]], "decay": "0.5"}).holds is holds


def test_two_disturbances_one_by_one_need_more_than_together():
    """x' = -x + w1 + w2: |w1|, |w2| <= 1 reach 2; Euclidean norm 1 reaches √2."""
    both = {"vertices": [{"A": [[-1]], "B": [[1, 1]]}], "sample_time": 0}
    for level, holds in ((4.01, True), (3.99, False)):
        evidence = {"matrix": [[1]], "decay": 1, "multipliers": [level / 2 * (1 - 1e-9)] * 2}
        assert made(both, {"level": level, "disturbance": [1, 1]}, evidence).holds is holds
    for level, holds in ((2.01, True), (1.99, False)):
        found = made(both, {"level": level, "disturbance": 1}, {"matrix": [[1]], "decay": 1})
        assert found.holds is holds
    assert "Euclidean norm at most 1 " in found.claim
    dear = {"matrix": [[1]], "decay": 1, "multipliers": [4.01, 4.01]}
    refused = made(both, {"level": 4.01, "disturbance": [1, 1]}, dear)
    assert not refused.holds and "multipliers" in refused.reason


def test_energies_of_a_lag():
    """z = x of x' = -x + w has the L2 gain 1."""
    seen = {**LAG, "performance": {"C": [[1]], "D": [[0]]}}
    for bound, holds in ((1.001, True), (0.999, False)):
        found = made(seen, {"level": 3, "bound": bound}, {"matrix": [[1]]})
        assert found.holds is holds
    assert "from x = 0 under disturbances w of energy (integral of |w|²) at most 3" in found.claim


def test_cost_to_go_of_a_decay():
    """x+ = x/2: the sum of x² is x²/(1 - 1/4); x' = -x + u, u = -x: the integral of x² + u² is x²/2."""
    system = {"vertices": [{"A": [["0.5"]], "B": [[]]}], "sample_time": 1}
    for P, holds in (("1.3334", True), ("1.3333", False)):
        assert made(system, {"level": 1, "cost": {"state": [[1]]}}, {"matrix": [[P]]}).holds is holds
    fed = {"vertices": [{"A": [[-1]], "B": [[1]]}], "sample_time": 0, "controller": {**STATIC, "D": [[-1]]}}
    for P, holds in (("0.5001", True), ("0.4999", False)):
        region = {"level": 1, "cost": {"state": [[1]], "control": [[1]]}}
        assert made(fed, region, {"matrix": [[P]]}).holds is holds
    assert made(fed, {"level": 1, "cost": {"state": [[-9]]}, "rate": 2.001}, {"matrix": [[1]]}).holds is False


def test_limits_in_the_ellipsoid():
    """x² + 4y² <= 1: x below 1, y below ½; with u = -x - y the sum x + y + u is zero."""
    system = {"vertices": [{"A": [[-3, 0], [0, -3]], "B": [[1], [1]]}], "sample_time": 0,
              "controller": {**STATIC, "D": [[-1, -1]]}}
    P = {"matrix": [[1, 0], [0, 4]]}
    for state, control, bound, holds in (([1, 0], 0, 1.001, True), ([1, 0], 0, 0.999, False), ([0, 1], 0, 0.501, True),
                                         ([0, 1], 0, 0.499, False), ([1, 1], 1, 1e-6, True), ([1, 1], 0, 1.12, True),
                                         ([1, 1], 0, 1.11, False)):
        limits = {"state": [state], "control": [[control]], "bound": [bound]}
        assert made(system, {"level": 1, "limits": limits}, P).holds is holds, (state, control, bound)


def unstable(limit=1):
    """x' = x + sat(-2 x), |u| <= limit: every start with |x| < limit returns, no other does."""
    return ({"vertices": [{"A": [[1]], "B": [[1]]}], "sample_time": 0, "controller": {**STATIC, "D": [[-2]]}},
            {"saturation": [limit]})


def test_region_of_attraction_of_an_unstable_lag_up_to_its_edge():
    system, region = unstable()
    assert made(system, {**region, "level": 0.99}, {"matrix": [[1]], "feedback": [["-1.004"]]}).holds
    for feedback in np.linspace(-3, 1, 41):  # beyond the edge: no auxiliary feedback shows it
        for level in (1.001, 1.5):
            assert not made(system, {**region, "level": level}, {"matrix": [[1]], "feedback": [[feedback]]}).holds
    free = {key: value for key, value in region.items() if key != "saturation"}
    assert made(system, {**free, "level": 1.5}, {"matrix": [[1]]}).holds  # without limits: another claim
    assert "limited" not in made(system, {**free, "level": 1.5}, {"matrix": [[1]]}).claim


def test_a_hull_with_an_unstable_plant_inside_is_never_certified():
    A, rng = np.array([[-0.1, 3.0], [0.0, -0.1]]), np.random.default_rng(0)
    system = {"vertices": [{"A": one.tolist(), "B": [[], []]} for one in (A, A.T)], "sample_time": 0}
    for _ in range(40):
        X = rng.standard_normal((2, 2))
        assert not made(system, {"level": 1}, {"matrix": (X @ X.T + 0.1 * np.eye(2)).tolist()}).holds


def test_the_sign_of_the_anti_windup_gain_counts():
    """Integrator behind a limit, x_K' = x + E (v - u): E that unwinds is certified, E that winds up is not."""
    system = {"vertices": [{"A": [["-0.2"]], "B": [[1]]}], "sample_time": 0, "measured": {"C": [[-1]], "D": [[]]},
              "controller": {"A": [[0]], "B": [[1]], "C": [["0.5"]], "D": [[1]], "windup": [[-1]]}}
    P = [[1, "-0.2"], ["-0.2", "0.6"]]
    held = {"matrix": P, "feedback": [[0, 0]]}
    region = {"level": 100, "saturation": [1]}
    assert made(system, region, held).holds
    worse = copy.deepcopy(system)
    worse["controller"]["windup"] = [[1]]
    assert not made(worse, region, held).holds
    assert machine_hash(worse) != machine_hash(system)


REGION, EVIDENCE = {"level": 1, "disturbance": 1}, {"matrix": [[1]], "decay": 1}
FED = {"vertices": [{"A": [[-1]], "B": [[1]]}], "sample_time": 0, "controller": {**STATIC, "D": [[-1]]}}


@pytest.mark.parametrize(("system", "region", "evidence", "words"), [
    (LAG, {"level": 1}, {"matrix": [[1]]}, "1 disturbances"), (LAG, {**REGION, "level": 0}, EVIDENCE, "level"),
    (LAG, {**REGION, "rate": 1}, EVIDENCE, "rate"), (LAG, {**REGION, "disturbance": -1}, EVIDENCE, "disturbance"),
    (LAG, {**REGION, "disturbance": [1, 1]}, EVIDENCE, "disturbance"), (LAG, REGION, {"matrix": [[1]]}, "decay"),
    (LAG, {**REGION, "saturation": [1]}, EVIDENCE, "saturation"), (LAG, {"level": 1, "bound": 1}, EVIDENCE, "perform"),
    ({**LAG, "vertices": []}, REGION, EVIDENCE, "no vertex"), ({**LAG, "gain": [[1]]}, REGION, EVIDENCE, "gain"),
    ({**LAG, "measured": {"C": [[1]], "D": [[0]]}}, REGION, EVIDENCE, "without a controller"),
    ({**LAG, "vertices": [*LAG["vertices"], {"A": [[-1]], "B": [[1, 1]]}]}, REGION, EVIDENCE, "same at every"),
    (FED, {"level": 1, "saturation": [1], "cost": {"state": [[1]]}}, {"matrix": [[1]], "feedback": [[0]]}, "cost"),
    (FED, {"level": 1, "saturation": [1], "limits": {"state": [[1]], "control": [[1]], "bound": [1]}},
     {"matrix": [[1]], "feedback": [[0]]}, "control"),
    (FED, {"level": 1, "limits": {"state": [[1]], "bound": [0]}}, {"matrix": [[1]]}, "bound"),
    (FED, {"level": 1, "limits": {"state": [], "bound": []}}, {"matrix": [[1]]}, "no limit"),
    (FED, {"level": 1}, {"matrix": [[1]], "feedback": [[0]]}, "feedback"),
    ({**FED, "controller": {**STATIC, "D": []}}, {"level": 1}, {"matrix": [[1]]}, "no control"),
    (FED, {"level": 1, "cost": {"state": [[1]], "control": [[1, 0]]}}, {"matrix": [[1]]}, "numbers"),
    ({**FED, "sample_time": 1}, {"level": 1, "rate": 1}, {"matrix": [[1]]}, "rate of 1")])
def test_malformed_content(system, region, evidence, words):
    with pytest.raises(InputError, match=words):
        made(system, region, evidence)


def test_limits_on_controls_that_the_disturbance_reaches_at_once_are_refused():
    system = {"vertices": [{"A": [[-2]], "B": [[1, 1]]}], "sample_time": 0, "measured": {"C": [[1]], "D": [[1]]},
              "controller": {**STATIC, "D": [["-0.1"]]}}
    region = {"level": 1, "disturbance": 0.5, "limits": {"state": [[0]], "control": [[1]], "bound": [9]}}
    with pytest.raises(InputError, match="reaches directly"):
        made(system, region, {"matrix": [[1]], "decay": 1})
    assert made(system, {key: value for key, value in region.items() if key != "limits"},
                {"matrix": [[1]], "decay": 1}).holds
