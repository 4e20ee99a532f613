"""Algorithm 1 on the simulated rig of figure 5.5: covariance of one module, average and spread of a batch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from module_rig import NAMES, REFERENCE, SPREAD, TRUE, identified, manufactured, read, run
from sequential import probable

import robthermal as rt


@pytest.fixture(scope="module")
def clean() -> rt.Record:
    return run(TRUE)


def test_the_rig_covers_the_temperatures_of_the_thesis(clean: rt.Record) -> None:
    """Sec. 5.4.3: mean from 15 to 55 °C, cold side from 5 to 85 °C, hot side at 25 °C."""
    cold, hot = clean["T3"] - 273.15, clean["T2"] - 273.15
    assert [cold.min(), cold.max()] == pytest.approx([5.0, 85.0], abs=1.0)
    assert [(cold + hot).min() / 2, (cold + hot).max() / 2] == pytest.approx([15.0, 55.0], abs=1.0)
    assert abs(hot - 25.0).max() < 1.0


def test_without_noise_the_module_comes_back(clean: rt.Record) -> None:
    found = identified(clean)
    np.testing.assert_allclose([*found.values.values()], TRUE, rtol=2e-4)
    assert tuple(found.values) == NAMES


def test_the_covariance_is_that_of_repeated_records(clean: rt.Record) -> None:
    """200 records: deviations and correlations; that of S is 0.98 with that of R, through S = (V - R I)/ΔT."""
    found = [identified(read(clean, seed)) for seed in range(200)]
    seen = np.cov(np.array([[*one.values.values()] for one in found]).T)
    stated = np.mean([one.covariance for one in found], axis=0)
    scale = np.sqrt(np.diag(stated))
    np.testing.assert_allclose(np.sqrt(np.diag(seen)) / scale, 1.0, atol=0.18)
    np.testing.assert_allclose(seen / np.outer(scale, scale), stated / np.outer(scale, scale), atol=0.3)
    assert stated[0, 2] / (scale[0] * scale[2]) < -0.9




def calibrated(values: np.ndarray, std: np.ndarray) -> rt.calibration.ModuleProperties:
    """A calibration with errors of known deviation: for the statistics alone."""
    S, dS, R, dR, K = values
    nothing = pd.DataFrame()
    return rt.calibration.ModuleProperties(
        seebeck=rt.thermal.Linear(value=S, slope=dS), resistance=rt.thermal.Linear(value=R, slope=dR), conductance=K,
        reference_temperature=REFERENCE, covariance=np.diag(std**2), steps=nothing, steady=nothing)


def drawn(rng: np.random.Generator, count: int, ratio: float) -> tuple[rt.calibration.ModuleBatch, np.ndarray]:
    """A batch whose calibrations err by `ratio` times the spread, some twice as much, and another module's truth."""
    values = []
    for k in range(count):
        std = (1 + k % 2) * ratio * SPREAD
        values.append(calibrated(TRUE + SPREAD * rng.standard_normal(5) + std * rng.standard_normal(5), std))
    return rt.calibration.module_batch(values), TRUE + SPREAD * rng.standard_normal(5)


def test_spread_of_published_trials() -> None:
    """Thirteen trials of BCG vaccine (Viechtbauer, J. Stat. Softw. 36(3), 2010, sec. 3): the range of the variance
    between them by the Q profile is 0.1197 to 1.1115."""
    y = np.array([-0.8893, -1.5854, -1.3481, -1.4416, -0.2175, -0.7861, -1.6209, 0.0120, -0.4694, -1.3713, -0.3394,
                  0.4459, -0.0173])
    v = np.array([0.3256, 0.1946, 0.4154, 0.0200, 0.0512, 0.0069, 0.2230, 0.0040, 0.0564, 0.0730, 0.0124, 0.5325,
                  0.0714])
    trials = [calibrated(TRUE + [0, a, 0, 0, 0], np.sqrt([1, b, 1, 1, 1])) for a, b in zip(y, v, strict=True)]
    row = rt.calibration.module_batch(trials).table.loc["seebeck.slope"]
    assert [row["spread_low"] ** 2, row["spread_high"] ** 2] == pytest.approx([0.1197, 1.1115], abs=2e-3)
    w = 1 / (v + row["spread"] ** 2)  # Mandel and Paule: the weighted sum of squares is the degrees of freedom
    mean = w @ y / w.sum()
    assert w @ (y - mean) ** 2 == pytest.approx(12.0, rel=1e-6)
    assert row["mean"] == pytest.approx(mean + TRUE[1], abs=1e-9) and row["std"] == pytest.approx(w.sum() ** -0.5)


def test_calibrations_of_equal_precision_have_the_closed_form() -> None:
    x = TRUE + np.array([[0.0], [0.3], [-0.6]]) * SPREAD
    table = rt.calibration.module_batch([calibrated(each, 0.2 * SPREAD) for each in x]).table
    np.testing.assert_allclose(table["mean"], x.mean(axis=0), rtol=1e-9)
    np.testing.assert_allclose(table["std"], x.std(axis=0, ddof=1) / np.sqrt(3), rtol=1e-6)
    np.testing.assert_allclose(table["spread"] ** 2, x.var(axis=0, ddof=1) - (0.2 * SPREAD) ** 2, rtol=1e-6)
    alike = rt.calibration.module_batch([calibrated(TRUE + 0.1 * k * SPREAD, SPREAD) for k in range(3)]).table
    assert (alike["spread"] == 0).all() and (alike["spread_low"] == 0).all()
    np.testing.assert_allclose(alike["std"], SPREAD / np.sqrt(3), rtol=1e-9)  # not the smaller scatter


