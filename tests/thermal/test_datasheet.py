"""Thermoelectric modules from datasheets and material polynomials."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import robthermal as rt
from robthermal.thermal import Polynomials, module_from_datasheet, module_from_polynomials

# Tan & Fok (2008), tables 1 and 2: Vmax, Imax, dTmax, Qmax, Th -> R [Ω], S [V/K], thermal resistance 1/K [K/W]
GOLDEN = {
    "A1": (15.4, 6.0, 67.0, 51.4, 298.0, 1.9896, 0.0517, 1.8708),
    "B1": (15.9, 6.1, 70.0, 60.0, 298.0, 1.9943, 0.0534, 1.8866),
    "C1": (17.5, 6.0, 71.0, 57.0, 298.0, 2.2218, 0.0587, 1.7754),
    "D1": (14.7, 5.6, 66.0, 54.0, 300.0, 2.0475, 0.0490, 2.0558),
}


def fit(name: str):
    v_max, i_max, dt_max, q_max, t_hot = GOLDEN[name][:5]
    return module_from_datasheet(v_max=v_max, i_max=i_max, dt_max=dt_max, q_max=q_max, t_hot=t_hot)


@pytest.mark.parametrize("name", GOLDEN)
def test_published_inversions(name: str) -> None:
    R, S, theta = GOLDEN[name][5:]
    p = fit(name).voltage
    assert p.resistance == pytest.approx(R, abs=6e-5)
    assert p.seebeck == pytest.approx(S, abs=6e-5)
    assert 1 / p.conductance == pytest.approx(theta, abs=6e-5)


@pytest.mark.parametrize("basis", ["voltage", "heat"])
@pytest.mark.parametrize("name", GOLDEN)
def test_the_module_equations_give_the_sheet_back(name: str, basis: str) -> None:
    """Maximize the temperature difference of the module equations over the current, numerically."""
    sheet = fit(name)
    module = sheet.module("h", "c", basis=basis)
    S, R, K = module.seebeck.value, module.resistance.value, module.conductance.value

    def cold(current: float) -> float:
        """Cold face without load: 0 = S Tc I - ½ R I² - K (Th - Tc)."""
        return (0.5 * R * current**2 + K * sheet.t_hot) / (S * current + K)

    best = minimize_scalar(cold, bounds=(0.01 * sheet.i_max, 3 * sheet.i_max), method="bounded",
                           options={"xatol": 1e-10})
    assert best.x == pytest.approx(sheet.i_max, rel=1e-5)
    assert sheet.t_hot - best.fun == pytest.approx(sheet.dt_max, rel=1e-9)
    voltage = S * (sheet.t_hot - best.fun) + R * best.x
    heat = S * sheet.t_hot * sheet.i_max - 0.5 * R * sheet.i_max**2
    if basis == "voltage":
        assert voltage == pytest.approx(sheet.v_max, rel=1e-5)
        assert heat == pytest.approx(sheet.q_max * (1 + sheet.q_max_misfit), rel=1e-9)
    else:
        assert heat == pytest.approx(sheet.q_max, rel=1e-9)
        assert voltage == pytest.approx(sheet.v_max * (1 + sheet.v_max_misfit), rel=1e-5)


def test_figure_of_merit_follows_from_the_temperatures_alone() -> None:
    """At Imax: Z = 2 dTmax/(Th - dTmax)², in both sets."""
    sheet = fit("B1")
    expected = 2 * 70.0 / 228.0**2
    assert sheet.voltage.figure_of_merit == pytest.approx(expected, rel=1e-12)
    assert sheet.heat.figure_of_merit == pytest.approx(expected, rel=1e-12)


def test_misfits_of_the_shared_rows(shared: Path) -> None:
    """Known misfit of Qmax [%] from the V-based set: RMT 0 to -5, Supercool -1 to +4, single rows as listed."""
    rows = json.loads((shared / "systems" / "tem_parameters.json").read_text(encoding="utf-8"))["modules"]
    known = {"TM 127-1.4-4.0": (16, 17), "Melcor CP1.0-127-06L": (9, 11), "CUI/Same Sky CP30238": (4, 6)}
    limited = 0
    families = {"RMT": (-5.5, 0.5), "Supercool": (-1.5, 4.5), "TanFok": (-7.5, 15.5)}
    for row in rows:
        sheet = module_from_datasheet(v_max=row["Vmax_V"], i_max=row["Imax_A"], dt_max=row["dTmax_K"],
                                      q_max=row["Qmax_W"], t_hot=row["Th_C"] + 273.15)
        limits = known.get(row["name"]) or next((v for k, v in families.items() if row["name"].startswith(k)), None)
        if limits:
            limited += 1
            assert limits[0] <= 100 * sheet.q_max_misfit <= limits[1], row["name"]
        assert (sheet.heat is None) == (row["Qmax_W"] is None)
    assert limited == 26


def test_outcome_says_whether_the_sheet_agrees_with_itself() -> None:
    assert fit("B1").outcome.code == "agrees" and fit("B1").outcome
    assert fit("A1").outcome.code == "disagrees" and not fit("A1").outcome
    alone = module_from_datasheet(v_max=15.4, i_max=6.0, dt_max=67.0, t_hot=300.0)
    assert alone.outcome.code == "unchecked" and alone.heat is None and alone.q_max_misfit is None
    assert module_from_datasheet(v_max=15.4, i_max=6.0, dt_max=67.0, t_hot=300.0, q_max=float("nan")) == alone
    assert "Without Qmax" in str(alone) and str(alone).count("\n") == 2
    with pytest.raises(rt.InputError, match="basis.*needs Qmax.*Give q_max"):
        alone.module("h", "c", basis="heat")
    with pytest.raises(rt.InputError, match="argument basis.*'current'"):
        alone.module("h", "c", basis="current")


GOOD = {"v_max": 15.4, "i_max": 6.0, "dt_max": 67.0, "q_max": 51.4, "t_hot": 300.0}


@pytest.mark.parametrize(("change", "message"), [
    ({"t_hot": 27.0}, r"argument t_hot.*looks like Celsius.*Add 273\.15"),
    ({"t_hot": 573.0}, r"argument t_hot.*above 523\.15 K.*twice"),
    ({"dt_max": 149.0}, r"argument dt_max.*single-stage.*Fahrenheit is divided by 1\.8.*65\.0 K"),
    ({"dt_max": 0.0}, r"argument dt_max.*positive number"),
    ({"dt_max": -67.0}, r"argument dt_max.*positive number"),
    ({"i_max": 6000.0}, r"argument i_max.*milliampere.*Divide by 1000"),
    ({"i_max": float("nan")}, r"argument i_max.*not (a number|finite)"),
    ({"v_max": "15.4"}, r"argument v_max.*'15\.4', not a number"),
    ({"v_max": True}, r"argument v_max.*not (a number|finite)"),
    ({"q_max": -1.0}, r"argument q_max.*positive number"),
    ({"q_max": float("inf")}, r"argument q_max.*not (a number|finite)"),
])
def test_bad_sheets_are_refused(change: dict, message: str) -> None:
    with pytest.raises(rt.InputError, match=message):
        module_from_datasheet(**{**GOOD, **change})


def test_surrogate_numbers_are_reproduced(shared: Path) -> None:
    line = json.loads((shared / "systems" / "tem_parameters.json").read_text(
        encoding="utf-8"))["surrogate_127_couples_3p3A"]["linear_fit_288_328K"]
    fitted = module_from_polynomials(rt.systems.ferrotec(), couples=127, i_max=3.3)
    assert fitted.reference_temperature == pytest.approx(line["Tref_K"], abs=1e-9)
    for key, value, digits in (("S0", fitted.seebeck.value, 5e-7), ("S1", fitted.seebeck.slope, 5e-9),
                               ("R0", fitted.resistance.value, 5e-5), ("R1", fitted.resistance.slope, 5e-7),
                               ("K0", fitted.conductance.value, 5e-5), ("K1", fitted.conductance.slope, 5e-8)):
        assert value == pytest.approx(line[key], abs=digits), key


def test_a_straight_line_is_fitted_exactly() -> None:
    """Polynomials of degree one: the fit has no residual, whatever the scaling."""
    lines = Polynomials((0.03, 1e-4), (1.0, 2e-3), (0.2, 1e-4), couples=100, i_max=5.0, source="invented")
    fitted = module_from_polynomials(lines, couples=50, i_max=10.0, t_range=(280.0, 320.0))
    assert max(fitted.residuals) < 1e-14
    module = fitted.module("h", "c", current_limits=(0.0, 10.0))
    assert module.seebeck.value == pytest.approx(0.5 * (0.03 + 1e-4 * 300), rel=1e-13)
    assert module.resistance.slope == pytest.approx(0.25 * 2e-3, rel=1e-11)
    assert module.conductance.value == pytest.approx(0.2 + 1e-4 * 300, rel=1e-13)
    assert module.reference_temperature == 300.0


def test_fit_is_the_least_squares_optimum() -> None:
    """The residual is orthogonal to constants and slopes."""
    polynomials, T = rt.systems.ferrotec(), np.linspace(288.15, 328.15, 81)
    fitted = module_from_polynomials(polynomials, couples=71, i_max=6.0)
    for line, curve in zip((fitted.seebeck, fitted.resistance, fitted.conductance), polynomials.at(T), strict=True):
        error = (line.value + line.slope * (T - 308.15) - curve) / np.abs(curve).max()
        assert abs(error.sum()) < 1e-10
        assert abs(error @ (T - 308.15)) < 1e-9


@pytest.mark.parametrize(("change", "message"), [
    ({"t_range": (15.0, 55.0)}, r"argument t_range.*looks like Celsius"),
    ({"t_range": (320.0, 290.0)}, r"argument t_range.*does not ascend"),
    ({"couples": 0}, r"argument couples.*whole number"),
    ({"couples": 12.5}, r"argument couples.*whole number"),
    ({"i_max": 0.0}, r"argument i_max.*positive number"),
])
def test_bad_polynomial_fits_are_refused(change: dict, message: str) -> None:
    with pytest.raises(rt.InputError, match=message):
        module_from_polynomials(rt.systems.ferrotec(), **{"couples": 127, "i_max": 3.3, **change})


def test_polynomials_that_turn_negative_are_refused() -> None:
    falling = Polynomials((0.03,), (1.0,), (3.0, -0.01), couples=100, i_max=5.0, source="invented")
    with pytest.raises(rt.InputError, match="argument t_range: K is not positive.*Keep to the temperatures"):
        module_from_polynomials(falling, couples=100, i_max=5.0)


def test_numbers_of_a_table_are_accepted() -> None:
    row = rt.systems.datasheets().loc["Supercool/Laird PC-072-14-06"]
    assert module_from_polynomials(rt.systems.ferrotec(), couples=row.couples, i_max=row.Imax_A).seebeck.value > 0
