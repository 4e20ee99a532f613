"""Simulation against closed forms, a tight general-purpose integrator, energy balance, and exact sensitivities."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import robthermal as rt
from robthermal.thermal import _simulate


def reference(system, record, x0, tolerance=1e-11):
    """Lump temperatures by an implicit Runge-Kutta of scipy, restarted at every sample."""
    eq = rt.thermal.Equations(system)
    u = np.column_stack([record[name] if name in record.input_names else np.full(record.n_samples, nominal)
                         for name, nominal in zip(system.exogenous_names, eq.nominal(), strict=True)])
    x = [np.asarray(x0, float)]
    for k in range(record.n_samples - 1):
        run = solve_ivp(lambda t, y, k=k: eq.rate(y, u[k]), (0, record.sample_time), x[-1], method="Radau",
                        rtol=tolerance, atol=tolerance,
                        jac=lambda t, y, k=k: eq.jacobian(y, u[k]).toarray() / eq.capacity[:, None])
        x.append(run.y[:, -1])
    return np.array(x)


def test_one_lump_is_the_exponential():
    system = rt.System(ambients={"room": {"temperature": 300.0}}, lumps={"bar": {"capacity": 50.0}},
                       links=[{"between": ("bar", "room"), "conductance": 2.0}], inputs={"q": {"lump": "bar"}})
    record = rt.Record(sample_time=7.0, inputs=np.full(40, 3.0), outputs=np.zeros((40, 0)), input_names=["q"],
                       output_names=[])
    run = rt.thermal.simulate(system, record)
    assert run["bar"] == pytest.approx(300 + 1.5 * (1 - np.exp(-run.time / 25)), abs=1e-11)


@pytest.mark.exhaustive
@pytest.mark.parametrize("make", [lambda full: full, lambda full: rt.systems.two_module()])
def test_agrees_with_a_tight_integrator(full, drive, make):
    system = make(full)
    record = drive(30, system=system)
    start = np.linspace(295, 300, len(system.lumps))
    run = rt.thermal.trajectory(system, record, initial=start)
    assert np.abs(run.lumps - reference(system, record, start)).max() < 1e-5


@pytest.mark.exhaustive
def test_long_samples_are_refined_until_the_tolerance_is_met(full, drive):
    record = drive(6, sample_time=300.0)
    run = rt.thermal.trajectory(full, record)
    assert np.abs(run.lumps - reference(full, record, run.lumps[0])).max() < 1e-3


def test_energy_balances_to_rounding(full, drive):
    for system in (full, rt.systems.two_module()):
        run = rt.thermal.trajectory(system, drive(500, system=system))
        turnover = np.abs(run.ambient_heat).max() + np.abs(run.electrical_energy).max()
        assert np.abs(run.energy_residual).max() < 1e-11 * turnover
        assert np.abs(run.stored).max() > 1.0  # something happened


@pytest.mark.exhaustive
def test_implicit_method_agrees_and_balances(full, drive, monkeypatch):
    record = drive(80)
    exact = rt.thermal.trajectory(full, record)
    monkeypatch.setattr(_simulate, "_DENSE_STATES", 0)
    for tolerance in (1e-3, 1e-5):
        run = rt.thermal.trajectory(full, record, tolerance=tolerance)
        assert run.method == "implicit"
        assert np.abs(run.lumps - exact.lumps).max() < 20 * tolerance
        assert np.abs(run.energy_residual).max() < 1e-9
    assert run.electrical_energy == pytest.approx(exact.electrical_energy, abs=0.01)
    assert run.readings[:, 0] == pytest.approx(exact.readings[:, 0], abs=1e-4)
    assert rt.thermal.simulate(full, record, tolerance=1e-5).outputs == pytest.approx(run.readings, abs=1e-12)


def test_sensor_is_lag_delay_gain_and_offset():
    system = rt.thermal.parse_system("""
