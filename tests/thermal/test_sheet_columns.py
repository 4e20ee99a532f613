"""Datasheets with several hot-side columns, operating points, heat sinks: against the module equations themselves."""

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar

import robthermal as rt
from robthermal.thermal import Linear, Properties, Rating, invert_datasheet, module_point, size_sink

SURROGATE = Properties(Linear(value=0.053743, slope=7.421e-5), Linear(value=4.6298, slope=0.022751),
                       Linear(value=0.2968, slope=4e-4), 308.15)
CONSTANT = Properties(Linear(value=0.0516), Linear(value=3.05), Linear(value=0.331), 265.15)


def absorbed(p: Properties, hot: float, cold: float, current: float) -> float:
    """Heat balance of the cold face, written out again."""
    above = 0.5 * (hot + cold) - p.reference_temperature
    S, R, K = (x.value + x.slope * above for x in (p.seebeck, p.resistance, p.conductance))
    return S * cold * current - 0.5 * R * current**2 - K * (hot - cold)


def sheet_of(p: Properties, hot: float) -> Rating:
    """What a vendor would print: the coldest face without load over all currents, by brute search."""
    def coldest(current: float) -> float:
        return brentq(lambda cold: absorbed(p, hot, cold, current), hot - 120.0, hot + 60.0, xtol=1e-12)

    best = minimize_scalar(coldest, bounds=(0.3, 8.0), method="bounded", options={"xatol": 1e-11})
    cold, current = coldest(best.x), best.x
    above = 0.5 * (hot + cold) - p.reference_temperature
    voltage = (p.seebeck.value + p.seebeck.slope * above) * (hot - cold) + (
        p.resistance.value + p.resistance.slope * above) * current
    return Rating(t_hot=hot, v_max=voltage, i_max=current, dt_max=hot - cold, q_max=absorbed(p, hot, hot, current))


@pytest.mark.parametrize("truth", [SURROGATE, CONSTANT], ids=["slopes", "constant"])
@pytest.mark.parametrize("basis", ["voltage", "heat"])
def test_two_columns_give_the_module_back(truth: Properties, basis: str) -> None:
    found = invert_datasheet([sheet_of(truth, 298.15), sheet_of(truth, 323.15)]).by(basis)
    for mean in (270.0, 290.0, 300.0):
        assert found.properties.at(mean) == pytest.approx(truth.at(mean), rel=2e-5)
    assert found.largest_misfit < 1e-5
    assert [set(off) for off in found.misfits] == [{"v_max", "i_max", "dt_max", "q_max"}] * 2


def test_one_column_is_the_inversion_without_slopes() -> None:
    old = rt.thermal.module_from_datasheet(v_max=15.4, i_max=6.0, dt_max=67.0, q_max=51.4, t_hot=298.0)
    new = invert_datasheet([Rating(t_hot=298.0, v_max=15.4, i_max=6.0, dt_max=67.0, q_max=51.4)])
    for mine, theirs in ((new.voltage, old.voltage), (new.heat, old.heat)):
        assert mine.properties.at(280.0) == pytest.approx(
            (theirs.seebeck, theirs.resistance, theirs.conductance), rel=1e-12)
        assert mine.properties.seebeck.slope == 0.0
    assert new.voltage.misfits[0]["q_max"] == pytest.approx(old.q_max_misfit, abs=1e-9)
    assert new.heat.misfits[0]["v_max"] == pytest.approx(old.v_max_misfit, abs=1e-9)
    assert new.outcome.code == old.outcome.code == "disagrees"
    assert "Qmax [%]" in str(new) and "+10.1" in str(new)


