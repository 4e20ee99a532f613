"""Diagnosis on measured data: what is found, the gap before and after, and time. Needs ../shared/data."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import numpy as np
from _timing import best_of, header, row

import robthermal as rt

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT.parent / "shared" / "data"


def example(name: str) -> ModuleType:
    """Load examples/diagnosis/NAME.py."""
    spec = importlib.util.spec_from_file_location(f"example_{name}", ROOT / "examples" / "diagnosis" / f"{name}.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def one_line(found: rt.diagnosis.Diagnosis) -> str:
    """Verdict, the accepted effects with what the records cannot exclude, and the error on the held-out run."""
    gap = found.gap.get("validation")
    held = "" if gap is None else f"; held out {gap.before:.1f} K before, {gap.after:.1f} K after"
    if not found.effects:
        tried = ", ".join(effect.label for effect in found.provisional) or "nothing"
        return f"{found.verdict}; provisional: {tried}{held}"
    names = [" | ".join([effect.label, *(f"{name}({', '.join(where)})" for name, where in others)])
             for effect, others in zip(found.effects, found.alternatives, strict=True)]
    return f"{found.verdict}: {'; '.join(names)}{held}"


def free_runs(board: ModuleType, system: rt.System, training: rt.Record, validation: rt.Record) -> str:
    """Free-run RMSE after a fit to the free training run [K], T1/T2 on both runs."""
    fit = board.calibrated(system, training, validation)
    train, other = fit.rmse, fit.validation_rmse
    return f"train {train['T1']:.2f}/{train['T2']:.2f} K, heater 1 alone {other['T1']:.2f}/{other['T2']:.2f} K"


def two_heaters() -> None:
    """The São Paulo board: window of the example, whole catalog, whole record, no random heat, and the steps."""
    board = example("two_heaters")
    training, validation = board.runs(DATA)
    seconds, found = best_of(lambda: board.diagnose(training, validation), repeats=1)
    row("two heaters, window 700 to 3500 s, 10 effects", seconds, one_line(found))
    row("  convection only", 0.0, free_runs(board, found.nominal.system, training, validation))
    row("  with the effects", 0.0, free_runs(board, found.fit.system, training, validation))
    scores = rt.diagnosis.score(found.fit, ["radiation", "heater_power_slope"])
    at = [candidate.label for candidate in scores.candidates]
    i, j = at.index("radiation(heater_1, room)"), at.index("heater_power_slope(Q1)")
    row("  radiation and power slope of heater 1", 0.0,
        f"cosine {scores.confusion[i, j]:.3f}; p {scores.p_value[i]:.2g} and {scores.p_value[j]:.2g}; "
        f"radiation {scores.size[i]:.2g}, limit {scores.limit[i]:.2g} W/K⁴")
    room = float(np.mean([board.rest_value(training), board.rest_value(validation)]))
    train, other = board.means(training), board.means(validation)
    window = train.between(*board.WINDOW)
    seconds, found = best_of(lambda: rt.diagnose(board.nominal(room), window, validation=other), repeats=1)
    row("  the same window, whole catalog", seconds, one_line(found))
    again = board.read_run(DATA, board.REPEATED)
    seconds, found = best_of(lambda: board.diagnose(again, validation), repeats=1)
    row("  the same inputs on another day, 10 effects", seconds, one_line(found))
    both = [window, board.means(again).between(*board.WINDOW)]
    for what, gains in (("", {}), (", a gain of every heater in every run", {"session_gain": True})):
        seconds, found = best_of(lambda gains=gains: rt.diagnose(board.nominal(room), both, validation=other,
                                                                 effects=board.EFFECTS, **gains), repeats=1)
        row(f"  both days, 10 effects{what}", seconds, one_line(found))
    seconds, found = best_of(lambda: rt.diagnose(board.nominal(room), train, validation=other, effects=board.EFFECTS),
                             repeats=1)
    row("  the whole training run, 10 effects", seconds, one_line(found))
    quiet = board.nominal(room).with_parameters({f"lumps.heater_{i}.disturbance": 0.0 for i in (1, 2)})
    seconds, found = best_of(lambda: rt.diagnose(quiet, window, validation=other, effects=board.EFFECTS), repeats=1)
    row("  the window, no random heat declared", seconds, one_line(found))


def second_mass() -> None:
    """The Dowling board: the sensor's mass taken out of the published model."""
    board = example("second_mass")
    for name, file in (("step", board.STEP), ("5-min sine", board.SINE)):
        run = board.read_run(DATA, file)
        seconds, found = best_of(lambda run=run: board.diagnose(run), repeats=1)
        size = (found.effects or found.provisional)[0].values["time_constant"]
        row(f"second mass, {name}, 7 effects", seconds, one_line(found))
        row("  time constant", 0.0, f"{size[0]:.1f} ± {size[1]:.1f} s; taken out: {board.published_lag():.1f} s; "
            f"free run {found.gap['train'].before:.2f} K before, {found.gap['train'].after:.2f} K after")


def main() -> None:
    """Print everything."""
    header("Diagnosis of measured data")
    if not DATA.is_dir():
        print("skipped: no folder ../shared/data beside the checkout")
        return
    two_heaters()
    second_mass()


if __name__ == "__main__":
    main()
