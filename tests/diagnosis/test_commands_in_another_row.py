"""A program may log commands before it sends them, or what it sent a row before: classic, and no missing physics."""

from __future__ import annotations

import numpy as np
import pytest

import robthermal as rt

FEW = ["sensor_lag", "input_lag", "input_delay", "hidden_mass", "missing_link", "missing_ambient_link", "heat_source"]
H, N, NOISE = 10.0, 400, 0.05
LOST = ("missing_ambient_link", ("b", "room"))
C, LOSS, PATH, LAG = np.array([120.0, 80.0]), np.array([0.6, 0.4]), 0.8, 30.0  # of both bodies, of the second sensor


def model(*, loss: bool = True) -> rt.System:
    """The machine, or the machine without the loss of body b."""
    links = [{"between": ("a", "room"), "conductance": LOSS[0]}, {"between": ("a", "b"), "conductance": PATH}]
    return rt.System(
        ambients={"room": {"temperature": 295.0}}, lumps={"a": {"capacity": C[0]}, "b": {"capacity": C[1]}},
        links=[*links, {"between": ("b", "room"), "conductance": LOSS[1]}] if loss else links,
        inputs={"qa": {"lump": "a"}, "qb": {"lump": "b"}},
        sensors={"Ta": {"lump": "a", "noise": NOISE}, "Tb": {"lump": "b", "noise": NOISE, "time_constant": LAG}},
        fit={"lumps.a.capacity": {"lower": 50.0, "upper": 300.0}, "lumps.b.capacity": {"lower": 30.0, "upper": 200.0},
             "links.a-room.conductance": {"lower": 0.1, "upper": 2.0}})


def day(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Commands, and readings by Euler steps of half a second."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([0.0, 4.0, 8.0, 12.0], (N // 16 + 1, 2)), 16, axis=0)[:N]
    T, late, read = np.full(2, 295.0), 295.0, []
    for k in range(N):
        read.append((T[0], late))
        for _ in range(20):
            flow = PATH * (T[0] - T[1])
            heat = u[k] - LOSS * (T - 295.0) + np.array([-flow, flow])
            T, late = T + H / 20 * heat / C, late + H / 20 * (T[1] - late) / LAG
    return u, np.array(read) + NOISE * rng.standard_normal((N, 2))


def log(seed: int, rows: int) -> rt.Record:
    """Commands logged so many rows after the one from which they act; negative: before."""
    u, read = day(seed)
    n = N - abs(rows)
    return rt.Record(sample_time=H, inputs=u[max(-rows, 0):][:n], outputs=read[max(rows, 0):][:n],
                     input_names=["qa", "qb"], output_names=["Ta", "Tb"])


@pytest.mark.parametrize("seed", [1, 2])
def test_commands_logged_a_row_late_are_said_and_nothing_is_named(seed: int) -> None:
    """Two hidden masses came nearest, then a log of means."""
    found = rt.diagnose(model(), log(seed, 1), validation=log(seed + 50, 1), effects=FEW)
    assert found.verdict == "unexplained" and "without any effect" in found.means
    assert "a row too late" in found.means and "input_shift = -1" in found.means
    declared = [rt.signals.shift_inputs(log(one, 1), -1) for one in (seed, seed + 50)]
    again = rt.diagnose(model(), declared[0], validation=declared[1], effects=FEW)
    assert again.verdict == "consistent" and again.means == ""


def test_a_loss_that_is_missing_beside_a_row_late_is_listed_with_it() -> None:
    found = rt.diagnose(model(loss=False), log(3, 1), effects=FEW)
    assert found.verdict in ("unexplained", "named_with_remainder")
    assert "input_shift = -1" in found.means
    again = rt.diagnose(model(loss=False), rt.signals.shift_inputs(log(3, 1), -1), effects=FEW)
    assert again.verdict == "named" and [one.key for one in again.effects] == [LOST] and again.means == ""
    assert {one.key for one in found.effects} <= {LOST}


def test_delays_of_all_heaters_by_a_row_may_be_the_log() -> None:
    found = rt.diagnose(model(), log(1, -1), validation=log(51, -1), effects=FEW)
    assert found.verdict == "named" and {one.key for one in found.effects} == {("input_delay", ("qa",)),
                                                                              ("input_delay", ("qb",))}
    (said,) = [one for one in found.caveats if one.startswith("All commands act a row late")]
    assert "input_shift = 1" in said and said in found.outcome.text
    declared = rt.diagnose(model(), rt.signals.shift_inputs(log(1, -1), 1), effects=FEW)
    assert declared.verdict == "consistent"


def test_one_late_heater_of_two_is_no_late_log() -> None:
    late = model().with_parameters({"inputs.qa.drive.delay": H})
    u, _ = day(4)
    run = rt.thermal.simulate(late, rt.Record(sample_time=H, inputs=u, outputs=np.zeros((N, 0)),
                                              input_names=["qa", "qb"], output_names=[]))
    noise = NOISE * np.random.default_rng(5).standard_normal((N, 2))
    found = rt.diagnose(model(), run.with_outputs(run.outputs + noise), effects=FEW)
    assert [one.key for one in found.effects] == [("input_delay", ("qa",))]
    assert found.means == "" and not any("All commands" in one for one in found.caveats)


@pytest.mark.parametrize("seed", [1, 2])
def test_rows_that_are_right_stay_as_they_are(seed: int) -> None:
    found = rt.diagnose(model(), log(seed, 0), effects=FEW)
    assert found.verdict == "consistent" and found.means == ""
