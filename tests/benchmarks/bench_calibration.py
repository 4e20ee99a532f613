"""Calibration on measured data: RMSE against the published parameters, and time. Needs ../shared/data."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

from _timing import best_of, header, row

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT.parent / "shared" / "data"


def example(name: str) -> ModuleType:
    """Load examples/tclab/NAME.py."""
    spec = importlib.util.spec_from_file_location(f"example_{name}", ROOT / "examples" / "tclab" / f"{name}.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def main() -> None:
    """Print one row per fit, then the cross-validation table."""
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
    unseen = two_heaters.read_run(DATA, two_heaters.HEATER_1)
    seconds, fit = best_of(lambda: two_heaters.fit(training, unseen), repeats=1)
    row("two heaters, random run", seconds, f"T1/T2 {fit.rmse['T1']:.3f}/{fit.rmse['T2']:.3f} K")
    row("  free run on heater 1 alone", seconds,
        f"T1/T2 {fit.validation_rmse['T1']:.3f}/{fit.validation_rmse['T2']:.3f} K; aim 1.0/0.6 K")
    print("\nRMSE of T1 [K]: what a model of one day is worth on another")
    print(two_state.cross(fits, runs).round(2).to_string())


if __name__ == "__main__":
    main()