def test_published_sheets_are_reproduced_in_their_own_numbers() -> None:
    table, inverted = rt.systems.datasheets(), {}
    for name in dict.fromkeys(table.index):
        rows = [Rating(t_hot=row.Th_C + 273.15, v_max=row.Vmax_V, i_max=row.Imax_A, dt_max=row.dTmax_K,
                       q_max=row.Qmax_W) for row in table.loc[[name]].itertuples()]
        inverted[name] = invert_datasheet(rows)
    few = [one for one in inverted.values() if len(one.ratings) <= 2]
    assert len(few) >= 25 and len(inverted) == len(few) + 1  # one sheet has three columns
    own = [abs(off[key]) for one in few for off in one.voltage.misfits for key in ("v_max", "i_max", "dt_max")]
    assert max(own) < 1e-9
    by_heat = [abs(off[key]) for one in few if one.heat for off in one.heat.misfits
               for key in ("q_max", "i_max", "dt_max")]
    assert max(by_heat) < 1e-9
    three = inverted["RMT 1MC06-126-03"].voltage  # straight lines through three columns: not exact, and it is said
    assert 1e-4 < max(abs(off["i_max"]) for off in three.misfits) < 0.01
    # the vendor's own resistance rises by 0.45 %/K between 27 and 75 °C
    assert three.properties.resistance.slope / three.properties.resistance.value == pytest.approx(0.0045, abs=0.001)


@pytest.mark.parametrize("p", [SURROGATE, CONSTANT], ids=["slopes", "constant"])
def test_operating_points_balance(p: Properties) -> None:
    for load in (-3.0, 0.0, 6.0):
        point = module_point(p, hot=310.0, cold=288.0, load=load)
        assert point.outcome.code == "held" and point.load == pytest.approx(load, abs=1e-10)
        assert absorbed(p, 310.0, 288.0, point.current) == pytest.approx(load, abs=1e-10)
        assert point.rejected - point.load == pytest.approx(point.power, abs=1e-12)
        assert absorbed(p, 310.0, 288.0, 0.5 * point.current) < load  # the smaller of the two currents
    given = module_point(p, hot=310.0, cold=288.0, current=1.3)
    assert given.load == pytest.approx(absorbed(p, 310.0, 288.0, 1.3), rel=1e-14)
    assert given.cop == pytest.approx(given.load / (given.voltage * 1.3), rel=1e-14)


def test_a_load_beyond_the_module_is_not_held() -> None:
    point = module_point(CONSTANT, hot=310.0, cold=270.0, load=60.0)
    most = max(absorbed(CONSTANT, 310.0, 270.0, current) for current in np.linspace(0.0, 9.0, 90001))
    assert not point.outcome and point.load == pytest.approx(most, rel=1e-8)
    assert f"at most {most:.4g} W" in point.outcome.text and "60 W are wanted" in point.outcome.text


def test_the_largest_sink_is_the_fold_of_the_errata() -> None:
    """Constant S, R, K: I* is a root of the cubic in the errata of Evers' chapter 5, at the load q*."""
    S, R, K = (x.value for x in (CONSTANT.seebeck, CONSTANT.resistance, CONSTANT.conductance))
    for cold, load in ((283.15, 8.0), (278.15, 3.0), (290.0, 0.0)):
        sink = size_sink(CONSTANT, cold=cold, ambient=298.15, load=load)
        g, w = 1 / sink.resistance, 298.15
        roots = np.roots([-2 * R * S**2, S * (5 * K * R + 4 * g * R + 2 * S**2 * cold),
                          -2 * (K + g) * (2 * K * R + g * R + 2 * S**2 * cold),
                          2 * g * S * ((g + 2 * K) * cold - K * w)])
        real = min(root.real for root in roots if abs(root.imag) < 1e-9 and root.real > 0)
        i = sink.limit.current
        assert i == pytest.approx(real, rel=1e-4)
        q = (g * K * (cold - w) + g * S * cold * i - (g * R / 2 + K * R + S**2 * cold) * i**2 + S * R * i**3 / 2) / (
            g + K - S * i)
        assert q == pytest.approx(load, abs=1e-5)


