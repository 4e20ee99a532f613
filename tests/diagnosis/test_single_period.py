"""Something that cycles faster than periodic heats are tried: its period is said, and no lump is to be split for it."""

from __future__ import annotations

import numpy as np
import pytest

import robthermal as rt

N, PERIOD = 1500, 24.0
BED = {"ambients": {"room": {"temperature": 295.0}}, "lumps": {"bed": {"capacity": 100.0}},
       "links": [{"between": ("bed", "room"), "conductance": 2.0}], "inputs": {"heater": {"lump": "bed"}},
       "sensors": {"T": {"lump": "bed", "noise": 0.01}}}


def record(cycling: np.ndarray, recorded: bool) -> rt.Record:
    """A bed with a heater in steps and an extra heat [W], held over every second, which may be recorded."""
    rng, n = np.random.default_rng(3), len(cycling)
    heater, x, y = np.repeat(rng.uniform(0.0, 40.0, n // 100), 100), 0.0, np.zeros(n)
    decay = np.exp(-2.0 / 100.0)
    for k in range(n):
        y[k] = 295.0 + x + 0.01 * rng.standard_normal()
        x = decay * x + (1.0 - decay) / 2.0 * (heater[k] + cycling[k])
    known = heater + cycling * (1.2 if recorded else 0.0)  # recorded with a wrong gain
    return rt.Record(sample_time=1.0, inputs=known, outputs=y, input_names=["heater"], output_names=["T"])


def found(recorded: bool) -> rt.Diagnosis:
    cycling = 10.0 * np.sin(2.0 * np.pi * np.arange(N) / PERIOD)
    return rt.diagnose(rt.System(**BED), record(cycling, recorded), effects=["sensor_lag", "periodic_load"])


def test_the_period_is_said_and_no_lump_is_to_be_split() -> None:
    answer = found(recorded=False)
    assert answer.verdict == "unexplained" and answer.remainder is not None and answer.remainder.line is not None
    assert answer.remainder.line.period == pytest.approx(PERIOD, rel=0.01)
    text = answer.outcome.text
    assert "has a single period, 24 s, which no recorded input has" in text and "split in two" not in text
    assert answer.remainder.to_dict()["line"]["sensor"] == "T"


def test_a_period_of_an_input_is_not_said() -> None:
    answer = found(recorded=True)
    assert answer.remainder is None or answer.remainder.line is None


@pytest.mark.parametrize("n", [2400, 9600])
def test_a_period_is_tried_in_a_long_record_as_in_a_short_one(n: int) -> None:
    """A hundred and twenty samples: 20 cycles, and 80, which were beyond the 30 that were tried in any record."""
    cycling = 2.0 * np.sin(2.0 * np.pi * np.arange(n) / 120.0)
    answer = rt.diagnose(rt.System(**BED), record(cycling, False), effects=["sensor_lag", "periodic_load"])
    assert [one.label for one in answer.effects] == ["periodic_load(bed)"]
    assert answer.alternatives == ((("ambient_drift", ("room",)),),)  # nobody recorded it, and it is joined to one lump
    values = answer.effects[0].values
    assert values["period"][0] == pytest.approx(120.0, rel=1e-3) and values["heat"][0] == pytest.approx(2.0, rel=0.02)
