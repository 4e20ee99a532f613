"""Fit the two-state model of a Temperature Control Lab board to each run, then run each model on the other days.

    python examples/tclab/two_state.py [FOLDER]

FOLDER holds ``tclab_dowling`` (default: ``../shared/data`` beside the checkout).
"""

from __future__ import annotations

import sys
import warnings
from pathlib import Path

import numpy as np
import pandas as pd

import robthermal as rt

DEFAULT = Path(__file__).resolve().parents[3] / "shared" / "data"
RUNS = {"5-min sine": "sine_5min_run_2.csv", "step": "step_50_run_2.csv", "50-min sine": "sine_50min_run_2.csv"}
ROOM = "ambients.room.temperature"
FIRST_BOARD = rt.systems.tclab_two_state()


def read_runs(folder: Path) -> dict[str, rt.Record]:
    """The three runs; one of them lacks two single samples, which ``jitter=1.0`` fills."""
    with warnings.catch_warnings():  # the notes of the records say the same
        warnings.simplefilter("ignore")
        return {name: rt.read_record(folder / "tclab_dowling" / file, FIRST_BOARD, jitter=1.0)
                for name, file in RUNS.items()}


def published(record: rt.Record) -> float:
    """RMSE [K] of the published parameters in a free run; room and start are the first reading, nothing is fitted."""
    first = float(record["T1"][0])
    run = rt.thermal.simulate(FIRST_BOARD.with_parameters({ROOM: first}), record, initial=first)
    return float(np.sqrt(np.mean((run["T1"] - record["T1"]) ** 2)))


def fit(record: rt.Record) -> rt.calibration.Fit:
    """Four thermal parameters and the room, start temperatures free."""
    return rt.calibrate(FIRST_BOARD, record)


def cross(fits: dict[str, rt.calibration.Fit], runs: dict[str, rt.Record]) -> pd.DataFrame:
    """RMSE of T1 [K]: rows are the run a model was fitted to, columns the run it is asked to predict.

    "as is": everything carried over, the start from the first tenth. "room adapted": the room temperature of the other
    day is fitted to the whole of that run, the four thermal parameters are carried over; so it is not a prediction.
    """
    rows = {}
    for name, one in fits.items():
        for other, record in runs.items():
            if other == name:
                rows[name, other] = (one.rmse["T1"], one.rmse["T1"])
                continue
            adapted = rt.calibrate(one.system, record, parameters=[ROOM])
            carried = rt.calibrate(FIRST_BOARD, runs[name], validation=record)
            rows[name, other] = (carried.validation_rmse["T1"], adapted.rmse["T1"])
    index = pd.MultiIndex.from_tuples(rows, names=["fitted to", "run on"])
    return pd.DataFrame(list(rows.values()), index=index, columns=["as is", "room adapted"])


def main(folder: Path) -> None:
    """Print everything."""
    runs = read_runs(folder)
    fits = {name: fit(record) for name, record in runs.items()}
    for name, one in fits.items():
        print(f"\n{name}: published parameters {published(runs[name]):.2f} K, fitted {one.rmse['T1']:.3f} K\n{one}")
    print("\nRMSE of T1 [K]")
    print(cross(fits, runs).round(2).to_string())


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else DEFAULT)
