"""The compiled steps: no less accurate than numpy's, for every kind of heat; what they cannot do is left to numpy."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import compiled
import numpy as np
import pytest

import robthermal as rt
from robthermal._library import LANES, library_name
from robthermal.thermal import _exponential, _march

PARTS = [("conductance_step", ["plate-hot"], {"relative": -0.3, "time": 40.5}),
         ("driven_conductance", ["cold-sample", "tem"], {"relative": 0.2}),
         ("conductance_exponent", ["sample-room"], {"exponent": 1.7}),
         ("condensation", ["cold"], {"conductance": 0.01, "dew_point": 330.0}),
         ("lead_heating", ["hot", "tem"], {"resistance": 0.2}),
         ("heater_power_slope", ["heater"], {"slope": 0.004}), ("thomson", ["tem"], {"coefficient": 2e-4}),
         ("joule_split", ["tem"], {"split": 0.1})]


@pytest.fixture
def every(full: rt.System) -> rt.System:
    """A system with every kind of heat, and no temperature near the dew point: a kink takes many halvings."""
    for name, where, values in PARTS:
        full = rt.thermal.add_effect(full, name, where, values).system
    return full


@pytest.fixture(params=LANES)
def lumps(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Any]:
    """Temperatures of a simulation by the compiled steps, or without them, and how many segments these were asked for.

    With vectors of every width that this processor has.
    """
    found = compiled.steps(request.param)

    def simulated(system: rt.System, record: rt.Record, tolerance: float, built: bool) -> tuple[np.ndarray, list[int]]:
        counts: list[int] = []

        def counted(*problem: Any) -> int:
            counts.append(found.march(*problem))
            return counts[-1]

        monkeypatch.setattr(_exponential, "library", lambda: replace(found, march=counted) if built else None)
        return rt.thermal.trajectory(system, record, tolerance=tolerance).lumps, counts

    return simulated


def test_every_kind_of_heat_is_tried(every: rt.System) -> None:
    assert {type(term) for term in rt.thermal.Equations(every, ripple=("tem",)).terms} == set(_march._KINDS)


def test_a_ripple_heats_as_numpy_says(every: rt.System, drive: Any, lumps: Any) -> None:
    record = drive(80, system=every, sample_time=0.25)
    with_ripple = record.changed(ripple={"tem": np.linspace(0.0, 1.0, len(record))})
    (here, counts), (theirs, _) = lumps(every, with_ripple, 1e-6, True), lumps(every, with_ripple, 1e-9, False)
    assert sum(counts) > 60
    np.testing.assert_allclose(here, theirs, rtol=0.0, atol=1e-6)
    assert np.abs(here - lumps(every, record, 1e-6, True)[0]).max() > 0.01


@pytest.mark.parametrize("sample_time", [0.25, 0.5])
def test_no_farther_from_the_limit_than_numpy(every: rt.System, drive: Any, lumps: Any, sample_time: float) -> None:
    """The limit is numpy's at a tolerance of 1e-9 K, which is tested against an integrator of scipy elsewhere."""
    record = drive(80, system=every, sample_time=sample_time)
    exact, _ = lumps(every, record, 1e-9, False)
    here, counts = lumps(every, record, 1e-4, True)
    theirs, none = lumps(every, record, 1e-4, False)
    assert sum(counts) > 60 and not none
    errors = np.abs(here - exact).max(), np.abs(theirs - exact).max()
    assert errors[0] < max(errors[1], 1e-7) and errors[1] < 1e-4


def test_a_tight_tolerance_is_met(every: rt.System, drive: Any, lumps: Any) -> None:
    record = drive(40, system=every, sample_time=0.02)
    (exact, _), (here, counts) = lumps(every, record, 1e-10, False), lumps(every, record, 1e-10, True)
    assert sum(counts) > 0
    np.testing.assert_allclose(here, exact, rtol=0.0, atol=1e-9)


def test_samples_that_are_too_long_are_halved(every: rt.System, drive: Any, lumps: Any) -> None:
    record = drive(60, system=every, sample_time=8.0)
    (exact, _), (here, counts) = lumps(every, record, 1e-8, False), lumps(every, record, 1e-4, True)
    assert 0 in counts and {2, 4} & set(counts)  # a sample that is not computed as a whole, and its halves
    np.testing.assert_allclose(here, exact, rtol=0.0, atol=1e-4)


