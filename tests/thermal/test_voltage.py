"""Voltage of a module as a measured output: sign, energy, simulation, derivatives, linearization, refusals."""

import control
import numpy as np
import pytest
from voltage_rig import FILE, TRUE, drive, log, system, voltage

import robthermal as rt

RNG = np.random.default_rng(11)
CURRENTS = np.repeat(RNG.uniform(-1.2, 2.0, 12), 8)


def rich(**numbers):
    """The rig with everything that a voltage may depend on."""
    text = FILE.replace("[sensors.T_cold]", "thomson = 2.0e-4\njoule_split = 0.1\n[sensors.T_cold]")
    text += "gain = 1.01\noffset = 0.003\nlead_resistance = 0.08\n"
    return rt.thermal.parse_system(text).with_parameters(numbers)


def test_open_circuit_and_signs() -> None:
    made = system()
    still = rt.thermal.simulate(made, drive(np.zeros(2), 1.0), initial={"hot": 310.0, "cold": 290.0})
    assert still["V1"][0] == pytest.approx(TRUE["S"] * 20.0, rel=1e-14)  # the mean is the reference temperature
    turned = rt.thermal.simulate(made, drive(np.zeros(2), 1.0), initial={"hot": 290.0, "cold": 310.0})
    assert turned["V1"][0] == pytest.approx(-TRUE["S"] * 20.0, rel=1e-14)
    cooling = rt.thermal.simulate(made, drive(np.full(200, 1.0), 1.0))
    assert cooling["T_cold"][-1] < cooling["T_cold"][0] and cooling["V1"][0] == pytest.approx(
        voltage(295.15, 295.15, 1.0), rel=1e-12)
    assert (np.diff(cooling["V1"][:100]) > 0).all()  # the difference of the faces grows, and opposes the source


@pytest.mark.parametrize("current", [-1.7, 0.4, 2.5])
@pytest.mark.parametrize(("hot", "cold"), [(330.0, 270.0), (281.0, 312.0), (300.0, 300.0)])
def test_power_is_what_the_faces_reject_together(hot: float, cold: float, current: float) -> None:
    """V I = Σ heat with current - Σ heat without it: conduction and links are the same in both."""
    made = rich(**{"sensors.V1.gain": 1.0, "sensors.V1.offset": 0.0, "sensors.V1.lead_resistance": 0.0})
    eq, x = rt.thermal.Equations(made), np.array([hot, cold])
    on, off = eq.nominal(), eq.nominal()
    on[0] = current
    power = eq.heat(x, on).sum() - eq.heat(x, off).sum()
    read = rt.thermal.simulate(made, drive(np.full(2, current), 1.0), initial=x)["V1"][0]
    assert read * current == pytest.approx(power, abs=1e-12 * max(1.0, np.abs(eq.heat(x, on)).max()))


def test_electrical_energy_of_a_run_is_the_integral_of_v_i() -> None:
    h, currents = 0.05, np.repeat([1.5, -0.8, 0.0, 2.0], 400)
    run = rt.thermal.trajectory(system(), drive(currents, h))
    ends = voltage(run.lumps[1:, 0], run.lumps[1:, 1], currents[:-1])  # just before each switching
    energy = np.sum(0.5 * h * (run["V1"][:-1] + ends) * currents[:-1])
    assert run.electrical_energy[-1, 0] == pytest.approx(energy, rel=1e-7)


def test_simulation_agrees_with_scipy() -> None:
    measured, _ = log(CURRENTS, 4.0)
    found = rt.thermal.simulate(system(), drive(CURRENTS, 4.0), tolerance=1e-8)
    assert found.output_names == ("T_cold", "V1") and found.units == {"V1": "V"}
    assert np.abs(found.outputs - measured).max(axis=0) == pytest.approx([0.0, 0.0], abs=2e-6)


PARAMETERS = {"modules.m1.seebeck.value": 1e-5, "modules.m1.seebeck.slope": 1e-7, "modules.m1.resistance.value": 1e-3,
              "modules.m1.resistance.slope": 1e-5, "modules.m1.conductance.value": 1e-4, "modules.m1.thomson": 1e-6,
              "modules.m1.conductance.slope": 1e-6, "modules.m1.joule_split": 1e-3,
              "modules.m1.reference_temperature": 1e-2, "modules.m1.drive.gain": 1e-4, "modules.m1.drive.offset": 1e-4,
              "sensors.V1.gain": 1e-4, "sensors.V1.offset": 1e-4, "sensors.V1.lead_resistance": 1e-4,
              "lumps.hot.capacity": 1e-2, "links.hot-room.conductance": 1e-4, "lumps.cold.initial": 1e-2,
              "ambients.room.temperature": 1e-2}


