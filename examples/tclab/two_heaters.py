"""Fit convection, heater coupling and sensor lag to the random two-heater run; free-run it on heater 1 alone.

    python examples/tclab/two_heaters.py [FOLDER]

FOLDER holds ``tclab_saopaulo`` (default: ``../shared/data`` beside the checkout).

Room temperature was not recorded. T2 rests at the same converter step at the start of both runs, so one room stands for
both: the mean of its readings over the first 15 s (one sensor lag) of the two runs, which the flicker of the converter
makes finer than its step of 0.49 K. Windows of 10 to 20 s pass both limits; with 30 s T2 is at 0.600 K.

The heater-1 run is not fitted, but it is no blind test either: several variants were compared on it. They are in
docs/explanations/calibration.md.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterable
from pathlib import Path

import numpy as np

import robthermal as rt

DEFAULT = Path(__file__).resolve().parents[3] / "shared" / "data"
TRAINING, HEATER_1 = "random_both_heaters_run_01.csv", "random_heater1_run_01.csv"


def read_run(folder: Path, file: str) -> rt.Record:
    """One run with a 9 s running median, which removes the single-sample glitches."""
    with warnings.catch_warnings():  # the notes of the record say the same
        warnings.simplefilter("ignore")
        return rt.read_record(folder / "tclab_saopaulo" / file, rt.systems.tclab(), median_filter=9.0)


def rest_value(records: Iterable[rt.Record], seconds: float = 15.0) -> float:
    """Mean of the cooler sensor's first readings [K], which stands for the room."""
    return float(np.concatenate([record["T2"][record.time < record.time[0] + seconds] for record in records]).mean())


def board(room: float) -> rt.System:
    """Convection, coupling and lag without radiation; m c_p = 2 J/K stays fixed."""
    system = rt.systems.tclab()
    links = [link.model_dump(exclude={"radiation"}, exclude_none=True) for link in system.links]
    data = {**system.model_dump(exclude_none=True), "links": links}
    return rt.System(**data).with_parameters({"ambients.room.temperature": room})


def fit(training: rt.Record, validation: rt.Record) -> rt.calibration.Fit:
    """Fit on one run, free-run on the other."""
    return rt.calibrate(board(rest_value([training, validation])), training, loss="soft_l1", validation=validation)


def main(folder: Path) -> None:
    """Print the fit."""
    print(fit(read_run(folder, TRAINING), read_run(folder, HEATER_1)))


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else DEFAULT)