def test_samples_of_a_delayed_current_are_computed_in_parts(every: rt.System, drive: Any, lumps: Any) -> None:
    every = every.with_parameters({"modules.tem.drive.delay": 0.7})
    record = drive(80, system=every, sample_time=0.25)
    (exact, _), (here, counts) = lumps(every, record, 1e-9, False), lumps(every, record, 1e-4, True)
    assert max(counts) > 100  # two parts of a sample, in one call
    np.testing.assert_allclose(here, exact, rtol=0.0, atol=1e-4)


@pytest.mark.parametrize("lanes", LANES)
@pytest.mark.parametrize("n", [3, 57, 58, 60, 61, 62, 63, 64])
def test_derivatives_are_those_of_numpy(every: rt.System, drive: Any, monkeypatch: pytest.MonkeyPatch, n: int,
                                        lanes: int) -> None:
    """Along one path, by every number of the system; numpy's are tested against differences elsewhere.

    As many samples as a vector has numbers are differentiated at a time: none, one or some are left at the end.
    """
    found = compiled.steps(lanes)
    every = every.with_parameters({"modules.tem.drive.time_constant": 3.0})  # then a drive is a port, too
    names = [name for name in every.parameter_names if not name.endswith((".noise", ".disturbance"))]
    slopes, asked = [], []
    run = rt.thermal.trajectory(every, drive(n, system=every, sample_time=0.5))
    for built in (replace(found, derivatives=lambda problem: asked.append(1) or found.derivatives(problem)), None):
        monkeypatch.setattr(_exponential, "library", lambda built=built: built)
        run.derivative.by._compiled.clear()
        slopes.append(run.derivative(names))
    scale = np.abs(slopes[1]).max(axis=(0, 1))
    assert asked and np.count_nonzero(scale) > (40 if n > 3 else 20)
    np.testing.assert_allclose(slopes[0], slopes[1], rtol=0.0, atol=1e-9 * scale.max())
    assert (np.abs(slopes[0] - slopes[1]).max(axis=(0, 1)) <= 1e-8 * scale + 1e-12).all()


def test_what_a_small_pivot_stops_is_left_to_numpy(every: rt.System, drive: Any, monkeypatch: pytest.MonkeyPatch,
                                                   tmp_path: Path) -> None:
    """Every pivot counts as small there: no sample is differentiated in C, and the derivatives are numpy's."""
    compiled.steps()  # skips without a compiler
    other = compiled.copied(_march, tmp_path / "tree", "#define PIVOT 1e-2", "#define PIVOT 1e9")
    compiled.hook()["build"](other, tmp_path / compiled.name_of(_march))
    found = _march.library(tmp_path)
    assert found is not None
    done, slopes = [], []
    run = rt.thermal.trajectory(every, drive(30, system=every, sample_time=0.5))
    tried = replace(found, derivatives=lambda problem: done.append(found.derivatives(problem)) or done[-1])
    for built in (tried, None):
        monkeypatch.setattr(_exponential, "library", lambda built=built: built)
        run.derivative.by._compiled.clear()
        slopes.append(run.derivative(["modules.tem.seebeck.value", "modules.tem.conductance.value"]))
    assert done and not any(done)
    np.testing.assert_allclose(slopes[0], slopes[1], rtol=1e-9, atol=1e-9 * np.abs(slopes[1]).max())


def test_runaway_is_an_error_no_later(lumps: Any) -> None:
    system = rt.System(
        ambients={"room": {"temperature": 300.0}}, lumps={"hot": {"capacity": 5.0}, "cold": {"capacity": 5.0}},
        links=[{"between": ("hot", "room"), "conductance": 0.05}, {"between": ("cold", "hot"), "conductance": 0.1}],
        modules={"m": {"hot": "hot", "cold": "cold", "seebeck": {"value": 0.05},
                       "resistance": {"value": 2.0, "slope": 0.02}, "conductance": {"value": 0.5},
                       "reference_temperature": 300.0, "current_limits": (-9.0, 9.0)}})
    record = rt.Record(sample_time=1.0, inputs=np.full(2000, 8.0), outputs=np.zeros((2000, 0)), input_names=["m"],
                       output_names=[])
    said = []
    for built in (True, False):
        with pytest.raises(rt.errors.Diverged, match="runs away") as error:
            lumps(system, record, 1e-4, built)
        said.append(error.value.time)
    assert 0 < said[0] <= said[1] < said[0] + 16  # numpy looks at the temperatures of sixteen samples together