@pytest.mark.parametrize("p", [SURROGATE, CONSTANT], ids=["slopes", "constant"])
def test_no_current_holds_load_and_temperature_on_a_larger_sink(p: Properties) -> None:
    """Brute force over currents: hot faces on the sink, and the heat that is then absorbed."""
    sink = size_sink(p, cold=281.0, ambient=296.0, load=4.0)

    def most(resistance: float) -> float:
        best = -np.inf
        for current in np.linspace(0.05, 4.0, 800):
            def excess(hot: float, current: float = current) -> float:
                point = module_point(p, hot=hot, cold=281.0, current=current)
                return hot - 296.0 - resistance * point.rejected
            if excess(400.0) > 0:
                best = max(best, absorbed(p, brentq(excess, 250.0, 400.0), 281.0, current))
        return best

    assert most(1.01 * sink.resistance) < 4.0 < most(0.99 * sink.resistance)
    on_half = sink.point(0.5 * sink.resistance)
    assert on_half.hot == pytest.approx(296.0 + 0.5 * sink.resistance * on_half.rejected, abs=1e-6)
    assert on_half.load == pytest.approx(4.0, abs=1e-8) and on_half.current < sink.limit.current
    beyond = sink.point(1.1 * sink.resistance)
    assert beyond.outcome.code == "not_held" and "at most" in beyond.outcome.text


def test_no_sink_is_good_enough() -> None:
    sink = size_sink(CONSTANT, cold=253.15, ambient=298.15, load=18.0)
    assert not sink.outcome and sink.resistance == 0.0 and "Even with its hot face at the ambient" in sink.outcome.text
    assert not sink.point(0.1).outcome


GOOD = {"t_hot": 300.15, "v_max": 15.5, "i_max": 3.9, "dt_max": 70.0, "q_max": 32.0}


@pytest.mark.parametrize(("change", "message"), [
    ({"dt_max": 91.0}, r"argument dt_max: 91 K.*single-stage"),
    ({"dt_max": 88.0, "t_hot": 275.0}, r"figure of merit of 0\.005"),
    ({"dt_max": 343.15}, r"argument dt_max.*70 °C would be a temperature"),
    ({"q_max": 32000.0}, r"argument q_max: Qmax = 32000 W, but Vmax · Imax = 60\.45 W.*mW"),
    ({"i_max": 0.039}, r"argument q_max.*Vmax · Imax = 0\.6045 W.*mA"), ({"v_max": 155.0}, r"argument q_max.*mV"),
    ({"t_hot": 27.0}, r"argument t_hot.*looks like Celsius"), ({"i_max": 3900.0}, r"argument i_max.*milliampere"),
])
def test_impossible_ratings_are_refused(change: dict, message: str) -> None:
    with pytest.raises(rt.InputError, match=message):
        Rating(**{**GOOD, **change})


@pytest.mark.parametrize(("columns", "message"), [
    ([], "0 columns"), ([Rating(**GOOD), Rating(**{**GOOD, "t_hot": 302.15})], "within 5 K.*says nothing about slopes"),
])
def test_columns_that_say_nothing_are_refused(columns: list, message: str) -> None:
    with pytest.raises(rt.InputError, match=message):
        invert_datasheet(columns)


def test_bad_points_are_refused() -> None:
    with pytest.raises(rt.InputError, match="load and current: both are given"):
        module_point(CONSTANT, hot=300.0, cold=290.0, load=1.0, current=1.0)
    with pytest.raises(rt.InputError, match="argument current.*None"):
        module_point(CONSTANT, hot=300.0, cold=290.0)
    with pytest.raises(rt.InputError, match="argument cold.*looks like Celsius"):
        module_point(CONSTANT, hot=300.0, cold=10.0, load=1.0)
    with pytest.raises(rt.InputError, match="not below the ambient"):
        size_sink(CONSTANT, cold=300.0, ambient=298.0, load=1.0)
    with pytest.raises(rt.InputError, match='basis.*"voltage" or "heat"'):
        invert_datasheet([Rating(**GOOD)]).by("current")
    with pytest.raises(rt.InputError, match="needs Qmax"):
        invert_datasheet([Rating(**{**GOOD, "q_max": None})]).module("h", "c", basis="heat")
