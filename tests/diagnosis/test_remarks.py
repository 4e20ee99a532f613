"""Records as users have them: stuck, saturated, held, restarted, without the room. Files, and a machine of its own."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import Run
from scipy.linalg import expm

import robthermal as rt

pytestmark = pytest.mark.usefixtures("sketched")
STEP, N, NOISE = 5.0, 300, 0.05
TIME = STEP * np.arange(N)
SYSTEM = """
[system]
name = "oven"
temperature_unit = "degC"
[ambients.room]
temperature = 22.0
[lumps.block]
capacity = 200.0
[lumps.plate]
capacity = 150.0
[[links]]
between = ["block", "plate"]
conductance = 1.5
[[links]]
between = ["plate", "room"]
conductance = 0.8
[inputs.q]
lump = "block"
gain = 0.2
limits = [0.0, 100.0]
[sensors.T_block]
lump = "block"
noise = 0.05
[sensors.T_plate]
lump = "plate"
noise = 0.05
[fit]
"lumps.block.capacity" = { lower = 50.0, upper = 800.0 }
"links.plate-room.conductance" = { lower = 0.1, upper = 5.0 }
"links.block-plate.conductance" = { lower = 0.2, upper = 10.0 }
"""


def stepped(seed: int = 3) -> np.ndarray:
    return np.repeat(np.random.default_rng(seed).choice([0.0, 20.0, 50.0, 100.0], N // 20), 20)


def oven(heater: Any, room: Any = 22.0, seed: int = 1, noise: float = NOISE, path: float = 0.0
         ) -> tuple[np.ndarray, np.ndarray]:
    """Heater column [%] and readings [°C]; `heater` is a column, or a law of the sample and the readings.

    `path` is a conductance from the block to the room that the file does not have [W/K].
    """
    rng, rooms = np.random.default_rng(seed), np.broadcast_to(room, N)
    A = np.array([[-1.4 - path, 1.4], [1.4, -1.4 - 0.85]]) / np.array([200.0, 150.0])[:, None]
    B = np.array([[0.2 / 200.0, path / 200.0], [0.0, 0.85 / 150.0]])
    M = expm(np.block([[A, B], [np.zeros((2, 4))]]) * STEP)[:2]
    T, u, out = np.full(2, rooms[0]), [], []
    for k in range(N):
        out.append(T + noise * rng.standard_normal(2))
        u.append(heater(k, out[-1]) if callable(heater) else heater[k])
        T = M @ np.array([*T, u[-1], rooms[k]])
    return np.array(u), np.array(out)


def stuck() -> tuple[np.ndarray, np.ndarray]:
    u, y = oven(stepped())
    return u, np.column_stack([y[:, 0], np.full(N, 30.0)])


def saturated() -> tuple[np.ndarray, np.ndarray]:
    u, y = oven(stepped())
    return u, np.minimum(y, 28.0)


def held() -> tuple[np.ndarray, np.ndarray]:
    u, y = oven(stepped())
    return u, np.repeat(y[::6], 6, axis=0)


def restarted() -> tuple[np.ndarray, np.ndarray]:
    """The machine cools down overnight after the first half, and the clock does not show it."""
    u, y = oven(stepped())
    again, cold = oven(stepped())
    return np.r_[u[:N // 2], again[:N // 2]], np.r_[y[:N // 2], cold[:N // 2]]


def thermostat(k: int, y: np.ndarray) -> float:
    return 100.0 if y[0] < (30.0 if k // 100 % 2 == 0 else 34.0) else 0.0


def proportional(k: int, y: np.ndarray) -> float:
    return float(np.clip(20.0 * ((28.0, 36.0, 30.0)[k // 100] - y[0]), 0.0, 100.0))


def switched(k: int, y: np.ndarray) -> float:
    """Duty cycle: 15 s on, 35 s off, while it is wanted."""
    return 100.0 if k // 40 % 2 == 0 and k % 10 < 3 else 0.0


def diagnosed(run: Run, folder: Path, u: np.ndarray, y: np.ndarray, time: np.ndarray = TIME) -> tuple[int, Any, str]:
    """Status, diagnosis.json as printed, and what was said."""
    (folder / "oven.toml").write_text(SYSTEM, encoding="utf-8")
    np.savetxt(folder / "log.csv", np.column_stack([time, u, y]), delimiter=",", header="time,q,T_block,T_plate",
               comments="", fmt="%.9g")
    status, text, err = run("diagnose", folder / "oven.toml", folder / "log.csv", "--out", folder / "out", "--json")
    return status, json.loads(text) if status != 2 else {}, " ".join(err.split())


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    tried = partial(rt.diagnose, effects=["heat_source", "sensor_lag", "missing_ambient_link"])
    monkeypatch.setattr("robthermal.jobs.diagnose._diagnose.diagnose", tried)


@pytest.mark.exhaustive
@pytest.mark.usefixtures("few")
@pytest.mark.parametrize(("made", "words"), [
    (stuck, "T_plate in record 'log.csv' reads 30 °C in all 300 samples: stuck"),
    (saturated, "is at its largest reading, 28 °C"), (held, "changes at every 6th sample only"),
    (restarted, "jump at 750 s: a restart?")])
def test_what_is_wrong_with_the_record_is_said(run: Run, tmp_path: Path, made: Any, words: str) -> None:
    status, found, _ = diagnosed(run, tmp_path, *made())
    assert status == 1 and found["verdict"] == "unexplained" and found["effects"] == []
    assert words in found["outcome"]["text"], found["outcome"]["text"]


@pytest.mark.usefixtures("few")
def test_a_machine_that_is_off_shows_nothing_and_the_answer_says_so(run: Run, tmp_path: Path) -> None:
    status, found, _ = diagnosed(run, tmp_path, *oven(np.zeros(N)))
    assert status == 0 and found["verdict"] == "consistent"
    assert "never leave their noise" in found["outcome"]["text"] and "q at 0" in found["outcome"]["text"]
    assert "hold next to nothing" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


@pytest.mark.usefixtures("few")
def test_an_input_at_its_limit_throughout_is_named(run: Run, tmp_path: Path) -> None:
    status, found, _ = diagnosed(run, tmp_path, *oven(np.full(N, 100.0)))
    assert status == 0 and "Never changed: q at 100, its limit" in found["outcome"]["text"]


def test_readings_that_never_change_are_refused(run: Run, tmp_path: Path) -> None:
    status, _, err = diagnosed(run, tmp_path, stepped(), np.full((N, 2), 30.0))
    assert status == 2 and "no reading ever changes: T_block is 30 °C" in err and "connected" in err
    assert not (tmp_path / "out").exists()


@pytest.mark.exhaustive
@pytest.mark.usefixtures("few")
def test_a_room_that_is_not_recorded_may_be_what_nothing_explains(run: Run, tmp_path: Path) -> None:
    _, found, _ = diagnosed(run, tmp_path, *oven(stepped(), room=22.0 + 3.0 * np.sin(TIME / 400.0)))
    assert found["verdict"] == "unexplained"
    assert "room was not recorded: that it swings, drifts or jumps may be part" in found["outcome"]["text"]


@pytest.mark.usefixtures("few")
@pytest.mark.parametrize("heater", [thermostat, proportional, switched])
def test_closed_loops_and_duty_cycles_are_consistent(run: Run, tmp_path: Path, heater: Any) -> None:
    status, found, _ = diagnosed(run, tmp_path, *oven(heater))
    assert (status, found["verdict"]) == (0, "consistent")
    assert not any(word in found["outcome"]["text"] for word in ("stuck", "saturated", "held", "restart"))


@pytest.mark.usefixtures("few")
def test_steps_of_half_a_kelvin_are_neither_stuck_nor_saturated(run: Run, tmp_path: Path) -> None:
    u, y = oven(stepped())
    status, found, _ = diagnosed(run, tmp_path, u, np.round(2.0 * y) / 2.0)
    assert status == 0 and found["verdict"] == "consistent"
    assert not any(word in found["outcome"]["text"] for word in ("stuck", "saturated", "held", "restart"))


def rounded(seed: int, path: float) -> rt.Record:
    """Readings in steps of 0.5 K, without any noise of their own: the error of rounding is the same for minutes."""
    u, y = oven(stepped(seed), noise=0.0, path=path)
    return rt.Record(sample_time=STEP, inputs=u, outputs=np.round(2.0 * y) / 2.0 + 273.15, input_names=["q"],
                     output_names=["T_block", "T_plate"])


@pytest.mark.parametrize("seed", [5, 17])
def test_the_error_of_rounding_gets_no_name(seed: int) -> None:
    """Without the test over blocks and segments both are named `periodic_load(plate)`."""
    found = rt.diagnose(rt.thermal.parse_system(SYSTEM), rounded(seed, 0.0), effects=["periodic_load"])
    assert found.verdict == "unexplained" and found.effects == ()
    assert "error of rounding" in found.outcome.text and "T_block" in found.noise_floor.quantized


def test_a_missing_path_is_found_in_rounded_readings() -> None:
    found = rt.diagnose(rt.thermal.parse_system(SYSTEM), rounded(5, 0.2),
                        effects=["periodic_load", "missing_ambient_link"])
    assert [(one.effect, one.where) for one in found.effects] == [("missing_ambient_link", ("block", "room"))]
    value, std, _ = found.effects[0].values["conductance"]
    assert abs(value - 0.2) < 0.05 and std < 0.05


def test_a_clock_that_begins_again_names_the_remedy(run: Run, tmp_path: Path) -> None:
    u, y = oven(stepped())
    status, _, err = diagnosed(run, tmp_path, u, y, np.r_[TIME[:N // 2], TIME[:N // 2]])
    assert status == 2 and "time runs backward" in err and 'restarts = "split"' in err


@pytest.mark.usefixtures("few")
def test_a_model_that_moves_beside_readings_that_do_not_gets_no_name(run: Run, tmp_path: Path) -> None:
    """The heater's column says 20 W, the heater is off: a mass of 100 kJ/K and 1000 W/K were named."""
    _, y = oven(np.zeros(N))
    status, found, _ = diagnosed(run, tmp_path, stepped(), y)
    assert (status, found["verdict"], found["effects"]) == (1, "unexplained", [])
    said = found["outcome"]["text"]
    assert "The model moves and the readings do not." in said and "never leave their noise" in said
    assert "Refine the network" not in said
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "Something is missing in the model" not in page  # the sentence on top does not say so either