def test_sizes_that_do_not_fit_are_refused(full: rt.System) -> None:
    by = _exponential.Integrator(rt.thermal.Equations(full), (1.0,))
    march = _march.Marching(compiled.steps(), by.port_heat, by.step(0, 0), by.gain(0, 0), 1e-7, 1e-3, 3000.0)
    z, w = np.zeros((11, by.nz)), np.zeros((10, by.eq.drives.width))
    for states, drives in ((z[:-1], w), (z[:, :-1], w), (z, w[:, 1:]), (np.zeros((11, 2 * by.nz))[:, ::2], w),
                           (z.astype(np.float32), w)):
        with pytest.raises(ValueError, match="do not fit"):
            _march.Lengths([march])(np.zeros(10, int), states, drives)
    for kinds in (np.zeros(0, int), np.full(10, 1), np.full(10, -1)):
        with pytest.raises(ValueError, match="no segments, or of another length"):
            _march.Lengths([march])(kinds, z[:len(kinds) + 1], w[:len(kinds)])
    for states, drives, n_free in ((z[:9], w, 3), (z[:, :-1], w, 3), (z[:10], w[:, 1:], 3), (z[:10], w, by.nz + 1)):
        with pytest.raises(ValueError, match="do not fit"):
            march.linearized(states, drives, n_free)


def test_numpy_takes_what_the_library_does_not_hold(full: rt.System, monkeypatch: pytest.MonkeyPatch) -> None:
    heat = _exponential.Integrator(rt.thermal.Equations(full), (1.0,)).port_heat
    assert _march.holds(heat, 64) and not _march.holds(heat, 65)
    others = {kind: known for kind, known in _march._KINDS.items() if kind.__name__ != "RadiationTerm"}
    monkeypatch.setattr(_march, "_KINDS", others)
    assert not _march.holds(heat, 10)


def test_a_sample_without_a_fixed_point_is_not_computed(full: rt.System) -> None:
    """At a current of a megaampere."""
    by = _exponential.Integrator(rt.thermal.Equations(full), (1.0,))
    march = _march.Marching(compiled.steps(), by.port_heat, by.step(0, 0), by.gain(0, 0), 1e-7, 1e-3, 3000.0)
    z, w = np.full((2, by.nz), 300.0), np.tile(by.eq.drives(by.eq.nominal()), (2, 1))
    assert march.linearized(z, w, 4) is not None
    w[1, by.eq.drives.column["tem"]] = 1e6
    assert march.linearized(z, w, 4) is None
    assert _march.Lengths([march])(np.zeros(2, int), np.full((3, by.nz), 300.0), w)[0] == 1


def test_a_library_of_another_source_is_not_loaded(tmp_path: Path) -> None:
    name, other = compiled.name_of(_march), compiled.copied(_march, tmp_path / "tree", new=" ")
    assert name != library_name(other, _march.HEADERS)
    (tmp_path / library_name(other, _march.HEADERS)).write_bytes(b"")
    assert _march.library(tmp_path) is None
    (tmp_path / "damaged").mkdir()
    (tmp_path / "damaged" / name).write_bytes(b"no library")
    assert _march.library(tmp_path / "damaged") is None


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_the_hook_builds_it_beside_its_source_or_into_a_wheel(tmp_path: Path) -> None:
    folder, name = compiled.copied(_march, tmp_path).parent, compiled.name_of(_march)
    (folder / "_march_0123456789abcdef.so").write_bytes(b"old")
    assert compiled.built_by_hook(tmp_path, "editable") == {"force_include": {}}
    assert [path.name for path in folder.glob("*.so")] == [name] and _march.library(folder) is not None
    wheel = compiled.built_by_hook(tmp_path, "standard")
    assert list(wheel["force_include"].values()) == [f"robthermal/thermal/{name}"] and wheel["pure_python"] is False
