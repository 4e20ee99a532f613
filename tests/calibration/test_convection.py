"""Convection law of the bar of chapter 2, against finite volumes integrated by scipy (tests/chapter_2_bar.py)."""

from __future__ import annotations

import math

import chapter_2_bar as bar
import numpy as np
import pytest

import robthermal as rt
from robthermal.errors import InputError

LEVELS = (0.25, 0.5, 1.0, 1.5, 2.0, 2.5)
HOLD = 60  # samples of 5 minutes: five hours, as in the thesis
FILM = 8.0  # with which the model is built: only its areas count


@pytest.fixture(scope="module")
def record() -> rt.Record:
    return bar.staircase(LEVELS, HOLD, swing=0.5, noise=0.01)


def of_bar(record: rt.Record, system: rt.System, **options: object) -> rt.calibration.ConvectionLaw:
    return rt.calibration.convection_of_body(system, record, **({"heater": "u1", "ambient": "room", "film": FILM}
                                                                | options))


def test_taken_for_uniform_the_bar_has_44_percent_too_little_and_it_is_said(record: rt.Record) -> None:
    law = rt.calibration.convection_law(record, heater="u1", sensor="T1", ambient="room", area=bar.SURFACE)
    assert law.coefficient(10.0) / bar.film(np.array(10.0)) - 1 == pytest.approx(-0.44, abs=0.02)
    assert law.outcome.code == "not_uniform" and not law.outcome.ok
    assert "T1, T2, T3, T4, T5 differ by up to 8" in law.outcome.text
    assert np.isinf(law.covariance).all() and math.isinf(law.deviation(10.0))


def test_readings_of_the_hot_half_alone_are_uniform_and_nothing_is_said(record: rt.Record) -> None:
    half = record.select(outputs=["T1", "T2"])
    law = rt.calibration.convection_law(half, heater="u1", sensor=("T1", "T2"), ambient="room", area=bar.SURFACE / 2)
    assert law.outcome.ok and np.isfinite(law.covariance).all()
    assert (law.points["spread"] < 0.1 * law.points["difference"]).all()


def test_with_a_model_of_the_bar_the_law_is_right(record: rt.Record) -> None:
    law = of_bar(record, bar.model(FILM))
    assert law.outcome.ok and law.area == pytest.approx(bar.SURFACE)
    seen = np.array([3.0, 5.0, 10.0, 15.0, 25.0])  # both halves together
    np.testing.assert_allclose(law.coefficient(seen), bar.film(seen), rtol=0.003)
    assert law.c == pytest.approx(0.25, abs=4 * math.sqrt(law.covariance[2, 2]))
    # One coefficient for the whole bar is not the law at the mean difference: warm places lose more of the heat.
    ratio = law.points["coefficient"] / law.coefficient(law.points["difference"])
    assert ((ratio > 1.03) & (ratio < 1.07)).all()
    assert (law.points["spread"] > law.points["difference"]).all()
    assert (law.points["residual"] < 0.02).all()


def test_the_second_heater_may_be_on() -> None:
    law = of_bar(bar.staircase(LEVELS[1:5], HOLD, second=0.6), bar.model(FILM))
    seen = np.array([6.0, 12.0, 20.0])
    np.testing.assert_allclose(law.coefficient(seen), bar.film(seen), rtol=0.003)


def test_a_model_that_conducts_wrongly_is_not_believed(record: rt.Record) -> None:
    law = of_bar(record, bar.model(FILM, pom=0.24))
    assert law.outcome.code == "not_explained" and np.isinf(law.covariance).all()
    assert abs(law.coefficient(3.0) / bar.film(np.array(3.0)) - 1) > 0.05  # it would be wrong


def test_a_step_of_half_a_watt_is_predicted(record: rt.Record) -> None:
    """Evers figure 2.12: T1 and T2, a step of 0.5 W; the record was not used for the law."""
    step = bar.staircase((0.5,), HOLD)
    predicted = {}
    for name, system in (("law", of_bar(record, bar.model(FILM)).applied(bar.model(FILM), ambient="room", film=FILM)),
                         ("constant", bar.model(FILM))):
        run = rt.thermal.simulate(system, step, initial=bar.ROOM)
        predicted[name] = np.abs(run.outputs - step.outputs).max()
    assert np.ptp(step["T1"]) > 6.0
    assert predicted["law"] < 0.05 < 1.0 < predicted["constant"]


def test_deviations_are_those_of_repeated_experiments() -> None:
    system, rng = bar.model(FILM), np.random.default_rng(4)
    clean = bar.staircase(tuple(np.linspace(0.25, 2.5, 10)), 20, sample_time=900.0)
    laws = [of_bar(clean.with_outputs(clean.outputs + 0.05 * rng.standard_normal(clean.outputs.shape)), system)
            for _ in range(6)]
    values = np.array([law.coefficient(10.0) for law in laws])
    stated = np.sqrt(np.mean([law.deviation(10.0) ** 2 for law in laws]))
    assert abs(values.mean() - bar.film(np.array(10.0))) < 4 * stated / math.sqrt(6)
    assert 0.3 < values.std(ddof=1) / stated < 2.2


@pytest.mark.parametrize(("options", "words"), [
    ({"film": 0.0}, "argument film"),
    ({"ambient": "lab"}, "no lump loses heat to 'lab'"),
    ({"heater": "u9"}, "no heater of the system"),
])
def test_bad_arguments_are_named(record: rt.Record, options: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        of_bar(record, bar.model(FILM), **options)


def test_records_and_systems_that_do_not_belong_together(record: rt.Record) -> None:
    system = bar.model(FILM)
    with pytest.raises(InputError, match="no thermometer of the system"):
        of_bar(record.with_outputs(record.outputs, ["a", "b", "c", "d", "e"]), system)
    with pytest.raises(InputError, match="no column 'u2'"):
        of_bar(record.select(inputs=["u1", "room"]), system)
    cold = record.with_outputs(record.outputs - 30.0)
    with pytest.raises(InputError, match="0 plateaus of 'u1' warm the body"):
        of_bar(cold, system)
    natural = of_bar(record, system).applied(system, ambient="room", film=FILM)
    with pytest.raises(InputError, match="natural convection already"):
        of_bar(record, natural)
    with pytest.raises(InputError, match="no sensor is named"):
        rt.calibration.convection_law(record, heater="u1", sensor=(), ambient="room", area=1.0)


def test_law_is_drawn_with_its_points(record: rt.Record) -> None:
    axes = of_bar(record, bar.model(FILM)).plot()
    assert len(axes.lines) == 2 and len(axes.lines[0].get_xdata()) == len(LEVELS)