@pytest.mark.exhaustive
@pytest.mark.parametrize("slow", [{}, {"modules.m1.drive.time_constant": 6.0}, {"modules.m1.drive.delay": 5.0}],
                         ids=["prompt", "lagged", "delayed"])
def test_sensitivities_are_derivatives(slow: dict) -> None:
    made = rich(**slow)
    made = made.model_copy(update={"lumps": {**made.lumps, "cold": rt.thermal.Lump(capacity=35.0, initial=296.0)}})
    steps = PARAMETERS | ({"modules.m1.drive.time_constant": 1e-3} if "modules.m1.drive.time_constant" in slow else {})
    record = drive(CURRENTS, 4.0)
    exact = rt.thermal.trajectory(made, record, sensitivities=list(steps), tolerance=1e-8).sensitivity
    errors = {}
    for column, (name, step) in enumerate(steps.items()):
        value = made.parameter(name)
        up, down = (rt.thermal.trajectory(made.with_parameters({name: value + sign * step}), record,
                                          tolerance=1e-8).readings for sign in (1, -1))
        by_difference = (up - down) / (2 * step)
        scale = np.abs(by_difference).max(axis=0) + 1e-6
        errors[name] = float((np.abs(exact[..., column] - by_difference).max(axis=0) / scale).max())
    assert len(errors) >= 18 and {name: error for name, error in errors.items() if error > 2e-5} == {}


@pytest.mark.parametrize("slow", [{}, {"modules.m1.drive.time_constant": 6.0, "modules.m1.drive.gain": 0.2}],
                         ids=["prompt", "lagged"])
def test_linearization_is_the_derivative_of_the_readings(slow: dict) -> None:
    """Simulated from the operating point with a small step of current, against python-control."""
    made = rich(**slow)
    point = {"m1": 0.8}
    rest = rt.thermal.steady_state(made, point).equilibria[0].temperatures
    plant = rt.thermal.linearize(made, rest, point, sample_time=4.0)
    small = 1e-4
    moved = np.full(40, 0.8)
    moved[5:] += small
    before, after = (rt.thermal.simulate(made, drive(u, 4.0), initial=rest, tolerance=1e-9)
                     for u in (np.full(40, 0.8), moved))
    answer = control.forced_response(plant, U=np.vstack([moved - 0.8, np.zeros(40)])).outputs
    by_simulation = (after.outputs - before.outputs).T
    assert np.abs(answer - by_simulation).max(axis=1) == pytest.approx(np.zeros(2), abs=2e-3 * small)
    assert plant.output_labels == ["T_cold", "V1"] and bool(np.any(plant.D)) == (not slow)


def test_one_step_at_a_time_reads_the_current_that_has_flowed() -> None:
    made, h = rich(), 4.0
    plant = rt.thermal.Stepper(made, h, tolerance=1e-8)
    run = rt.thermal.trajectory(made, drive(CURRENTS, h), tolerance=1e-8)
    for k in range(20):
        plant.step({"m1": float(CURRENTS[k])})
        hot, cold = run.lumps[k + 1]
        S, R = made.modules["m1"].seebeck, made.modules["m1"].resistance
        above = 0.5 * (hot + cold) - made.modules["m1"].reference_temperature
        volt = (S.value + S.slope * above - 2e-4) * (hot - cold) + (R.value + R.slope * above + 0.08) * CURRENTS[k]
        assert plant.readings[1] == pytest.approx(1.01 * volt + 0.003, abs=1e-6)


def test_large_networks_read_voltages() -> None:
    lumps = {f"x{i}": {"capacity": 5.0} for i in range(280)}
    links = [{"between": (f"x{i}", f"x{i + 1}"), "conductance": 2.0} for i in range(279)]
    big = rt.System(ambients={"room": {"temperature": 300.0}}, lumps=lumps,
                    links=[*links, {"between": ("x0", "room"), "conductance": 1.0}],
                    modules={"m1": {"hot": "x0", "cold": "x279", "seebeck": 0.05, "resistance": 2.0,
                                    "conductance": 0.3}},
                    sensors={"T_cold": {"lump": "x279"}, "V1": {"module": "m1"}, "T_hot": {"lump": "x0"}})
    record = drive(np.repeat([1.0, -0.5], 10), 2.0)
    found = rt.thermal.simulate(big, record)
    by_hand = 0.05 * (found["T_hot"] - found["T_cold"]) + 2.0 * record["m1"]
    assert found["V1"] == pytest.approx(by_hand, abs=1e-12)
    assert np.ptp(found["T_cold"]) > 1.0
    assert rt.thermal.trajectory(big, record)["V1"] == pytest.approx(by_hand, abs=1e-12)


