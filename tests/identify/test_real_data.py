"""Two measured runs of one desk-top heater pair must agree within their own uncertainty."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import robthermal as rt


@pytest.mark.parametrize("method", ["lpm", "lrmp", "auto"])
@pytest.mark.filterwarnings("ignore::UserWarning")  # what read_record has to say about jitter
def test_two_runs_of_the_same_plant_agree(shared: Path, method: str) -> None:
    estimates = []
    for run in ("01", "02"):
        path = shared / "data" / "tclab_saopaulo" / f"random_both_heaters_run_{run}.csv"
        record = rt.read_record(path, inputs=["Q1", "Q2"], outputs=["T1", "T2"], temperature_unit="degC")[:7000]
        if method == "lpm":
            estimates.append(rt.identify.lpm(record))
        else:
            poles = "auto" if method == "auto" else [-1 / 180, -1 / 20]
            estimates.append(rt.identify.lrmp(record, poles=poles))
    a, b = estimates
    # The sum of two estimates' variances, with the 95 % factor of the F distribution of one.
    limit = np.hypot(a.confidence_radius(0.95), b.confidence_radius(0.95))
    inside = (np.abs(a.response - b.response) < limit).mean(axis=-1)
    assert (inside > 0.93).all() and (inside < 0.995).all()
    # A heater warms its own sensor more than the other one, K per percent of power.
    low = np.abs(a.response[..., :5]).mean(axis=-1)
    assert low[0, 0] > 2 * low[0, 1] and low[1, 1] > low[1, 0] > 0.05
