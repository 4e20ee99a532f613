"""Validation where the start of a body without a thermometer shows late: cold finger on a module, heat sink unseen."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import robthermal as rt
from robthermal.fitting import NONE, Problem, as_data, free_run, initial_of

N, H, NOISE = 150, 2.0, 0.03
S, R, K = 0.04, 1.6, 0.3  # V/K, Ω, W/K
C_FINGER, C_SINK, G, ROOM = 45.0, 500.0, 4.0, 298.15


def _current(k: NDArray[np.float64] | float) -> NDArray[np.float64]:
    """Full current, then less and less, as a controller does that has reached its set-point [A]."""
    return np.asarray(np.where(np.asarray(k) < 70, 4.5, 2.0 + 2.5 * np.exp(-(np.asarray(k) - 70.0) / 20.0)))


def _measured(sink_warmer: float, both: bool) -> rt.Record:
    """Integrated by scipy, every sample by itself: the current is held."""
    T, readings = np.array([302.0, 302.0 + sink_warmer]), []
    for k in range(N):
        readings.append(T)
        current = float(_current(k))

        def heats(t: float, T: NDArray[np.float64], current: float = current) -> list[float]:
            heating, through = 0.5 * R * current**2, K * (T[1] - T[0])
            return [(heating + through - S * current * T[0]) / C_FINGER,
                    (S * current * T[1] + heating - through - G * (T[1] - ROOM)) / C_SINK]

        T = solve_ivp(heats, (0.0, H), T, rtol=1e-8, atol=1e-8).y[:, -1]
    y = np.array(readings) + NOISE * np.random.default_rng(3).standard_normal((N, 2))
    names = ["Tf", "Ts"] if both else ["Tf"]
    return rt.Record(sample_time=H, inputs=np.column_stack([_current(np.arange(N)), np.full(N, ROOM)]),
                     outputs=y[:, :len(names)], input_names=["tec", "room"], output_names=names)


def _system(both: bool) -> rt.System:
    sensors = {"Tf": {"lump": "finger", "noise": NOISE}}
    return rt.System(ambients={"room": {"temperature": ROOM}},
                     lumps={"finger": {"capacity": C_FINGER}, "sink": {"capacity": C_SINK}},
                     links=[{"between": ("sink", "room"), "conductance": G}],
                     modules={"tec": {"hot": "sink", "cold": "finger", "seebeck": {"value": S},
                                      "resistance": {"value": R}, "conductance": {"value": K}}},
                     sensors=sensors | ({"Ts": {"lump": "sink", "noise": NOISE}} if both else {}))


@pytest.mark.parametrize("sink_warmer", [-10.0, 0.0, 12.0])
def test_a_right_model_predicts_a_record_that_begins_with_an_unseen_body_elsewhere(sink_warmer: float) -> None:
    one = as_data(_system(False), _measured(sink_warmer, False), "record")[0]
    run = free_run(_system(False), one, "free", {"Tf": NOISE})
    assert np.sqrt(np.mean(run.residual**2)) < 1.15 * NOISE
    assert run.initial_temperatures[1] == pytest.approx(302.0 + sink_warmer, abs=1.0)


def test_where_a_tenth_determines_the_start_the_rest_is_not_looked_at() -> None:
    system, record = _system(True), _measured(12.0, True)
    later = record.outputs + np.where(np.arange(N) < N // 10, 0.0, 3.0)[:, None]
    starts = [free_run(system, as_data(system, one, "record")[0], "free", {"Tf": NOISE, "Ts": NOISE}
                       ).initial_temperatures for one in (record, record.with_outputs(later))]
    np.testing.assert_array_equal(starts[0], starts[1])
    assert starts[0][1] == pytest.approx(314.0, abs=0.1)


def test_a_start_stays_where_a_network_means_anything() -> None:
    """First readings that are far apart make a wide prior; its end was a temperature that a system refuses."""
    record = rt.Record(sample_time=1.0, inputs=np.zeros((20, 1)), input_names=["q"], output_names=["Ta", "Tb"],
                       outputs=np.column_stack([np.full(20, 300.0), np.full(20, 380.0)]))
    system = rt.System(ambients={"room": {"temperature": 295.0}}, inputs={"q": {"lump": "a"}},
                       lumps={name: {"capacity": 10.0} for name in "abc"},
                       links=[{"between": (name, "room"), "conductance": 1.0} for name in "abc"],
                       sensors={"Ta": {"lump": "a", "noise": 0.1}, "Tb": {"lump": "b", "noise": 0.1}})
    one = as_data(system, record, "record")[0]
    problem = Problem(system, [one], NONE, [initial_of(system, one, "free")])
    coldest, hottest = (problem.temperatures(v)[0] for v in problem.bounds)
    assert coldest.min() == pytest.approx(151.0) and 380.0 < hottest.max() <= 1500.0
