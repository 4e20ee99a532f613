"""A thermocycler whose log has gaps and stamps that jitter by 0.2 s, at ramps of some kelvin per second."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import thermocycler

import robthermal as rt
from robthermal.diagnosis._doubts import within_the_body
from robthermal.diagnosis.fit import _refitting

pytestmark = pytest.mark.filterwarnings("ignore::UserWarning")
FEW = ["sensor_lag", "input_lag", "missing_link", "hidden_mass"]


def records(path: Path, *, stamps_right: bool, **machine: float) -> tuple[rt.Record, ...]:
    """Three parts, of which two begin on a ramp."""
    rows = thermocycler.run(800, late=0.2, stamps_right=stamps_right, seed=5, **machine)
    return rt.read_records(thermocycler.write(rows, path / "log.csv", gaps=(301, 481)), thermocycler.SYSTEM, jitter=0.4)


@pytest.mark.parametrize("stamps_right", [True, False])
def test_a_healthy_machine_is_consistent(tmp_path: Path, stamps_right: bool) -> None:
    """Whether the stamps or the rows are right had not been asked, and both machines were "unexplained"."""
    found = rt.diagnose(thermocycler.SYSTEM, records(tmp_path, stamps_right=stamps_right), effects=FEW)
    assert found.verdict == "consistent"


@pytest.mark.parametrize(("machine", "name", "size"), [({"lag": 2.0}, "sensor_lag", 2.0),
                                                       ({"current_lag": 1.5}, "input_lag", 1.5)])
def test_a_lag_is_named_where_rows_are_even(tmp_path: Path, machine: dict[str, float], name: str, size: float) -> None:
    found = rt.diagnose(thermocycler.SYSTEM, records(tmp_path, stamps_right=False, **machine), effects=FEW)
    assert found.verdict == "named" and [one.effect for one in found.effects] == [name]
    assert next(iter(found.effects[0].values.values()))[0] == pytest.approx(size, rel=0.05)


def test_a_lag_of_a_current_is_no_doubt_about_a_lump() -> None:
    """It acts on both faces of a module: the answer "named_with_remainder" had ended with an error there."""
    said = within_the_body(thermocycler.SYSTEM, [("input_lag", ("m1",)), ("input_lag", ("heater",))])
    assert len(said) == 1 and "within lid" in said[0]


def test_starts_from_rest_are_given_up_where_records_begin_in_motion(tmp_path: Path, monkeypatch: pytest.MonkeyPatch
                                                                       ) -> None:
    """They had been fitted to the end beside every candidate."""
    system = thermocycler.SYSTEM.with_parameters({"sensors.T_block.time_constant": 2.0})
    fit = rt.diagnosis.refit(system, records(tmp_path, stamps_right=False, lag=2.0))
    limits: list[int] = []
    minimized = _refitting.minimized

    def counted(structure: object, v: np.ndarray, whiteners: object, limit: int = _refitting.LIMIT) -> object:
        limits.append(limit)
        return minimized(structure, v, whiteners, limit)

    monkeypatch.setattr(_refitting, "minimized", counted)
    again = _refitting.extended(fit, fit.structure, fit.v)
    assert again.structure.n_own == fit.structure.n_own > fit.structure.at_rest().n_own
    assert limits == [_refitting.LIMIT]  # the linearization there says it, before a step


def test_far_from_the_optimum_nothing_settles(tmp_path: Path) -> None:
    """Whatever was at rest after three evaluations had stayed so: a mass of no size was credited with the motion."""
    system = thermocycler.SYSTEM.with_parameters({"sensors.T_block.time_constant": 2.0})
    fit = rt.diagnosis.refit(system, records(tmp_path, stamps_right=False, lag=2.0))
    moving = fit.structure
    assert moving.n_own > moving.at_rest().n_own
    far = moving.start(moving.ranges.start * 1.2, [])
    begun = _refitting.extended(fit, moving, far, 2)
    assert not begun.outcome.ok and begun.structure.n_own == moving.n_own