def test_system_files_hold_voltages() -> None:
    made = rich()
    assert made.sensor_units == {"T_cold": "K", "V1": "V"} and list(made.thermometers) == ["T_cold"]
    assert rt.thermal.parse_system(rt.thermal.format_system(made)) == made
    short = rt.thermal.parse_system(FILE.replace('quantity = "voltage"\n', ""))
    assert short.sensors["V1"].quantity == "voltage"
    assert rt.thermal.parse_system(rt.thermal.format_system(short)) == short
    assert short.with_parameters({"sensors.V1.gain": 1.1}).sensors["V1"].unit == "V"


@pytest.mark.parametrize(("old", "new", "message"), [
    ('module = "m1"\n', "", r"\[sensors\.V1\].*'lump' is missing.*or the module"),
    ('module = "m1"\n', 'module = "m1"\nlump = "hot"\n', r"\[sensors\.V1\].*a lump and a module"),
    ('module = "m1"\n', 'module = "m2"\n', r"\[sensors\.V1\] module.*'m2' does not exist.*Expected a module"),
    ('quantity = "voltage"', 'quantity = "temperature"', r"\[sensors\.V1\].*a module a voltage"),
    ('quantity = "voltage"', 'quantity = "current"', r"\[sensors\.V1\].*quantity = 'current'.*voltage"),
    ('lump = "cold"\n', 'lump = "cold"\nquantity = "voltage"\n', r"\[sensors\.T_cold\].*a lump has a temperature"),
    ("noise = 0.002", "noise = 0.002\ndelay = 1.0", r"\[sensors\.V1\].*delay does not belong to a voltage"),
    ("noise = 0.002", "noise = 0.002\ntime_constant = 1.0", r"\[sensors\.V1\].*time_constant does not belong"),
    ("noise = 0.002", "noise = 0.002\nself_heating = 1.0", r"\[sensors\.V1\].*self_heating does not belong"),
    ("noise = 0.02\n", "noise = 0.02\nlead_resistance = 0.1\n", r"\[sensors\.T_cold\].*lead_resistance does not"),
    ("noise = 0.002", "noise = 0.002\nlead_resistance = -0.1", r"\[sensors\.V1\].*lead_resistance.*at least 0"),
    ("noise = 0.002", "noise = 0.002\nlead = 0.1", r"\[sensors\.V1\].*unknown key 'lead'.*lead_resistance"),
])
def test_bad_sensors_are_refused(old: str, new: str, message: str) -> None:
    assert old in FILE
    with pytest.raises(rt.InputError, match=message):
        rt.thermal.parse_system(FILE.replace(old, new))


def test_what_needs_temperatures_refuses_a_voltage() -> None:
    made = system()
    said = r"V1.*voltage of module 'm1', not a temperature.*some of T_cold"
    with pytest.raises(rt.InputError, match=said):
        rt.certify.observer(made, gain=np.ones((2, 1)), sensors=["V1"], current={"m1": (0.0, 1.0)},
                            temperature=(280.0, 320.0))
    with pytest.raises(rt.InputError, match=said):
        rt.design.observer(made, sensors=["T_cold", "V1"], sample_time=1.0)
    with pytest.raises(rt.InputError, match=said):
        rt.design.place_sensors(made, temperature=(280.0, 320.0), largest=1, current={"m1": (0.0, 1.0)},
                                candidates=["V1"])
    with pytest.raises(rt.InputError, match=r"no sensor 'V2'.*some of T_cold"):
        rt.design.observer(made, sensors=["V2"], sample_time=1.0)


def test_claims_of_the_machine_do_not_feel_a_voltmeter() -> None:
    made = system()
    bare = made.model_copy(update={"sensors": made.thermometers})
    box = {"current": {"m1": (0.0, 1.0)}, "temperature": (280.0, 330.0)}
    with_it, without = (rt.certify.contraction(one, **box) for one in (made, bare))
    assert with_it.holds and without.holds and with_it.evidence == without.evidence
    assert rt.verify(with_it).valid
    seen = rt.certify.observer(made, gain=np.full((2, 1), 0.05), sensors=["T_cold"], current={"m1": (0.0, 0.5)},
                               temperature=(285.0, 310.0))
    assert "V1" not in seen.claim and rt.verify(seen).valid == seen.holds
