"""Simulate the records of the demo: a machine that differs from its model, noise, a drifting ambient.

Writes train.csv and validation.csv into the folder given as argument. The records that come with the package were made
by this script; they are SIMULATED, and the true parameters below are what the calibration should find.
"""

import sys
from pathlib import Path

import numpy as np

import robthermal as rt

TRUTH = {  # what differs from the nominal model
    "modules.m1.seebeck.value": 0.053743 * 1.04, "modules.m2.seebeck.value": 0.053743 * 1.04,
    "modules.m1.resistance.value": 4.6298 * 0.95, "modules.m2.resistance.value": 4.6298 * 0.97,
    "modules.m1.conductance.value": 0.2968 * 1.08, "modules.m2.conductance.value": 0.2968 * 1.08,
    "links.x1-room.conductance": 0.6942 * 0.88, "links.x2-room.conductance": 0.6942 * 0.88,
    "links.x14-x15.conductance": 0.1098 * 1.2,
}
NOISE = 0.01  # K
SAMPLE_TIME = 5.0  # s


def ambient(n: int, rng: np.random.Generator) -> np.ndarray:
    """Room temperature that drifts by about a kelvin [K]."""
    t = np.arange(n) * SAMPLE_TIME
    walk = np.cumsum(rng.normal(0, 0.01, n))
    return 298.15 + 0.6 * np.sin(2 * np.pi * t / 5400 + rng.uniform(0, 6)) + walk - walk[0]


def make(levels_1: list[float], levels_2: list[float], dwell: float, seed: int, name: str) -> rt.Record:
    """Simulate one experiment with staircase currents."""
    rng = np.random.default_rng(seed)
    truth = rt.systems.two_module().with_parameters(TRUTH)
    currents = np.column_stack([rt.signals.staircase(levels, dwell, sample_time=SAMPLE_TIME)
                                for levels in (levels_1, levels_2)])
    inputs = np.column_stack([currents, np.round(ambient(len(currents), rng), 3)])
    drive = rt.Record(sample_time=SAMPLE_TIME, inputs=inputs, outputs=np.zeros((len(inputs), 0)),
                      input_names=["m1", "m2", "room"], output_names=[])
    clean = rt.thermal.simulate(truth, drive)
    noisy = clean.outputs + rng.normal(0, NOISE, clean.outputs.shape)
    return rt.Record(sample_time=SAMPLE_TIME, inputs=inputs, outputs=np.round(noisy, 3), name=name,
                     input_names=clean.input_names, output_names=clean.output_names)


def main(folder: Path) -> None:
    """Write both records."""
    folder.mkdir(parents=True, exist_ok=True)
    train = make([0.0, 0.8, 0.3, 1.4, -0.4, 0.9, 0.2, 1.1], [0.0, 0.4, 1.1, 0.2, 1.3, -0.4, 0.7, 0.0],
                 900.0, 11, "train")
    validation = make([0.5, 0.9, 0.6, 1.0], [0.9, 0.5, 0.8, 0.4], 900.0, 12, "validation")
    for record in (train, validation):
        record.save(folder / f"{record.name}.csv", temperature_unit="degC",
                    temperatures=["room", *record.output_names])
        print(folder / f"{record.name}.csv", record.n_samples, "samples")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