[system]
temperature_unit = "K"
[ambients.room]
temperature = 300.0
[lumps.bar]
capacity = 20.0
[[links]]
between = ["bar", "room"]
conductance = 1.0
[inputs.q]
lump = "bar"
[sensors.T]
lump = "bar"
time_constant = 5.0
delay = 3.3
gain = 1.1
offset = -0.2
""")
    n = 100
    record = rt.Record(sample_time=1.0, inputs=np.full(n, 4.0), outputs=np.zeros((n, 0)), input_names=["q"],
                       output_names=[])
    t = np.maximum(np.arange(n) - 3.3, 0.0)
    lagged = 4 * (1 - (20 * np.exp(-t / 20) - 5 * np.exp(-t / 5)) / 15)
    assert rt.thermal.simulate(system, record)["T"] == pytest.approx(300 + 1.1 * lagged - 0.2, abs=2e-4)


def test_linear_network_with_delayed_heaters_is_that_of_shifted_inputs_on_a_finer_grid():
    """600 samples, more than one recursion takes; delays that are multiples of 0.2 s."""
    n, delays = 600, {"q": 3.4, "p": 1.2}
    values = np.random.default_rng(0).uniform(0.0, 40.0, (n, 2))

    def system(**delay):
        return rt.System(
            ambients={"room": {"temperature": 295.0}}, lumps={f"x{i}": {"capacity": 30.0} for i in range(3)},
            links=[{"between": ("x0", "x1"), "conductance": 2.0}, {"between": ("x1", "x2"), "conductance": 2.0},
                   {"between": ("x0", "room"), "conductance": 0.5}],
            inputs={name: {"lump": lump, "drive": {"delay": delay.get(name, 0.0)}} for name, lump in
                    (("q", "x2"), ("p", "x0"))}, sensors={"T0": {"lump": "x0"}, "T2": {"lump": "x2"}})

    def simulated(system, inputs, sample_time):
        record = rt.Record(sample_time=sample_time, inputs=inputs, outputs=np.zeros((len(inputs), 0)),
                           input_names=["q", "p"], output_names=[])
        return rt.thermal.simulate(system, record).outputs

    fine = np.repeat(values, 5, axis=0)
    for column, delay in enumerate(delays.values()):
        late = round(delay / 0.2)
        fine[:, column] = np.concatenate([np.full(late, fine[0, column]), fine[:-late, column]])
    assert simulated(system(**delays), values, 1.0) == pytest.approx(simulated(system(), fine, 0.2)[::5], abs=1e-8)


@pytest.mark.exhaustive
def test_sensitivities_are_the_derivatives_of_the_simulation(full, drive):
    record = drive(14)
    full = full.with_parameters({"lumps.plate.initial": 296.0})
    names = [name for name in full.parameter_names if not name.endswith((".noise", ".disturbance"))
             and not (name.endswith((".time_constant", ".delay")) and full.parameter(name) == 0)]  # one-sided below
    assert len(names) >= 33
    exact = rt.thermal.trajectory(full, record, sensitivities=names, tolerance=1e-8).sensitivity
    for column, name in enumerate(names):
        value = full.parameter(name)
        step = 1e-4 * abs(value) if value and "temperature" not in name and "initial" not in name else 1e-3

        def readings(k, name=name, value=value, step=step):
            moved = full.with_parameters({name: value + k * step})
            return rt.thermal.trajectory(moved, record, tolerance=1e-8).readings

        difference = (readings(-2) - 8 * readings(-1) + 8 * readings(1) - readings(2)) / (12 * step)
        scale = np.abs(difference).max()
        assert np.abs(difference - exact[..., column]).max() <= 1e-5 * scale + 1e-7, name


def test_derivatives_can_be_asked_for_afterwards(full, drive, monkeypatch):
    record, names = drive(40), ["modules.tem.seebeck.value", "sensors.T_plate.delay", "lumps.plate.capacity"]
    run = rt.thermal.trajectory(full, record)
    assert run.sensitivity.shape == (40, 2, 0)
    known = rt.thermal.trajectory(full, record, sensitivities=names).sensitivity
    np.testing.assert_array_equal(run.derivative(names), known)
    with pytest.raises(rt.InputError, match="tempo"):
        run.derivative(["lumps.plate.tempo"])
    monkeypatch.setattr("robthermal.thermal._simulate._DENSE_STATES", 1)
    large = rt.thermal.trajectory(full, record)
    assert large.method == "implicit" and large.sensitivity.shape == (40, 2, 0)
    with pytest.raises(rt.InputError, match="sensitivities of a network"):
        large.derivative(names)


@pytest.mark.parametrize("field", ["time_constant", "delay"])
def test_a_sensor_without_lag_or_delay_still_has_that_derivative(full, drive, field):
    record, name, step = drive(40), f"sensors.T_plate.{field}", 1e-3
    run = rt.thermal.trajectory(full, record, sensitivities=[name])
    moved = rt.thermal.trajectory(full.with_parameters({name: step}), record)
    difference = (moved.readings - run.readings)[:, 0] / step
    assert run.sensitivity[:, 0, 0] == pytest.approx(difference, abs=0.02 * np.abs(difference).max())
    assert np.abs(difference).max() > 0.1


def test_ambient_that_the_record_lacks_is_a_parameter(full, drive):
    record = drive(40).select(inputs=["heater", "tem", "sink"], outputs=[])
    name = "ambients.room.temperature"
    exact = rt.thermal.trajectory(full, record, sensitivities=[name]).sensitivity[..., 0]
    up, down = (rt.thermal.trajectory(full.with_parameters({name: full.parameter(name) + d}), record).readings
                for d in (0.01, -0.01))
    assert exact == pytest.approx((up - down) / 0.02, abs=1e-5)
    assert np.abs(exact).max() > 0.5


def test_initial_temperatures_default_to_the_nearest_reading(full, drive):
    driven = drive(10)
    outputs = np.column_stack([np.full(10, 310.0), np.full(10, 301.0)])
    record = rt.Record(sample_time=1.0, inputs=driven.inputs, outputs=outputs, input_names=driven.input_names,
                       output_names=["T_plate", "T_sample"])
    start = rt.thermal.trajectory(full, record).lumps[0]
    T_ref = 297.15
    assert start.tolist() == pytest.approx([310.0, 310.0, T_ref + (301 - 0.3 - T_ref) / 1.03, 299.15])


def test_errata_set_point_case_without_control(drive):
    # errata: 3.3 A in both modules ends at 148 °C on the hot side
    n = 4000
    record = rt.Record(sample_time=1.0, inputs=np.tile([3.3, 3.3, 298.15], (n, 1)), outputs=np.zeros((n, 0)),
                       input_names=["m1", "m2", "room"], output_names=[])
    run = rt.thermal.trajectory(rt.systems.two_module(), record)
    assert run["x9"][-1] - 273.15 == pytest.approx(148, abs=1.5)


def test_runaway_is_an_error_that_names_time_and_lump():
    n = 3000
    record = rt.Record(sample_time=1.0, inputs=np.tile([-3.3, -3.3, 298.15], (n, 1)), outputs=np.zeros((n, 0)),
                       input_names=["m1", "m2", "room"], output_names=[])
    with pytest.raises(rt.Diverged, match="runs away at .* lump 'x1[12]'") as caught:
        rt.thermal.simulate(rt.systems.two_module(), record)
    assert 0 < caught.value.time < n


@pytest.mark.parametrize(("change", "message"), [
    (lambda r: r.select(inputs=["tem", "room", "sink"], outputs=[]), "no column 'heater'"),
    (lambda r: "run.csv", "expected a robthermal.Record|Expected a robthermal.Record"),
])
def test_bad_records_are_refused(full, drive, change, message):
    with pytest.raises(rt.InputError, match=message):
        rt.thermal.simulate(full, change(drive(5)))


@pytest.mark.parametrize("initial", [25.0, [300.0] * 3, {"plate": 300.0}, [np.nan] * 4])
def test_bad_initial_temperatures_are_refused(full, drive, initial):
    with pytest.raises(rt.InputError, match="argument initial"):
        rt.thermal.simulate(full, drive(5), initial=initial)


def test_celsius_ambient_in_a_record_is_refused(full, drive):
    record = drive(5)
    celsius = rt.Record(sample_time=1.0, inputs=record.inputs - [0, 0, 273.15, 0], outputs=np.zeros((5, 0)),
                        input_names=record.input_names, output_names=[])
    with pytest.raises(rt.InputError, match="'room' falls to .* kelvin"):
        rt.thermal.simulate(full, celsius)
