"""Numbers of named effects have a range in the fit table of the augmented system, where the nominal one has a table."""

from __future__ import annotations

import pytest

import robthermal as rt
from robthermal.diagnosis._with_names import ranged

BAR = {"ambients": {"room": {"temperature": 295.0}}, "lumps": {"bar": {"capacity": 100.0}},
       "links": [{"between": ("bar", "room"), "conductance": 0.5}], "sensors": {"T": {"lump": "bar"}},
       "inputs": {"q": {"lump": "bar"}}}
FIT = {"lumps.bar.capacity": {"lower": 10.0, "upper": 500.0}}
LATE = rt.diagnosis.Found("sensor_lag", ("T",), {"time_constant": (30.0, 1.0, "s")}, 1e-9, 400.0)


def with_lag(seconds: float, **more: object) -> rt.System:
    return rt.System(**{**BAR, "sensors": {"T": {"lump": "bar", "time_constant": seconds}}, **more})


@pytest.mark.parametrize("seconds", [30.0, 45.0, 900.0])
def test_the_range_holds_the_number_of_the_system(seconds: float) -> None:
    """The size beside a finer network and that of the network as it is may differ."""
    more = ranged(with_lag(seconds, fit=FIT), rt.System(**BAR, fit=FIT), [LATE])
    assert set(more.fit) == {"lumps.bar.capacity", "sensors.T.time_constant"}
    limits = more.fit["sensors.T.time_constant"]
    assert limits.lower == pytest.approx(3.0) and limits.upper == pytest.approx(max(330.0, seconds))
    assert more.parameter("sensors.T.time_constant") == seconds


def test_without_a_fit_table_all_numbers_are_right_and_nothing_is_added() -> None:
    system = with_lag(30.0)
    assert ranged(system, rt.System(**BAR), [LATE]) is system


def test_what_is_no_effect_of_the_catalog_and_what_the_system_had_before_add_nothing() -> None:
    drift = rt.diagnosis.Found("ambient_drift", ("room",), {"rate": (1e-3, 1e-4, "K/s")}, 1e-9, 400.0)
    system = with_lag(30.0, fit=FIT)
    assert set(ranged(system, rt.System(**BAR, fit=FIT), [drift]).fit) == set(FIT)
    assert ranged(system, system, [LATE]) is system
