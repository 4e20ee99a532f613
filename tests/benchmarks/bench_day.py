"""What a day of one machine at 1 Hz costs: the rates of the fleet on paper (docs/more_machines.md). About two minutes.

The two-module system, 18 lumps, four of its sensors with 20 mK of noise, currents that change every minute. Processor
time. A diagnosis takes a day thinned to a sample every 60 s.
"""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np  # noqa: E402  (after the thread count is set)
from _timing import header, row  # noqa: E402

import robthermal as rt  # noqa: E402

DAY, MINUTE, DAYS, SENSORS = 86_400, 60, 365_000, 4
Result = TypeVar("Result")


def timed(what: str, run: Callable[[], Result]) -> Result:
    """Print the processor time of one call, and of the fleet."""
    start = time.process_time()
    result = run()
    seconds = time.process_time() - start
    row(what, seconds, f"{seconds * DAYS / 3600:.0f} h for {DAYS} days")
    return result


def noisy(run: rt.Record, seed: int, every: int) -> rt.Record:
    """The first sensors of a simulated day as they are read, a sample every `every` seconds."""
    readings = run.outputs[::every, :SENSORS]
    readings = readings + 0.02 * np.random.default_rng(seed).standard_normal(readings.shape)
    return rt.Record(sample_time=float(every), inputs=run.inputs[::every], outputs=readings,
                     input_names=run.input_names, output_names=run.output_names[:SENSORS])


def main() -> None:
    """Print a row per step."""
    header(f"a day at 1 Hz, load {os.getloadavg()[0]:.1f}")
    system = rt.systems.two_module()
    currents = 0.3 * np.random.default_rng(0).standard_normal((DAY // MINUTE, 2)).repeat(MINUTE, axis=0)
    asked = rt.Record(sample_time=1.0, inputs=currents, outputs=np.zeros((DAY, 0)), input_names=list(system.modules),
                      output_names=[])
    run = timed("simulate, 18 lumps", lambda: rt.thermal.simulate(system, asked))
    record, minutes = noisy(run, 1, 1), [noisy(run, seed, MINUTE) for seed in range(5)]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "day.csv"
        np.savetxt(file, np.column_stack([np.arange(DAY), record.inputs, record.outputs - 273.15]), "%.6f", ",",
                   header=",".join(["time", *record.input_names, *record.output_names]), comments="")
        size = file.stat().st_size / 1e6
        rt.read_record(file, system)  # the imports
        timed(f"read a CSV file of {size:.1f} MB", lambda: rt.read_record(file, system))
    timed("frequency responses, two inputs, four outputs", lambda: rt.identify.lpm(record))
    free = {name: (0.3 * system.parameters[name], 3.0 * system.parameters[name])
            for name in ("links.x1-x3.conductance", "lumps.x1.capacity")}
    timed("calibrate two parameters, thinned", lambda: rt.calibrate(system, minutes[0], parameters=free))
    timed("diagnose, thinned", lambda: rt.diagnose(system, minutes[0]))
    timed("what changed since four days, thinned", lambda: rt.diagnose(system, minutes[0], reference=minutes[1:]))


if __name__ == "__main__":
    main()
