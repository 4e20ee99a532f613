"""Modelica text: balanced, and its own simulation equal to that of the package, effect by effect."""

from __future__ import annotations

import numpy as np
import pytest

import robthermal as rt

from .modelica_reader import Model

EFFECTS = {
    "thomson": (["tem"], {"coefficient": 2e-3}), "joule_split": (["tem"], {"split": 0.2}),
    "hysteresis": (["tem"], {"heat": 0.5, "time_constant": 20.0}), "lead_heating": (["sample", "tem"],
                                                                                  {"resistance": 0.1}),
    "natural_convection": (["plate", "room"], {"gain": 0.1, "exponent": 0.25}), "heat_source": (["hot"], {"heat": 0.7}),
    "radiation": (["plate", "room"], {"coefficient": 5e-10}), "hidden_mass": (["sample"], {"capacity": 3.0}),
    "missing_link": (["hot", "sample"], {"conductance": 0.1}), "sensor_self_heating": (["T_plate"], {"heat": 0.2}),
    "input_gain": (["tem"], {"gain": 0.1}), "input_offset": (["heater"], {"offset": -0.5}),
    "input_saturation": (["heater"], {"cubic": 0.005, "clip": 2.0}), "input_delay": (["tem"], {"delay": 2.5}),
    "input_lag": (["heater"], {"time_constant": 3.0}), "heater_power_slope": (["heater"], {"slope": 0.02}),
    "input_feedthrough": (["heater", "plate"], {"share": 0.3}), "ambient_gradient": (["sample"], {"difference": 4.0}),
    "periodic_load": (["sample"], {"heat": 1.0, "period": 9.0, "phase": 0.4}),
    "conductance_step": (["plate-hot"], {"relative": -0.6, "time": 5.0}),
    "driven_conductance": (["plate-hot", "tem"], {"relative": 0.4}),
    "conductance_exponent": (["plate-hot"], {"exponent": -1.5}), "input_gain_slope": (["heater"], {"slope": 0.05}),
    "condensation": (["cold"], {"conductance": 0.5, "dew_point": 296.0}), "sensor_lag": (["T_plate"],
                                                                                       {"time_constant": 2.0}),
    "sensor_offset": (["T_plate"], {"offset": 0.5}), "sensor_gain": (["T_plate"], {"gain": 1.1}),
    "conductance_slope": (["tem"], {"slope": 3e-3}), "seebeck_slope": (["tem"], {"slope": 1e-4}),
    "resistance_slope": (["tem"], {"slope": 0.02})}


def inputs_of(record):
    """The record's inputs as a function of time, held over the samples."""
    def at(t):
        k = min(int(np.floor((t - record.time[0]) / record.sample_time + 1e-9)), record.n_samples - 1)
        return {name: float(record[name][k]) for name in record.input_names}
    return at


def compare(system, record, tolerance):
    """Lumps and sensors of the Modelica text against the package."""
    model = Model(rt.thermal.format_modelica(system, "full"))
    assert len(model.equations) == len(model.unknowns) == len(model.rates) + len(model.values)
    start = {name: 293.0 + i for i, name in enumerate(system.lumps)}
    for name, value in start.items():
        assert f"{name}_start" in model.parameters
        model.parameters[f"{name}_start"] = value
    expected = rt.thermal.trajectory(system, record, initial=start, tolerance=1e-7)
    found = model.run(record.time, inputs_of(record))
    for name in (*system.lumps, *system.sensors):
        values = found["sample_2" if name == "sample" else name]  # sample is an operator of Modelica
        np.testing.assert_allclose(values, expected[name], rtol=0, atol=tolerance, err_msg=name)


GROUPS = [[], ["thomson", "seebeck_slope", "heat_source", "sensor_lag"], ["joule_split", "input_gain", "radiation"],
          ["hysteresis", "input_offset", "missing_link"], ["lead_heating", "input_saturation", "sensor_gain"],
          ["natural_convection", "input_delay", "resistance_slope", "sensor_offset"],
          ["hidden_mass", "input_lag", "conductance_step", "conductance_slope"],
          ["sensor_self_heating", "heater_power_slope", "input_feedthrough", "ambient_gradient"],
          ["periodic_load", "condensation", "driven_conductance", "input_gain_slope"],
          ["conductance_exponent", "natural_convection"]]


@pytest.mark.parametrize("effects", GROUPS, ids="-".join)
def test_simulation_of_the_text_is_ours(effects, full, drive):
    system = full.with_parameters({"sensors.T_sample.delay": 2.0})  # whole samples: ours interpolates between them
    for effect in effects:
        if effect.startswith(("seebeck", "resistance", "conductance_slope")):
            system = system.with_parameters({f"modules.tem.{effect.removesuffix('_slope')}.slope": 0.0})
        system = rt.thermal.add_effect(system, effect, *EFFECTS[effect]).system
    compare(system, drive(n=8, seed=3), 2e-4)


