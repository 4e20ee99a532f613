"""Modules seen from the other side: the same heats, and the feedback law made for the hot faces."""

from __future__ import annotations

import numpy as np
import pytest

import robthermal as rt
from robthermal.errors import InputError

SYSTEM = rt.systems.two_module()


def test_every_heat_is_the_same_with_the_current_reversed() -> None:
    modules = {name: m.model_copy(update={"thomson": 2e-4, "joule_split": 0.1, "current_limits": (-1.0, 3.0)})
               for name, m in SYSTEM.modules.items()}
    system = SYSTEM.model_copy(update={"modules": modules})
    other = rt.thermal.exchange_faces(system, "m2")
    rng = np.random.default_rng(0)
    x = rng.uniform(270.0, 350.0, (50, 18))
    u = np.column_stack([rng.uniform(-3, 3, (50, 2)), rng.uniform(285, 300, 50)])
    here, there = rt.thermal.Equations(system), rt.thermal.Equations(other)
    np.testing.assert_allclose(there.heat(x, u * [1, -1, 1]), here.heat(x, u), rtol=1e-12, atol=1e-10)
    assert np.abs(there.heat(x, u) - here.heat(x, u)).max() > 10.0  # the sign does count
    assert other.modules["m2"].current_limits == (-3.0, 1.0) and other.modules["m1"] == system.modules["m1"]
    assert rt.thermal.exchange_faces(rt.thermal.exchange_faces(system)) == system


def test_the_law_of_the_exchanged_machine_gives_the_hot_side_its_heat() -> None:
    law = rt.design.feedback_linearization(rt.thermal.exchange_faces(SYSTEM))
    m = SYSTEM.modules["m1"]
    hot, cold = 321.0, 288.0
    S, R, K = (p.value + p.slope * ((hot + cold) / 2 - m.reference_temperature)
               for p in (m.seebeck, m.resistance, m.conductance))
    v = np.linspace(-5.0, 25.0, 13)
    at = {"x9": hot, "x10": hot, "x11": cold, "x12": cold}
    current = -law.current(np.column_stack([v, v]), at)[:, 0]  # positive from cold to hot, as in the thesis
    np.testing.assert_allclose(S * hot * current + 0.5 * R * current**2 + K * (cold - hot), v, rtol=1e-11, atol=1e-11)
    assert (np.diff(current) > 0).all()


def test_a_loop_holds_hot_faces_of_the_machine_itself() -> None:
    other = rt.thermal.exchange_faces(SYSTEM)
    law = rt.design.feedback_linearization(other)
    pi = rt.design.pid(rt.design.cold_side(law), bandwidth=0.02, sample_time=2.0)
    loop = rt.design.simulate_loop(other, pi, 308.15, law=law, duration=900.0)
    assert loop.outcome.code == "settled"
    names = SYSTEM.lump_names
    assert np.abs(loop.lumps[-1, [names.index("x9"), names.index("x10")]] - 308.15).max() < 0.05
    plant = rt.thermal.Stepper(SYSTEM, 2.0)
    for row in loop.current[:40]:  # the original machine under the same currents, counted its way
        plant.step({"m1": -row[0], "m2": -row[1]})
    np.testing.assert_allclose(plant.lumps, loop.lumps[40], atol=1e-6)


@pytest.mark.parametrize(("change", "words"), [
    ({"drive": rt.thermal.Drive(gain=0.9)}, "a drive of its own"),
    ({"hysteresis": rt.thermal.Hysteresis(heat=0.1, time_constant=5.0)}, "a hysteresis"),
])
def test_what_knows_the_sign_is_refused(change: dict[str, object], words: str) -> None:
    module = SYSTEM.modules["m1"].model_copy(update=change)
    system = SYSTEM.model_copy(update={"modules": {**SYSTEM.modules, "m1": module}})
    with pytest.raises(InputError, match=words):
        rt.thermal.exchange_faces(system)
    assert rt.thermal.exchange_faces(system, ["m2"]).modules["m1"] == module


def test_voltmeters_and_unknown_modules_are_refused() -> None:
    sensors = {**SYSTEM.sensors, "V1": rt.thermal.Sensor(module="m1", quantity="voltage")}
    with pytest.raises(InputError, match="voltmeter 'V1'"):
        rt.thermal.exchange_faces(SYSTEM.model_copy(update={"sensors": sensors}))
    with pytest.raises(InputError, match="no module 'm9'"):
        rt.thermal.exchange_faces(SYSTEM, "m9")
