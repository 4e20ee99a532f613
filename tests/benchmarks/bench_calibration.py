"""Calibration: coverage of the ranges on the two-module machine; RMSE on measured data (needs ../shared/data)."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import numpy as np
from _timing import best_of, header, row
from scipy.signal import lfilter

import robthermal as rt

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT.parent / "shared" / "data"
REPEATS, N_SAMPLES = 60, 360  # half an hour of the demo's record


def example(name: str) -> ModuleType:
    """Load examples/tclab/NAME.py."""
    spec = importlib.util.spec_from_file_location(f"example_{name}", ROOT / "examples" / "tclab" / f"{name}.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def coverage(pole: float) -> tuple[float, float, float]:
    """Part of repetitions with all nine true values inside their 95 % ranges: ellipsoid, box; median half-width [-]."""
    project = rt.jobs.read_project(rt.jobs.demo_project())
    system = project.system
    truth = {name: system.parameter(name) for name in system.fit}
    clean = rt.thermal.simulate(system, rt.read_record(project.train[0], system)[:N_SAMPLES])
    sigma = np.array([system.sensors[name].noise for name in clean.output_names])
    start = system.with_parameters({name: 1.02 * value for name, value in truth.items()})
    hits, widths = {"ellipsoid": 0, "box": 0}, []
    for seed in range(REPEATS):
        white = np.random.default_rng(seed).standard_normal((N_SAMPLES + 500, sigma.size))
        noise = lfilter([np.sqrt(1 - pole**2)], [1.0, -pole], white, axis=0)[500:]
        fit = rt.calibrate(start, clean.with_outputs(clean.outputs + sigma * noise), initial=project.initial)
        for shape in hits:
            ranges = fit.ranges(0.95, shape)
            hits[shape] += all(ranges[name][0] <= value <= ranges[name][1] for name, value in truth.items())
        widths += [(high - low) / 2 / truth[name] for name, (low, high) in fit.ranges().items()]
    return hits["ellipsoid"] / REPEATS, hits["box"] / REPEATS, float(np.median(widths))


def main() -> None:
    """Print the coverage of ranges, one row per fit, then the cross-validation tables."""
    header(f"Two-module machine, 9 parameters, {REPEATS} repetitions: all true values inside their 95 % ranges")
    for pole in (0.0, 0.9):
        seconds, (joint, box, width) = best_of(lambda pole=pole: coverage(pole), repeats=1)
        row(f"noise with pole {pole}", seconds / REPEATS,
            f"ellipsoid {joint:.3f}, box {box:.3f}; median half-width of the ellipsoid {100 * width:.3g} %")
    header("Calibration on measured data (free-run RMSE)")
    if not DATA.is_dir():
        print("skipped: no folder ../shared/data beside the checkout")
        return
    two_state, two_heaters = example("two_state"), example("two_heaters")
    runs = two_state.read_runs(DATA)
    fits = {}
    for name, record in runs.items():
        seconds, fits[name] = best_of(lambda record=record: two_state.fit(record))
        row(f"two-state, {name}", seconds,
            f"T1 {fits[name].rmse['T1']:.3f} K; published parameters {two_state.published(record):.2f} K")
    training = two_heaters.read_run(DATA, two_heaters.TRAINING)
    validation = two_heaters.read_run(DATA, two_heaters.HEATER_1)
    seconds, fit = best_of(lambda: two_heaters.fit(training, validation), repeats=1)
    row("two heaters, random run", seconds, f"T1/T2 {fit.rmse['T1']:.3f}/{fit.rmse['T2']:.3f} K")
    row("  free run on heater 1 alone", seconds,
        f"T1/T2 {fit.validation_rmse['T1']:.3f}/{fit.validation_rmse['T2']:.3f} K; aim 1.0/0.6 K")
    print("\nRMSE of T1 [K]: what a model of one day is worth on another")
    print(two_state.cross(fits, runs).round(2).to_string())


if __name__ == "__main__":
    main()