@pytest.mark.parametrize(("count", "ratio"), [(3, 0.1), (3, 1.0), (6, 3.0)])
def test_another_module_of_the_type_is_in_its_ranges(count: int, ratio: float) -> None:
    """All five at once with 95 %, calibrations better or worse than the spread."""
    def inside(seed: int) -> bool:
        batch, truth = drawn(np.random.default_rng(seed), count, ratio)
        ends = np.array([*batch.next_module(0.95).values()])
        return bool(((ends[:, 0] <= truth) & (truth <= ends[:, 1])).all())

    assert probable(inside, least=0.95, not_below=0.9)


def test_ranges_are_not_wider_than_they_say() -> None:
    """The range of the spread and the mean, where it is exact: calibrations of one precision."""
    def outside(seed: int) -> bool:
        rng = np.random.default_rng(seed)
        x = TRUE[0] + SPREAD[0] * np.sqrt(2) * rng.standard_normal(4)
        row = rt.calibration.module_batch([calibrated(np.array([each, *TRUE[1:]]), SPREAD) for each in x]).table.iloc[0]
        return not row["spread_low"] <= SPREAD[0] <= row["spread_high"]

    counted = np.mean([outside(seed) for seed in range(400)])
    assert 0.025 < counted < 0.085  # 0.05 ± 3 deviations


@pytest.fixture(scope="module")
def batch() -> rt.calibration.ModuleBatch:
    """Three modules on the rig, as in the thesis."""
    return rt.calibration.module_batch([identified(read(run(each), k)) for k, each in enumerate(manufactured(3, 3))])


def test_the_rig_gives_average_and_spread(batch: rt.calibration.ModuleBatch) -> None:
    """Figures 5.8 and 5.9: the spread is that of the modules themselves, within what calibrations leave open."""
    made = manufactured(3, 3)
    table = batch.table
    mean = np.abs(table["mean"] - made.mean(axis=0)) / table["calibration"]
    assert (mean < 3).all()
    own = made.std(axis=0, ddof=1)
    np.testing.assert_allclose(table["spread"].iloc[[2, 4]], own[[2, 4]], rtol=0.3)
    assert (table["spread_low"] <= own).all() and (own <= table["spread_high"]).all()
    S, R = (np.array([each[k] + each[k + 1] * (288.15 - REFERENCE) for each in made]) for k in (0, 2))
    at = batch.at(288.15)
    np.testing.assert_allclose(at["mean"], [S.mean(), R.mean()], rtol=5e-3)
    own = np.array([S.std(ddof=1), R.std(ddof=1)])
    assert (at["spread_low"] <= own).all() and (own <= at["spread_high"]).all()


def test_the_result_flows_into_the_two_module_setup(batch: rt.calibration.ModuleBatch) -> None:
    setup = batch.applied(rt.systems.two_module())
    S = setup.modules["m2"].seebeck.value + setup.modules["m2"].seebeck.slope * (
        300.0 - setup.modules["m2"].reference_temperature)
    assert pytest.approx(batch.at(300.0).loc["seebeck", "mean"], rel=1e-3) == S
    one = batch.applied(rt.systems.two_module(), "m1")
    assert one.modules["m2"] == rt.systems.two_module().modules["m2"] and one.modules["m1"] == setup.modules["m1"]
    ranges = batch.ranges("m1", "m2", confidence=0.9)
    assert len(ranges) == 10 and all(low < setup.parameter(name) < high for name, (low, high) in ranges.items())
    alone = batch.next_module(0.9)["resistance.value"]
    assert ranges["modules.m1.resistance.value"][0] < alone[0]  # ten at once are wider than five


@pytest.mark.exhaustive
def test_a_box_contracts_with_any_modules_of_the_type(batch: rt.calibration.ModuleBatch) -> None:
    """Ten uncertain parameters: the common bound of all vertices proves less than the vertices say, not nothing."""
    setup = batch.applied(rt.systems.two_module())
    limit = rt.certify.largest_current(setup, temperature=(278.15, 358.15), direction="cooling",
                                       parameters=batch.ranges("m1", "m2"))
    assert limit.certificate.holds and rt.verify(limit.certificate).valid
    assert 2.0 < limit.current < 4.75
    region = {name: (0.0, 4.75) for name in ("m1", "m2")}
    assert not rt.certify.contraction(setup, current=region, temperature=(278.15, 358.15),
                                      parameters=batch.ranges("m1", "m2")).holds


def test_what_is_no_batch_is_refused(batch: rt.calibration.ModuleBatch) -> None:
    one, other = batch.modules[:2]
    with pytest.raises(rt.InputError, match="fewer than two modules.*Calibrate another"):
        rt.calibration.module_batch([one])
    with pytest.raises(rt.InputError, match=r"modules\[1\].*308.15 K, as of the first"):
        rt.calibration.module_batch([one, replace(other, reference_temperature=300.0)])
    with pytest.raises(rt.InputError, match=r"modules\[1\].*not finite"):
        rt.calibration.module_batch([one, replace(other, covariance=np.full((5, 5), np.nan))])
    with pytest.raises(rt.InputError, match="type Linear"):
        rt.calibration.module_batch([one, one.seebeck])
    with pytest.raises(rt.InputError, match="reaches zero.*Calibrate more than 2 modules"):
        rt.calibration.module_batch([one, other]).next_module(0.999)
    with pytest.raises(rt.InputError, match="between 0 and 1"):
        batch.next_module(95)
    with pytest.raises(rt.InputError, match="no module is named"):
        batch.ranges()
    with pytest.raises(rt.InputError, match="Add 273.15"):
        batch.at(25.0)
