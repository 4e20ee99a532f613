"""Fit convection, heater coupling and sensor lag to the random two-heater run; free-run it on heater 1 alone.

    python examples/tclab/two_heaters.py [FOLDER]

FOLDER holds ``tclab_saopaulo`` (default: ``../shared/data`` beside the checkout).

Room temperature was not recorded: the rest value of T2 in the training run stands for it. T1 reads more than a kelvin
above T2 at rest, so its offset is free. Between eight variants (radiation fixed or none, offset free or none, loss
linear or soft_l1) this one has the least mean RMSE in free runs on the second two-heater run and the three steps. The
heater-1 run is not in that score, but it is not untouched either: other variants had been tried on it before.
"""

from __future__ import annotations

import sys
import warnings
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


def board(record: rt.Record) -> rt.System:
    """Convection, coupling and lag without radiation; m c_p = 2 J/K stays fixed, the room is the rest value of T2."""
    system = rt.systems.tclab()
    links = [link.model_dump(exclude={"radiation"}, exclude_none=True) for link in system.links]
    data = {**system.model_dump(exclude_none=True), "links": links}
    return rt.System(**data).with_parameters({"ambients.room.temperature": float(np.median(record["T2"][:15]))})


def fit(training: rt.Record, validation: rt.Record) -> rt.calibration.Fit:
    """Fit on one run, free-run on the other."""
    system = board(training)
    ranges = {name: (limits.lower, limits.upper) for name, limits in system.fit.items()}
    return rt.calibrate(system, training, parameters={**ranges, "sensors.T1.offset": (-5.0, 5.0)}, loss="soft_l1",
                        validation=validation)


def main(folder: Path) -> None:
    """Print the fit."""
    print(fit(read_run(folder, TRAINING), read_run(folder, HEATER_1)))


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else DEFAULT)