def test_heat_in_proportion_to_a_column_is_in_the_text(full, drive):
    turning = rt.System(**{**dict(full), "inputs": {**full.inputs, "turns": {"lump": "sample", "gain": 0.0}}})
    system = rt.thermal.add_effect(turning, "driven_heat", ["turns", "cold"], {"gain": 0.2}).system
    compare(system.with_parameters({"sensors.T_sample.delay": 2.0}), drive(n=8, seed=3, system=system), 2e-4)


def test_a_mass_within_a_path_is_in_the_text(full, drive):
    cooled = rt.thermal.add_effect(full, "missing_ambient_link", ["hot", "room"], {"conductance": 0.5}).system
    system = rt.thermal.add_effect(cooled, "path_mass", ["hot-room"], {"capacity": 30.0, "ratio": 0.6}).system
    compare(system.with_parameters({"sensors.T_sample.delay": 2.0}), drive(n=8, seed=3, system=system), 2e-4)


def test_a_coolant_that_gets_warm_is_in_the_text(full, drive):
    system = rt.thermal.add_effect(full, "missing_ambient_link", ["hot", "room"], {"conductance": 0.5}).system
    system = rt.thermal.add_effect(system, "missing_ambient_link", ["plate", "room"], {"conductance": 0.7}).system
    room = system.ambients["room"].model_copy(update={"coolant": ("plate", "hot")})
    piped = rt.System(**{**dict(system), "ambients": {**system.ambients, "room": room}})
    warmed = rt.thermal.add_effect(piped, "coolant_warming", ["room"], {"warming": 0.6}).system
    assert warmed.parameter("flows.plate-hot.conductance") > 0.1
    compare(warmed.with_parameters({"sensors.T_sample.delay": 2.0}), drive(n=8, seed=3, system=warmed), 2e-4)


def test_voltages_are_outputs_of_the_text(full, drive):
    volt = {"volt": {"module": "tem", "gain": 1.02, "offset": 0.01, "lead_resistance": 0.1}}
    system = rt.System(**{**dict(full), "sensors": {**full.sensors, **volt}})
    system = rt.thermal.add_effect(system, "thomson", ["tem"], {"coefficient": 2e-3}).system
    system = rt.thermal.add_effect(system, "input_lag", ["tem"], {"time_constant": 3.0}).system
    assert 'output Real volt(unit="V")' in rt.thermal.format_modelica(system)
    compare(system.with_parameters({"sensors.T_sample.delay": 2.0}), drive(n=8, seed=3), 2e-4)


def test_every_effect_of_the_catalog_is_tested():
    assert set(EFFECTS) == {effect for group in GROUPS for effect in group}
    others = {"missing_ambient_link", "driven_heat", "path_mass", "coolant_warming"}
    assert set(EFFECTS) | others == set(rt.thermal.effects())


def test_all_effects_at_once(full, drive):
    system = full.with_parameters({"sensors.T_sample.delay": 2.0})
    for effect in ("thomson", "hysteresis", "lead_heating", "input_saturation", "input_delay", "input_lag",
                   "heater_power_slope", "input_feedthrough", "ambient_gradient", "condensation", "periodic_load",
                   "conductance_step", "driven_conductance", "conductance_exponent"):
        system = rt.thermal.add_effect(system, effect, *EFFECTS[effect]).system
    system = rt.thermal.add_effect(system, "input_lag", ["tem"], {"time_constant": 2.0}).system
    compare(system, drive(n=8, seed=4), 5e-4)


@pytest.mark.parametrize("name", ["two_module", "tclab", "tclab_two_state"])
def test_embedded_systems_are_balanced(name):
    system = getattr(rt.systems, name)()
    model = Model(rt.thermal.format_modelica(system))
    assert len(model.equations) == len(model.unknowns) and len(model.rates) >= len(system.lumps)


def test_names_that_modelica_does_not_allow():
    system = rt.System(
        name='a "strange"\n name é', ambients={"der": {"temperature": 300.0}},
        lumps={"1 bär": {"capacity": 10.0}, "1_b_r": {"capacity": 20.0}, "Q_x": {"capacity": 30.0}},
        links=[{"between": ("1 bär", "der"), "conductance": 0.5, "name": "x"},
               {"between": ("1 bär", "1_b_r"), "conductance": 0.5, "name": "time_x"},
               {"between": ("Q_x", "1_b_r"), "conductance": 0.5, "name": "C_Q_x"}], inputs={"initial": {"lump": "Q_x"}})
    model = Model(rt.thermal.format_modelica(system, "end"))
    assert len(model.equations) == len(model.unknowns) == 7
    assert sum(kind == "input" for kind in model.kind.values()) == 2
    assert not {"initial", "der", "end"} & {*model.kind, model.name}


def test_file_is_written_whole_or_refused(full, tmp_path):
    rt.thermal.write_modelica(full, tmp_path / "full.mo", "Full")
    assert (tmp_path / "full.mo").read_text() == rt.thermal.format_modelica(full, "Full")
    with pytest.raises(rt.InputError, match="cannot be written"):
        rt.thermal.write_modelica(full, tmp_path / "none" / "full.mo")
    with pytest.raises(rt.InputError, match="argument system"):
        rt.thermal.format_modelica("full")
