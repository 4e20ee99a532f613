"""Bad input is refused with one clear message."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import robthermal as rt


def test_validation_on_training_data_is_refused(plant: rt.System, hide: Callable) -> None:
    train, _ = hide(n=100)
    with pytest.raises(rt.InputError, match="validation record .* is the training record"):
        rt.diagnose(plant, train, validation=train)


def test_short_record_is_refused(plant: rt.System, hide: Callable) -> None:
    train, _ = hide(n=100)
    with pytest.raises(rt.InputError, match="has 30 samples"):
        rt.diagnose(plant, train[:30])


def test_no_noise_is_refused(plant: rt.System, hide: Callable) -> None:
    train, _ = hide(n=100)
    silent = plant.with_parameters({"sensors.Tp.noise": 0.0, "sensors.Tb.noise": 0.0})
    flat = train.with_outputs(np.full_like(train.outputs, 298.15))
    with pytest.raises(rt.InputError, match="not declared, and none is visible"):
        rt.diagnose(silent, flat)


def test_unknown_effect_is_refused(plant: rt.System, hide: Callable) -> None:
    train, _ = hide(n=100)
    with pytest.raises(rt.InputError, match="there is no effect 'gremlins'"):
        rt.diagnose(plant, train, effects=["gremlins"])


def test_prior_outside_its_bounds_is_refused(plant: rt.System, hide: Callable) -> None:
    train, _ = hide(n=100)
    with pytest.raises(rt.InputError, match="outside its bounds"):
        rt.diagnose(plant, train, parameters={"lumps.plate.capacity": (200.0, 300.0)})


def test_runaway_is_refused() -> None:
    system = rt.System(
        ambients={"room": {"temperature": 298.15}}, lumps={"cold": {"capacity": 5.0}, "hot": {"capacity": 5.0}},
        links=[{"between": ("hot", "room"), "conductance": 0.01}, {"between": ("cold", "room"), "conductance": 0.1}],
        modules={"m1": {"hot": "hot", "cold": "cold", "seebeck": 0.05, "resistance": 2.0, "conductance": 0.1}},
        sensors={"T": {"lump": "cold", "noise": 0.01}})
    record = rt.Record(sample_time=10.0, inputs=np.full((200, 1), 8.0), outputs=np.full((200, 1), 298.15),
                       input_names=["m1"], output_names=["T"])
    with pytest.raises(rt.InputError, match="nominal model runs away"):
        rt.diagnose(system, record)


def test_built_in_name_and_missing_grid_are_refused() -> None:
    def add(system: rt.System, where: tuple[str, ...], q: dict[str, float]) -> rt.System:
        return system

    size, shape = rt.diagnosis.Quantity("heat", "W", 0.0, 1.0), rt.diagnosis.Quantity("period", "s", 1.0, 9.0)
    taken = rt.diagnosis.Effect(name="thomson", places=lambda system: [], quantities=(size,), add=add)
    with pytest.raises(rt.InputError, match="built in"):
        rt.diagnosis.register_effect(taken)
    shapeless = rt.diagnosis.Effect(name="mine", places=lambda system: [], quantities=(size, shape), add=add)
    with pytest.raises(rt.InputError, match="has no grid"):
        rt.diagnosis.register_effect(shapeless)


def test_declared_noise_far_from_the_record_is_said(plant: rt.System, hide: Callable) -> None:
    floor = rt.diagnosis.noise_floor(plant, hide(n=100)[0], noise=0.5)
    assert floor.outcome.code == "doubtful" and "declared 0.5 K" in floor.outcome.text


def test_quiet_record_says_what_it_could_not_show(plant: rt.System) -> None:
    rng = np.random.default_rng(4)
    y = 298.15 + 0.01 * rng.standard_normal((200, 2))
    record = rt.Record(sample_time=5.0, inputs=np.column_stack([np.zeros(200), np.full(200, 298.15)]), outputs=y,
                       input_names=["heater", "room"], output_names=["Tp", "Tb"])
    found = rt.diagnose(plant, record)
    assert found.verdict == "consistent"
    assert found.not_testable["input_gain", ("heater",)] == "no effect on any reading of these records"
    assert found.not_testable["input_delay", ("heater",)] == "no effect on any reading of these records"
    assert ("heat_source", ("plate",)) not in found.not_testable  # that would have been seen


def test_bounds_of_initial_temperatures_are_accepted_by_the_system():
    """Sensors 60 K apart: 20 standard deviations of the start reached below 150 K, and a refit ended as bad input."""
    system = rt.System(
        ambients={"room": {"temperature": 298.15}}, lumps={"plate": {"capacity": 100.0}, "lamp": {"capacity": 20.0}},
        links=[{"between": ("plate", "room"), "conductance": 0.5}, {"between": ("plate", "lamp"), "conductance": 0.5}],
        sensors={"Tp": {"lump": "plate", "noise": 0.1}, "Tl": {"lump": "lamp", "noise": 0.1}})
    rng = np.random.default_rng(0)
    record = rt.Record(sample_time=5.0, inputs=np.full(80, 298.15), input_names=["room"], output_names=["Tp", "Tl"],
                       outputs=np.array([360.0, 420.0]) + 0.1 * rng.standard_normal((80, 2)))
    structure = rt.diagnosis.refit(system, record).structure
    low, high = structure.bounds
    assert (low < 0).all() and (high > 0).all()
    for bound in (low, high):
        T = structure.temperatures(bound)[0]
        assert [lump.initial for lump in structure.systems(bound)[0].lumps.values()] == pytest.approx(list(T))
        assert T.min() > 150.0 and T.max() <= 1500.0
