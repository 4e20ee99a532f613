"""Effects hidden in data of an independent integrator: named, ambiguous, or honestly not named."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import robthermal as rt

Hide = Callable[..., tuple[rt.Record, rt.Record]]


def names(found: rt.diagnosis.Diagnosis) -> set[str]:
    """Everything the diagnosis would allow, as labels."""
    alternatives = {f"{effect}({', '.join(where)})" for others in found.alternatives for effect, where in others}
    return {effect.label for effect in found.effects} | alternatives


def test_nothing_hidden_is_consistent(plant: rt.System, hide: Hide) -> None:
    train, validation = hide()
    found = rt.diagnose(plant, train, validation=validation)
    assert found.verdict == "consistent" and not found.effects
    assert found.gap["train"].before == pytest.approx(0.01, rel=0.05)
    assert found.system.parameter("lumps.plate.capacity") == pytest.approx(123.0, rel=0.01)


def test_natural_convection_is_named_and_its_gain_is_right(plant: rt.System, hide: Hide, rate: Callable) -> None:
    def hidden(t: float, T: np.ndarray, u: np.ndarray) -> np.ndarray:
        dT = u[1] - T[0]
        return rate(T, u, np.array([0.08 * abs(dT) ** 0.25 * dT, 0.0]))

    train, validation = hide(hidden)
    found = rt.diagnose(plant, train, validation=validation)
    assert found.verdict == "named"
    assert [effect.label for effect in found.effects] == ["natural_convection(plate, room)"]
    gain, std, _ = found.effects[0].values["gain"]
    assert abs(gain - 0.08) < 4 * std and std < 0.02
    assert found.hold_out is not None and found.hold_out.variance_after == pytest.approx(1.0, abs=0.15)
    assert found.gap["validation"].after < found.gap["validation"].before


def test_hidden_mass_is_named_saved_and_its_system_loads(plant: rt.System, hide: Hide, rate: Callable,
                                                         tmp_path: Path) -> None:
    C, tau = 12.0, 90.0

    def hidden(t: float, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        flow = C / tau * (x[2] - x[0])
        return np.append(rate(x[:2], u, np.array([flow, 0.0])), -flow / C)

    train, validation = hide(hidden, extra_states=1)
    found = rt.diagnose(plant, train, validation=validation)
    assert found.verdict == "named"
    assert [effect.label for effect in found.effects] == ["hidden_mass(plate)"]
    values = found.effects[0].values
    assert values["capacity"][0] == pytest.approx(C, rel=0.1)
    assert values["time_constant"][0] == pytest.approx(tau, rel=0.1)
    found.save(tmp_path / "diagnosis.json")
    saved = json.loads((tmp_path / "diagnosis.json").read_text(encoding="utf-8"))
    assert saved["format"] == "robthermal-diagnosis/2" and saved["verdict"] == "named"
    assert saved["effects"][0]["parameters"]["capacity"]["unit"] == "J/K"
    assert set(saved["gap"]) == {"train", "validation"}
    rt.thermal.write_system(found.system, tmp_path / "augmented.toml")
    again = rt.read_system(tmp_path / "augmented.toml")
    assert again.parameter("lumps.plate_hidden.capacity") == pytest.approx(values["capacity"][0])


def test_late_heater_is_a_set_where_lag_and_delay_look_alike(plant: rt.System, hide: Hide) -> None:
    def late(u: np.ndarray) -> np.ndarray:
        out = u.copy()
        out[1:, 0] = 0.8 * u[1:, 0] + 0.2 * u[:-1, 0]  # late by a second on average, and neither a delay nor a lag
        return out

    train, _ = hide(drive=late)
    found = rt.diagnose(plant, train)
    assert found.verdict == "ambiguous"
    assert {"input_lag(heater)", "input_delay(heater)"} <= names(found)
    assert found.next_experiment is not None
    assert found.next_experiment.record.input_names == ("heater", "room")
    assert not found.outcome.ok


def test_constant_source_is_a_declared_alias(plant: rt.System, hide: Hide, rate: Callable) -> None:
    train, validation = hide(lambda t, T, u: rate(T, u, np.array([0.3, 0.0])))
    found = rt.diagnose(plant, train, validation=validation)
    assert found.verdict == "ambiguous"
    assert {"heat_source(plate)", "ambient_gradient(plate)", "sensor_self_heating(Tp)"} <= names(found)


@pytest.mark.exhaustive
def test_physics_outside_the_catalog_is_not_named(plant: rt.System, hide: Hide, rate: Callable) -> None:
    def melting(t: float, T: np.ndarray, u: np.ndarray) -> np.ndarray:
        slow = 1.0 + 4.0 * np.exp(-(((T[0] - 303.0) / 1.0) ** 2))  # heat of fusion about 303 K
        return rate(T, u) / np.array([slow, 1.0])

    train, validation = hide(melting)
    found = rt.diagnose(plant, train, validation=validation)
    assert found.verdict == "unexplained" and not found.effects
    assert found.located.strength["plate"] > 10.0
    assert min(found.located.lumps.values()) < 1e-6


def test_own_effect_joins_the_catalog(plant: rt.System, hide: Hide) -> None:
    # A reading in the wrong place between the lumps: T = (1 - s) T_block + s T_plate, known to nobody but the user.
    def placed(system: rt.System, where: tuple[str, ...], q: dict[str, float]) -> rt.System:
        return system.with_parameters({f"sensors.{where[0]}.delay": q["delay"]})

    late = rt.diagnosis.Effect(
        name="sensor_delay", places=lambda system: [(name,) for name in system.sensors],
        quantities=(rt.diagnosis.Quantity("delay", "s", 0.0, 60.0, typical=0.5),), add=placed)
    rt.diagnosis.register_effect(late)
    try:
        train, validation = hide(
            read=lambda T: np.column_stack([T[:, 0], np.concatenate([T[:1, 1]] * 3 + [T[:-3, 1]])]))
        found = rt.diagnose(plant, train, validation=validation)
    finally:
        rt.diagnosis.forget_effect("sensor_delay")
    assert "sensor_delay(Tb)" in names(found)
    assert found.effects[0].label == "sensor_delay(Tb)"
    assert found.effects[0].values["delay"][0] == pytest.approx(15.0, abs=0.5)


def test_seebeck_slope_is_named_through_unmeasured_faces() -> None:
    capacity = np.array([30.0, 60.0, 5.0, 8.0, 250.0])  # sample, plate, cold face, hot face, sink
    system = rt.System(
        ambients={"room": {"temperature": 298.15}},
        lumps=dict(zip(("sample", "plate", "cold", "hot", "sink"), ({"capacity": c} for c in capacity), strict=True)),
        links=[{"between": ("sample", "plate"), "conductance": 1.2}, {"between": ("plate", "cold"), "conductance": 4.0},
               {"between": ("hot", "sink"), "conductance": 5.0}, {"between": ("sink", "room"), "conductance": 2.5},
               {"between": ("sample", "room"), "conductance": 0.05}],
        inputs={"heater": {"lump": "sample"}},
        modules={"m1": {"hot": "hot", "cold": "cold", "seebeck": 0.05, "resistance": 2.0, "conductance": 0.5}},
        sensors={"Ts": {"lump": "sample", "noise": 0.01}, "Tp": {"lump": "plate", "noise": 0.01},
                 "Th": {"lump": "sink", "noise": 0.01}},
        fit={"links.plate-cold.conductance": {"lower": 1.0, "upper": 16.0, "sigma": 0.4},
             "links.hot-sink.conductance": {"lower": 1.0, "upper": 20.0, "sigma": 0.5},
             "links.sink-room.conductance": {"lower": 0.5, "upper": 10.0, "sigma": 0.3},
             "modules.m1.seebeck.value": {"lower": 0.02, "upper": 0.1, "sigma": 0.002},
             "modules.m1.resistance.value": {"lower": 0.5, "upper": 8.0, "sigma": 0.1},
             "modules.m1.conductance.value": {"lower": 0.1, "upper": 2.0, "sigma": 0.05}})

    def rate(t: float, T: np.ndarray, u: np.ndarray) -> np.ndarray:
        q, current, room = u
        S = 0.049 + 1.5e-4 * (0.5 * (T[2] + T[3]) - 298.15)
        joule, leak = 0.5 * 2.05 * current**2, 0.49 * (T[3] - T[2])
        heat = np.array([q - 1.2 * (T[0] - T[1]) - 0.05 * (T[0] - room), 1.2 * (T[0] - T[1]) - 3.9 * (T[1] - T[2]),
                         3.9 * (T[1] - T[2]) - S * T[2] * current + joule + leak,
                         S * T[3] * current + joule - leak - 5.1 * (T[3] - T[4]),
                         5.1 * (T[3] - T[4]) - 2.45 * (T[4] - room)])
        return heat / capacity

    rng = np.random.default_rng(7)
    u = np.repeat(np.column_stack([rng.choice([0.0, 2.0, 5.0], 25), rng.uniform(-1.0, 2.5, 25),
                                   298.15 + rng.normal(0.0, 1.5, 25)]), 20, axis=0)
    out, x = [], np.full(5, 298.15)
    for start in range(0, len(u), 20):
        t = 3.0 * np.arange(start, start + 21)
        run = solve_ivp(rate, (t[0], t[-1]), x, method="LSODA", t_eval=t, args=(u[start],), rtol=1e-8, atol=1e-8)
        out.append(run.y.T[:-1])
        x = run.y[:, -1]
    y = np.concatenate(out)[:, [0, 1, 4]]
    record = rt.Record(sample_time=3.0, inputs=u, outputs=y + 0.01 * rng.standard_normal(y.shape),
                       input_names=["heater", "m1", "room"], output_names=["Ts", "Tp", "Th"])
    found = rt.diagnose(system, record)
    assert found.verdict == "named"
    assert [effect.label for effect in found.effects] == ["seebeck_slope(m1)"]
    assert found.effects[0].values["slope"][0] == pytest.approx(1.5e-4, rel=0.05)
