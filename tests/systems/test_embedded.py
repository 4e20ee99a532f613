"""Embedded systems are what their sources say."""

from __future__ import annotations

import json
import math
from importlib.resources import files
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.linalg import expm

import robthermal as rt
from robthermal.thermal import System, format_system, parse_system


@pytest.mark.parametrize("build", [rt.systems.two_module, rt.systems.tclab, rt.systems.tclab_two_state])
def test_survives_a_round_trip(build) -> None:
    system = build()
    assert parse_system(format_system(system)) == system


def test_two_module_is_the_shared_file(shared: Path) -> None:
    embedded = files("robthermal.systems").joinpath("two_module.toml").read_bytes()
    assert embedded == (shared / "systems" / "two_module.toml").read_bytes()
    assert rt.systems.two_module() == rt.read_system(shared / "systems" / "two_module.toml")


def test_two_module_reproduces_the_sums_of_the_errata() -> None:
    """Sum of B: 1.657 and 0.1216 W/K; sum of E: 275.1 and 71.5 J/K (hot and cold side)."""
    system = rt.systems.two_module()
    hot = {f"x{i}" for i in range(1, 11)}
    outside = {link.between[0]: link.conductance for link in system.links if link.between[1] == "room"}
    assert sum(g for x, g in outside.items() if x in hot) == pytest.approx(1.657, abs=5e-4)
    assert sum(g for x, g in outside.items() if x not in hot) == pytest.approx(0.1216, abs=5e-5)
    assert sum(lump.capacity for x, lump in system.lumps.items() if x in hot) == pytest.approx(275.1, abs=0.05)
    assert sum(lump.capacity for x, lump in system.lumps.items() if x not in hot) == pytest.approx(71.5, abs=0.05)


def test_tclab_holds_the_published_priors() -> None:
    system = rt.systems.tclab()
    sigma, eps, A, A_s = 5.670374419e-8, 0.9, 1e-3, 2e-4
    expected = {"lumps.heater_1.capacity": 0.004 * 500, "links.heater_1-room.conductance": 4.7 * A,
                "links.heater_2-room.radiation": eps * sigma * A, "links.heater_1-heater_2.conductance": 15.45 * A_s,
                "links.heater_1-heater_2.radiation": eps * sigma * A_s, "inputs.Q1.gain": 0.0123,
                "inputs.Q2.gain": 0.0062, "sensors.T1.time_constant": 20.3, "sensors.T2.time_constant": 20.3}
    for name, value in expected.items():
        assert system.parameter(name) == pytest.approx(value, rel=1e-4), name
    assert system.temperature_unit == "degC" and system.sensor_names == ("T1", "T2")


@pytest.mark.parametrize(("run", "published"), [("sine_5min_run_2", 1.21), ("step_50_run_2", 0.20),
                                                ("sine_50min_run_2", 4.29)])
def test_tclab_two_state_is_the_published_model(shared: Path, run: str, published: float) -> None:
    """Free-running from the first reading, by matrix exponentials: the RMSE known for the published parameters [K]."""
    C_H, C_S, U_a, U_b, gain = (rt.systems.tclab_two_state().parameter(name) for name in (
        "lumps.heater.capacity", "lumps.sensor.capacity", "links.heater-room.conductance",
        "links.heater-sensor.conductance", "inputs.Q1.gain"))
    M = np.array([[-(U_a + U_b) / C_H, U_b / C_H, gain / C_H], [U_b / C_S, -U_b / C_S, 0], [0, 0, 0]])
    data = pd.read_csv(shared / "data" / "tclab_dowling" / f"{run}.csv")
    state, simulated = np.zeros(2), []
    for step, power in zip(np.diff(data["Time"], append=data["Time"].iloc[-1] + 1), data["Q1"], strict=True):
        simulated.append(state[1])
        state = (expm(step * M) @ [*state, power])[:2]
    error = np.array(simulated) + data["T1"].iloc[0] - data["T1"]
    assert math.sqrt(np.mean(error**2)) == pytest.approx(published, abs=0.006)


def test_surrogate_module_is_the_module_of_the_setup() -> None:
    modules = rt.systems.two_module().modules
    assert rt.systems.surrogate_module("x9", "x11") == modules["m1"]
    assert rt.systems.surrogate_module("x10", "x12") == modules["m2"]
    assert rt.systems.surrogate_module("a", "b", current_limits=(-1.0, 2.0)).current_limits == (-1.0, 2.0)


def test_ferrotec_polynomials_and_scaling_match_the_shared_table(shared: Path) -> None:
    table = json.loads((shared / "systems" / "tem_parameters.json").read_text(encoding="utf-8"))
    reference, surrogate = table["polynomials_71_couples_6A"], table["surrogate_127_couples_3p3A"]
    polynomials = rt.systems.ferrotec()
    assert list(polynomials.seebeck) == reference["S_V_per_K"]
    assert list(polynomials.resistance) == reference["R_ohm"]
    assert list(polynomials.conductance) == reference["K_W_per_K"]
    S, R, K = polynomials.at(surrogate["T_K"], couples=127, i_max=3.3)
    np.testing.assert_allclose(S, surrogate["S"], rtol=1e-12)
    np.testing.assert_allclose(R, surrogate["R"], rtol=1e-12)
    np.testing.assert_allclose(K, surrogate["K"], rtol=1e-12)


def test_datasheets_match_the_shared_table(shared: Path) -> None:
    rows = json.loads((shared / "systems" / "tem_parameters.json").read_text(encoding="utf-8"))["modules"]
    table = rt.systems.datasheets()
    assert list(table.index) == [row["name"] for row in rows]
    for column in ("Th_C", "Vmax_V", "Imax_A", "Qmax_W", "dTmax_K", "R_ac_ohm", "couples"):
        expected = np.array([np.nan if row[column] is None else row[column] for row in rows], float)
        np.testing.assert_array_equal(table[column].to_numpy(float, na_value=np.nan), expected, err_msg=column)
    assert table[["source", "caveat"]].notna().all().all()


def test_a_system_built_on_the_surrogate_is_valid() -> None:
    system = System(ambients={"room": {"temperature": 298.15}}, lumps={"h": {"capacity": 10.0}, "c": {"capacity": 5.0}},
                    links=[{"between": ("h", "room"), "conductance": 0.5}],
                    modules={"m": rt.systems.surrogate_module("h", "c")})
    assert system.module_names == ("m",)
