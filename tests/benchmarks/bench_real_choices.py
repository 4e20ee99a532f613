"""Diagnosis of measured boards over the choices a user makes: days, sampling, window, noise, starting model.

Run: python tests/benchmarks/bench_real_choices.py [--half development|judging|both] [--only TEXT].
Needs ../shared/data. A log is given as block means (declared as means, `b`), means about each stamp (`c`), or every
nth sample (`t`).
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from functools import cache

import numpy as np
from _timing import best_of, header, row
from bench_real_diagnosis import DATA, example, one_line
from scipy.ndimage import median_filter, uniform_filter1d

import robthermal as rt

BOARD = example("two_heaters")
DAYS = {"A": BOARD.TRAINING, "B": BOARD.REPEATED, "C": BOARD.HEATER_1} | {f"S{p}": BOARD.STEPS.format(p)
                                                                         for p in (20, 60, 100)}
GLITCH = 3.0  # K
Window = tuple[float, float] | None


@dataclass(frozen=True)
class Choice:
    """What one user does.

    Parameters
    ----------
    train, held_out : str
        Days, with a plus between; no day held out where empty.
    how : str
        Kind of log and its step [s].
    has : str
        What the starting model holds: path (p), lag of sensor 1 or 2, radiation (r).
    draught : float
        Declared random heat [W/√Hz].
    declared : bool
        Whether the noise is declared, or read off the records.
    window : tuple of float, optional
        Part of the training days [s].
    """

    train: str
    held_out: str
    how: str = "b5"
    has: str = ""
    draught: float = 0.0
    declared: bool = True
    window: Window = None

    def __str__(self) -> str:
        parts = [f"{self.train}/{self.held_out or '-'}", self.how, f"has {self.has or 'nothing'}",
                 f"draught {self.draught:g}", "noise declared" if self.declared else "noise read"]
        return ", ".join(parts + ([] if self.window is None else ["{:g} to {:g} s".format(*self.window)]))


DEVELOPMENT = [
    *(Choice(a, b, draught=d) for a, b in (("A", "C"), ("C", "A"), ("B", "S100"), ("A+S60", "C"), ("S20+S60+S100", "C"))
      for d in (0.0, 0.1)),
    Choice("A", "C", declared=False), Choice("A", "C", "t5", draught=0.1, declared=False),
    Choice("A", "C", "b10", draught=0.1, declared=False), Choice("A", "C", draught=0.1, window=(2000.0, 5000.0)),
    *(Choice(a, b, has="p12", draught=d) for a, b in (("A", "C"), ("C", "A"), ("B", "S60")) for d in (0.0, 0.1)),
    *(Choice("A", "C", has=has, draught=0.1) for has in ("p", "p1", "12", "p2"))]
JUDGING = [
    Choice("S60+S100", "A"), Choice("C+S60", "B", "b10", draught=0.1, declared=False),
    Choice("C", "B", "c5", declared=False), Choice("B", "S60", "t5", draught=0.05, declared=False),
    Choice("B", "C", draught=0.1, window=(3000.0, 6000.0)),
    Choice("B", "C", "c5", draught=0.05, window=(1500.0, 4500.0)),
    Choice("S100", "C", draught=0.1), Choice("C", ""), Choice("B", "", draught=0.1, window=(2000.0, 5000.0)),
    Choice("B", "C", has="p12", draught=0.1), Choice("C+S60", "B", "c5", has="p12"), Choice("B", "C", has="p1"),
    Choice("C", "A", has="1", draught=0.1)]


def system(has: str, draught: float, declared: bool) -> rt.System:
    """The board with what a starting model holds."""
    tables = BOARD.nominal(295.5).model_dump(exclude_unset=True)
    for lump in tables["lumps"].values():
        lump["disturbance"] = draught
    if "p" in has:
        tables["links"] = [*tables["links"], {"between": ("heater_1", "heater_2"), "conductance": 3.09e-3}]
        tables["fit"]["links.heater_1-heater_2.conductance"] = {"lower": 0.0, "upper": 0.05}
    for sensor in tables["sensors"]:
        if not declared:
            del tables["sensors"][sensor]["noise"]
        if sensor[1:] in has:
            tables["sensors"][sensor]["time_constant"] = 20.3
            tables["fit"][f"sensors.{sensor}.time_constant"] = {"lower": 0.1, "upper": 60.0}
    return rt.System(**tables)


@cache
def record(day: str, how: str) -> rt.Record:
    """One day as a kind of log."""
    run = BOARD.read_run(DATA, DAYS[day])
    n = round(float(how[1:]) / run.sample_time)
    if how[0] == "t":
        return run.changed(sample_time=n * run.sample_time, inputs=run.inputs[::n], outputs=run.outputs[::n])
    smooth = median_filter(run.outputs, (9, 1), mode="nearest")
    clean = np.where(np.abs(run.outputs - smooth) > GLITCH, smooth, run.outputs)
    if how[0] == "c":
        return run.changed(sample_time=n * run.sample_time, inputs=run.inputs[::n],
                           outputs=uniform_filter1d(clean, n, axis=0, mode="nearest")[::n])
    inputs, outputs = (a[:len(a) // n * n].reshape(-1, n, a.shape[1]).mean(axis=1) for a in (run.inputs, clean))
    return rt.signals.as_means(run.changed(sample_time=n * run.sample_time, inputs=inputs, outputs=outputs), "after")


def diagnosed(choice: Choice) -> rt.diagnosis.Diagnosis:
    """The answer that one user gets."""
    def of(days: str, window: Window) -> list[rt.Record]:
        runs = [record(day, choice.how) for day in days.split("+")]
        return runs if window is None else [run.between(run.start_time + window[0], run.start_time + window[1])
                                            for run in runs]

    return rt.diagnose(system(choice.has, choice.draught, choice.declared), of(choice.train, choice.window),
                       validation=of(choice.held_out, None) if choice.held_out else None)


def main() -> None:
    """Print a row per choice."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--half", choices=["development", "judging", "both"], default="judging")
    parser.add_argument("--only", default="", help="part of the rows to run")
    chosen = parser.parse_args()
    header("Diagnosis of measured boards over the choices of a user")
    if not DATA.is_dir():
        print("skipped: no folder ../shared/data beside the checkout")
        return
    halves = {"development": DEVELOPMENT, "judging": JUDGING, "both": DEVELOPMENT + JUDGING}
    for choice in halves[chosen.half]:
        if chosen.only in str(choice):
            seconds, found = best_of(lambda choice=choice: diagnosed(choice), repeats=1)
            row(str(choice), seconds, one_line(found))


if __name__ == "__main__":
    main()
