"""One heater on one board: take the sensor's mass out of the published two-state model, and let the diagnosis find it.

    python examples/diagnosis/second_mass.py [FOLDER]

FOLDER holds ``tclab_dowling`` (default: ``../shared/data`` beside the checkout). Without it the same work is done on a
simulated run, and the output says so.
"""

from __future__ import annotations

import sys
import warnings
from pathlib import Path

import numpy as np
from scipy.ndimage import uniform_filter1d

import robthermal as rt

DEFAULT = Path(__file__).resolve().parents[3] / "shared" / "data"
STEP, SINE = "step_50_run_2.csv", "sine_5min_run_2.csv"
PUBLISHED = rt.systems.tclab_two_state()
SAMPLES = 3  # one reading every 3 s, the mean of 3: finer than the converter's step of 0.322 K, with independent noise
NOISE, DRAUGHT = 0.08, 0.15  # K, of such a mean; W/√Hz of random heat
EFFECTS = ("sensor_lag", "hidden_mass", "input_lag", "missing_ambient_link", "natural_convection", "radiation",
           "heater_power_slope")


def published_lag() -> float:
    """Time constant of the published sensor mass behind its conductance [s]."""
    link = next(link for link in PUBLISHED.links if set(link.between) == {"heater", "sensor"})
    return PUBLISHED.lumps["sensor"].capacity / link.conductance


def nominal(room: float) -> rt.System:
    """One mass, which the sensor reads at once; the room was not recorded, so it is fitted about the first reading."""
    return rt.System(
        name="heater as one mass", temperature_unit="degC", ambients={"room": {"temperature": room}},
        lumps={"heater": {"capacity": 6.2, "disturbance": DRAUGHT}},
        links=[{"between": ("heater", "room"), "conductance": 0.0417}],
        inputs={"Q1": {"lump": "heater", "gain": 0.032, "limits": (0.0, 100.0)}},
        sensors={"T1": {"lump": "heater", "noise": NOISE}},
        fit={"ambients.room.temperature": {"lower": 283.0, "upper": 313.0, "sigma": 1.0},
             "lumps.heater.capacity": {"lower": 0.5, "upper": 30.0},
             "links.heater-room.conductance": {"lower": 0.005, "upper": 0.5}})


def means(run: rt.Record) -> rt.Record:
    """Every 3 s the mean of the three readings around it."""
    readings = uniform_filter1d(run.outputs, SAMPLES, axis=0, mode="nearest")
    return rt.Record(sample_time=SAMPLES * run.sample_time, inputs=run.inputs[::SAMPLES], outputs=readings[::SAMPLES],
                     input_names=run.input_names, output_names=run.output_names, name=run.name)


def simulated(seed: int = 1) -> rt.Record:
    """The step, of the published model, with noise and the converter's step."""
    drive = rt.Record(sample_time=1.0, inputs=np.full((900, 1), 50.0), outputs=np.zeros((900, 0)), input_names=["Q1"],
                      output_names=[])
    run = rt.thermal.simulate(PUBLISHED, drive)
    noisy = run.outputs + 0.15 * np.random.default_rng(seed).standard_normal(run.outputs.shape)
    return run.with_outputs(0.322 * np.round(noisy / 0.322))


def read_run(folder: Path, file: str = STEP) -> rt.Record:
    """One measured run, or a simulated step where the folder is absent."""
    if not (folder / "tclab_dowling").is_dir():
        print("SIMULATED: there is no folder tclab_dowling in", folder)
        return simulated()
    with warnings.catch_warnings():  # the notes of the record say the same
        warnings.simplefilter("ignore")
        return rt.read_record(folder / "tclab_dowling" / file, PUBLISHED, jitter=1.0)


def diagnose(run: rt.Record, effects: tuple[str, ...] = EFFECTS) -> rt.diagnosis.Diagnosis:
    """Diagnose one run."""
    return rt.diagnose(nominal(float(run["T1"][:3].mean())), means(run), effects=effects)


def main(folder: Path) -> None:
    """Print the diagnosis, beside the time constant that was taken out."""
    found = diagnose(read_run(folder))
    print(found)
    print("alternatives:", found.alternatives)
    print(f"taken out: a sensor mass with a time constant of {published_lag():.1f} s")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else DEFAULT)
