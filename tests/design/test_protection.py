"""Protection: simulated machines, healthy and with faults, and the C source against Python."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import robthermal as rt
from robthermal.design._protection_rules import TRIPS, ProtectionRules

GCC = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
LIMITS = (-0.6, 1.4)
H = 2.0  # s
Scene = tuple[np.ndarray, np.ndarray, np.ndarray]


@pytest.fixture(scope="module")
def law(system: rt.System) -> rt.design.FeedbackLinearization:
    return rt.design.feedback_linearization(system, current_limits=LIMITS)


@pytest.fixture(scope="module")
def guard(law: rt.design.FeedbackLinearization) -> rt.design.Protection:
    return rt.design.protection(law)


def faces(system: rt.System, current: np.ndarray, *, seed: int, plant: rt.System | None = None,
          heat: np.ndarray | None = None) -> Scene:
    """Asked currents and noisy faces of the machine, simulated; `plant` is the machine where it is not the system."""
    true = plant or system
    names = [*true.input_names, *true.module_names, *true.ambient_names]
    columns = {**{name: np.zeros(len(current)) for name in true.input_names},
               **dict(zip(true.module_names, current.T, strict=True)), "room": np.full(len(current), 298.15)}
    if heat is not None:
        columns["fault"] = heat
    drive = rt.Record(sample_time=H, inputs=np.column_stack([columns[name] for name in names]),
                      outputs=np.zeros((len(current), 0)), input_names=names, output_names=[])
    lumps = rt.thermal.trajectory(true, drive).lumps
    noise = 0.05 * np.random.default_rng(seed).standard_normal(lumps.shape)  # five times that of the sensors
    index = {name: k for k, name in enumerate(true.lump_names)}
    hot, cold = ((lumps + noise)[:, [index[getattr(part, side)] for part in system.modules.values()]]
                 for side in ("hot", "cold"))
    return current, hot, cold


def judged(guard: rt.design.Protection, scene: Scene, reference: float = 278.15) -> np.ndarray:
    current, hot, cold = scene
    return guard.trips(current, hot, cold, np.full_like(cold, reference), np.full(len(cold), 298.15), H)


def steps(seed: int, n: int = 900) -> np.ndarray:
    """Currents of both modules within the limits, held for 20 to 200 samples; a third of the time off."""
    rng = np.random.default_rng(seed)
    columns = []
    for _ in range(2):
        levels: list[float] = []
        while len(levels) < n:
            level = 0.0 if rng.random() < 1 / 3 else rng.uniform(*LIMITS)
            levels += [level] * int(rng.integers(20, 200))
        columns.append(levels[:n])
    return np.array(columns).T


@pytest.mark.parametrize("seed", range(8))
def test_a_healthy_machine_never_trips(seed: int, system: rt.System, guard: rt.design.Protection) -> None:
    """30 minutes with a current that steps anywhere within the limits, both signs, with sensor noise."""
    assert set(judged(guard, faces(system, steps(seed), seed=seed)).ravel()) == {""}


def test_a_controlled_machine_never_trips(system: rt.System, law: rt.design.FeedbackLinearization,
                                          guard: rt.design.Protection) -> None:
    pi = rt.design.pid(rt.design.cold_side(law), bandwidth=0.02, sample_time=H)
    targets = np.repeat([[288.15, 288.15], [280.15, 285.15], [303.15, 285.15], [290.15, 290.15]], 150, axis=0)
    loop = rt.design.simulate_loop(system, pi, targets, law=law, duration=600 * H)
    index = {name: k for k, name in enumerate(system.lump_names)}
    hot, cold = (loop.lumps[:, [index[getattr(part, side)] for part in system.modules.values()]] for side in
                 ("hot", "cold"))
    found = guard.trips(loop.current, hot, cold, loop.reference, np.full(len(loop.time), 298.15), H)
    assert set(found.ravel()) == {""} and np.abs(loop.current).max() > 0.5


@pytest.mark.parametrize("size", [0.3, 0.8, 1.4, -0.3, -0.6])
@pytest.mark.parametrize("seed", [1, 2])
def test_swapped_leads_trip_within_the_delay(size: float, seed: int, system: rt.System,
                                             guard: rt.design.Protection) -> None:
    asked = np.full((40, 2), size)
    _, hot, cold = faces(system, asked * [-1.0, 1.0], seed=seed)  # the first module gets the opposite current
    found = judged(guard, (asked, hot, cold))
    first = np.flatnonzero(found[:, 0] == "polarity")[0]
    assert 30.0 <= first * H <= 34.0 and set(found[first:, 0]) == {"polarity"} and set(found[:, 1]) == {""}


def test_a_runaway_trips(system: rt.System, law: rt.design.FeedbackLinearization) -> None:
    """The fan stops: a tenth of the conductance to the room, at the full current."""
    weak = rt.thermal.System(**{**dict(system), "links": [
        link.model_copy(update={"conductance": 0.1 * link.conductance}) if "room" in link.between else link
        for link in system.links]})
    scene = faces(system, np.full((900, 2), 1.4), seed=1, plant=weak)
    hot_limit = rt.design.protection(law, hottest=500.0)
    found = judged(hot_limit, scene, reference=263.15)
    assert "runaway" in found and set(found.ravel()) <= {"", "runaway"}
    first = np.flatnonzero(found[:, 0] == "runaway")[0]
    assert scene[2][first, 0] > scene[2][:first, 0].min() + 2.0, "the cold face had been colder at the same current"
    assert "runaway" not in judged(hot_limit, faces(system, np.full((900, 2), 1.4), seed=1), reference=263.15)
    assert "hot" in judged(rt.design.protection(law, hottest=320.0), scene)


@pytest.mark.parametrize(("lump", "watts"), [("x11", 3.0), ("x9", 10.0)])
def test_a_heater_that_stays_on_trips(lump: str, watts: float, system: rt.System, guard: rt.design.Protection) -> None:
    text = rt.thermal.format_system(system) + f'[inputs.fault]\nlump = "{lump}"\n'
    plant, current = rt.thermal.parse_system(text), np.zeros((600, 2))
    current[:100] = 0.8
    heat = np.where(np.arange(600) >= 300, watts, 0.0)
    found = judged(guard, faces(system, current, seed=3, plant=plant, heat=heat))
    first = np.flatnonzero((found == "stuck").any(axis=1))[0]
    assert 300 < first < 400 and set(found[:first].ravel()) == {""}


def test_readings_that_are_none_trip_and_stay(guard: rt.design.Protection) -> None:
    hot, cold = np.full((6, 2), 300.0), np.full((6, 2), 296.0)
    hot[2, 0], cold[3, 1] = np.nan, 150.0  # broken; a wire off
    found = judged(guard, (np.zeros((6, 2)), hot, cold))
    assert found.T.tolist() == [["", "", *["reading"] * 4], ["", "", "", *["reading"] * 3]]


@pytest.mark.parametrize(("bad", "words"), [
    ({"hottest": 200.0, "coldest": 300.0}, "coldest below hottest"), ({"rise": 0.0}, "rise"),
    ({"delay": -1.0}, "delay"), ({"hottest": float("nan")}, "hottest")])
def test_what_makes_no_rules_is_refused(bad: dict[str, float], words: str,
                                        law: rt.design.FeedbackLinearization) -> None:
    with pytest.raises(rt.InputError, match=words):
        rt.design.protection(law, **bad)


def test_a_law_without_limits_and_wrong_shapes_are_refused(system: rt.System, guard: rt.design.Protection) -> None:
    free = rt.System(**{**dict(system), "modules": {name: part.model_copy(update={"current_limits": None})
                                                    for name, part in system.modules.items()}})
    with pytest.raises(rt.InputError, match="upper current limit"):
        rt.design.protection(rt.design.feedback_linearization(free))
    with pytest.raises(rt.InputError, match="arrays of shape"):
        guard.trips(np.zeros((3, 2)), np.zeros((3, 2)), np.zeros((3, 1)), np.zeros((3, 2)), np.zeros(3), 1.0)
    with pytest.raises(rt.InputError, match="sample_time"):
        guard.trips(*4 * [np.zeros((3, 2))], np.zeros(3), 0.0)


def test_numbers_stand_in_the_json_file(guard: rt.design.Protection, tmp_path: Path) -> None:
    guard.export(tmp_path / "guard.json")
    data = json.loads((tmp_path / "guard.json").read_text(encoding="utf-8"))
    rows = [dict(row) for row in data["modules"]]
    assert [row.pop("name") for row in rows] == ["m1", "m2"]
    assert tuple(ProtectionRules(**row) for row in rows) == guard.rules


@pytest.mark.skipif(GCC is None, reason="no C compiler on this machine")
def test_the_c_source_is_the_same_rules(guard: rt.design.Protection, tmp_path: Path) -> None:
    source = tmp_path / "guard.c"
    guard.export(source, "guard")
    flags = ["-std=c99", "-O2", "-Wall", "-Wextra", "-pedantic", "-Werror", "-ffp-contract=off", "-DPROTECTION_TEST"]
    subprocess.run([str(GCC), *flags, str(source), "-o", str(tmp_path / "guard"), "-lm"], check=True)
    run = subprocess.run([str(tmp_path / "guard")], capture_output=True, text=True, check=False)
    assert (run.stdout.strip(), run.returncode) == ("0", 0)
    text = source.read_text(encoding="utf-8")
    table = text[text.index("guard_test["):]
    rows = [row.split(", ") for row in re.findall(r"^    \{(.*)\},?$", table[:table.index("\n};")], re.MULTILINE)]
    trips = {int(float.fromhex(cell)) for row in rows for cell in row[-2:]}
    assert trips == set(range(len(TRIPS))), "the vector shows every reason to trip"
    wrong = text.replace("w->sign * (across - w->across) < -p->change", "w->sign * (across - w->across) > p->change")
    assert wrong != text
    source.write_text(wrong, encoding="utf-8")
    subprocess.run([str(GCC), *flags, str(source), "-o", str(tmp_path / "wrong"), "-lm"], check=True)
    assert subprocess.run([str(tmp_path / "wrong")], capture_output=True, check=False).returncode == 1