@pytest.mark.usefixtures("few")
def test_single_missing_rows_do_not_cut_a_log_into_parts(run: Run, tmp_path: Path) -> None:
    """Rows 50 and 130, where the heater is steady, are interpolated and said to be; 200 to 202 begin a new part."""
    u, y = oven(stepped())
    kept = np.setdiff1d(np.arange(N), [50, 130, 200, 201, 202])
    status, _, said = diagnosed(run, tmp_path, u[kept], y[kept], TIME[kept])
    assert status == 0 and said.count("1 missing row after") == 2 and said.count("a new part begins") == 1
    status, _, err = run("diagnose", tmp_path / "oven.toml", tmp_path / "log.csv", "--out", tmp_path / "split",
                         "--record", "gaps=split", "--json")
    assert status == 0 and " ".join(err.split()).count("a new part begins") == 3


@pytest.mark.usefixtures("few")
def test_one_column_twice_and_counts_are_said(run: Run, tmp_path: Path) -> None:
    u, y = oven(stepped())
    status, found, _ = diagnosed(run, tmp_path, 2.55 * u, y[:, [0, 0]])
    said = found["outcome"]["text"]
    assert (status, found["verdict"]) == (1, "unexplained")
    assert "T_plate and T_block read the same in every sample of record 'log.csv': one column twice?" in said
    assert "q is between 0 and 255 in the records; the system's limits are 0 and 100: percent or counts?" in said
    assert "Refine the network" not in said  # a finer network leaves most of it
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "K. q is between 0 and 255" in page.replace("\xa0", " ")  # on top


def test_constant_readings_are_refused_beside_healthy_days() -> None:
    u, y = oven(stepped())
    day = partial(rt.Record, sample_time=STEP, inputs=u, input_names=["q"], output_names=["T_block", "T_plate"])
    with pytest.raises(rt.InputError, match="no reading ever changes"):
        rt.diagnose(rt.thermal.parse_system(SYSTEM), day(outputs=np.full((N, 2), 303.15)), reference=day(
            outputs=y + 273.15))


def test_a_sensor_that_is_stuck_is_no_slow_sensor() -> None:
    """Without the rule: sensor_lag(T_plate) of 1e5 s."""
    u, y = stuck()
    stuck_day = rt.Record(sample_time=STEP, inputs=u, outputs=y + 273.15, input_names=["q"],
                          output_names=["T_block", "T_plate"])
    found = rt.diagnose(rt.thermal.parse_system(SYSTEM), stuck_day, effects=["sensor_lag"])
    assert (found.verdict, found.effects) == ("unexplained", ())
    assert "stuck, saturated" in found.outcome.text
