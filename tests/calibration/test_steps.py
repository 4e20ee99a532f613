"""Convection law and module properties from staircases, on simulated data whose truth is known."""

from __future__ import annotations

import numpy as np
import pytest

import robthermal as rt
from robthermal.errors import InputError

AREA, LAW = 0.01, {"conductance": 0.05, "natural": {"gain": 0.02, "exponent": 0.25}}


LEVELS = (0.5, 1.0, 2.0, 4.0, 6.0, 8.0)


def warmed(hold: int = 100, noise: float = 0.0, levels: tuple[float, ...] = LEVELS) -> rt.Record:
    body = rt.System(ambients={"air": {"temperature": 295.0}}, lumps={"x": {"capacity": 10.0}},
                     links=[{"between": ("x", "air"), **LAW}], inputs={"q": {"lump": "x"}},
                     sensors={"T": {"lump": "x"}})
    heat = np.repeat(levels, hold)
    empty = rt.Record(sample_time=20.0, inputs=np.column_stack([heat, np.full(heat.size, 295.0)]),
                      outputs=np.zeros((heat.size, 0)), input_names=["q", "air"], output_names=[])
    run = rt.thermal.simulate(body, empty)
    return run.with_outputs(run.outputs + noise * np.random.default_rng(0).standard_normal(run.outputs.shape))


def law_of(record: rt.Record, **options: float) -> rt.calibration.ConvectionLaw:
    return rt.calibration.convection_law(record, heater="q", sensor="T", ambient="air", **({"area": AREA} | options))


def test_convection_law_is_recovered() -> None:
    law = law_of(warmed())
    assert law.outcome.ok
    np.testing.assert_allclose([law.a, law.b, law.c], [5.0, 2.0, 0.25], rtol=1e-3)
    assert law.link()["natural"]["gain"] == pytest.approx(0.02, rel=1e-3)
    np.testing.assert_allclose(law.coefficient([10.0, 50.0]), 5.0 + 2.0 * np.array([10.0, 50.0]) ** 0.25, rtol=1e-5)


def test_noisy_law_is_right_where_it_was_measured() -> None:
    law = law_of(warmed(noise=0.05))
    seen = law.points["difference"].to_numpy()
    np.testing.assert_allclose(law.coefficient(seen), 5.0 + 2.0 * seen**0.25, rtol=0.01)


def test_unsteady_plateaus_are_not_believed() -> None:
    with pytest.raises(InputError, match="warm and steady"):
        law_of(warmed(hold=10))
    with pytest.raises(InputError, match="a staircase of at least 3"):
        law_of(warmed(levels=(1.0, 2.0)))
    with pytest.raises(InputError, match="argument area"):
        law_of(warmed(), area=0.0)
    with pytest.raises(InputError, match="no column 'T9'"):
        rt.calibration.convection_law(warmed(), heater="q", sensor="T9", ambient="air", area=AREA)


S, R, K = {"value": 0.05, "slope": 8e-5}, {"value": 4.0, "slope": 0.02}, 0.3


def stepped(noise: float = 0.0) -> rt.Record:
    """Cold face insulated, hot face on a good sink; voltage V = S (Th - Tc) + R I with S, R at the mean temperature."""
    system = rt.System(
        ambients={"sink": {"temperature": 298.15}}, lumps={"h": {"capacity": 30.0}, "c": {"capacity": 10.0}},
        links=[{"between": ("h", "sink"), "conductance": 20.0}],
        modules={"m": {"hot": "h", "cold": "c", "seebeck": S, "resistance": R, "conductance": K,
                       "reference_temperature": 298.15}},
        sensors={"Th": {"lump": "h"}, "Tc": {"lump": "c"}})
    current = np.repeat([0.0, 0.3, 0.6, 0.9, 0.5, -0.2, -0.4, 0.0], 4000)
    empty = rt.Record(sample_time=0.1, inputs=current, outputs=np.zeros((current.size, 0)), input_names=["m"],
                      output_names=[])
    run = rt.thermal.simulate(system, empty)
    T = (run["Th"] + run["Tc"]) / 2 - 298.15
    V = (S["value"] + S["slope"] * T) * (run["Th"] - run["Tc"]) + (R["value"] + R["slope"] * T) * current
    rng = np.random.default_rng(1)
    outputs = np.column_stack([run.outputs + noise * rng.standard_normal(run.outputs.shape),
                               V + 0.1 * noise * rng.standard_normal(current.size)])
    return run.with_outputs(outputs, ["Th", "Tc", "V"])


@pytest.mark.parametrize(("noise", "close"), [(0.0, 1e-3), (0.005, 0.03)])
def test_module_properties_are_recovered(noise: float, close: float) -> None:
    found = rt.calibration.module_properties(stepped(noise), current="m", voltage="V", hot="Th", cold="Tc")
    assert found.seebeck.value == pytest.approx(S["value"], rel=close)
    assert found.resistance.value == pytest.approx(R["value"], rel=close)
    assert found.conductance == pytest.approx(K, rel=close)
    assert found.seebeck.slope == pytest.approx(S["slope"], rel=5 * close)
    assert found.resistance.slope == pytest.approx(R["slope"], rel=5 * close)
    assert found.module("h", "c").conductance.value == found.conductance


def test_short_steps_of_current_are_refused() -> None:
    with pytest.raises(InputError, match="argument record"):
        rt.calibration.module_properties(stepped()[:4100], current="m", voltage="V", hot="Th", cold="Tc")
