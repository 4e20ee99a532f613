"""Two heaters on one board: start from convection only, let the diagnosis find what is missing, predict another day.

    python examples/diagnosis/two_heaters.py [FOLDER [OUT]]

FOLDER holds ``tclab_saopaulo`` (default: ``../shared/data`` beside the checkout). Without it the same work is done on
simulated runs, and the output says so. OUT, a folder, gets what the work leaves behind: augmented.toml, the model with
the missing effects, and gap.svg, both models beside the day that no fit has seen.

What the user has to know, and states here: the noise of one reading, the random heat that draughts bring (DRAUGHT), and
which part of the record is a fair test. How the numbers were found, and how far the workflow gets without them:
docs/explanations/diagnosis_real.md.
"""

from __future__ import annotations

import sys
import warnings
from pathlib import Path

import numpy as np
from scipy.ndimage import median_filter, uniform_filter1d

import robthermal as rt

DEFAULT = Path(__file__).resolve().parents[3] / "shared" / "data"
TRAINING, REPEATED = "random_both_heaters_run_01.csv", "random_both_heaters_run_02.csv"
HEATER_1, STEPS = "random_heater1_run_01.csv", "step_heater1_{:03}.csv"
SAMPLE = 5.0  # s; the inputs of the random runs change every 35 s
GLITCH = 3.0  # K from the running median
STEP = 0.489  # K, of the converter: all the noise that a running median leaves
NOISE = {"T1": 0.2, "T2": 0.38}  # K, of a mean over 5 s: third differences of the record show 0.19 and 0.39
DRAUGHT = 0.1  # W/√Hz, random heat into each heater; its level is re-estimated within a factor 1.4
WINDOW = (700.0, 3500.0)  # s: before it both heaters are constant, after it the board has warmed up
_DRAWN = 20  # samples from point to point of the picture
EFFECTS = ("missing_link", "missing_ambient_link", "sensor_lag", "input_lag", "hidden_mass", "natural_convection",
           "radiation", "heater_power_slope", "heat_source", "input_saturation")


def nominal(room: float) -> rt.System:
    """Each heater loses heat to the room by convection, and that is all; m c_p = 2 J/K stays fixed."""
    heaters = {"heater_1": ("Q1", 0.0123, "T1"), "heater_2": ("Q2", 0.0062, "T2")}
    ranges = {f"links.{name}-room.conductance": {"lower": 1e-4, "upper": 0.05} for name in heaters}
    ranges |= {f"inputs.{q}.gain": {"lower": 1e-3, "upper": 0.1} for q, _, _ in heaters.values()}
    return rt.System(
        name="board with two heaters, convection only", temperature_unit="degC",
        ambients={"room": {"temperature": room}},
        lumps={name: {"capacity": 2.0, "disturbance": DRAUGHT} for name in heaters},
        links=[{"between": (name, "room"), "conductance": 8e-3} for name in heaters],
        inputs={q: {"lump": name, "gain": gain, "limits": (0.0, 100.0)} for name, (q, gain, _) in heaters.items()},
        sensors={sensor: {"lump": name, "noise": NOISE[sensor]} for name, (_, _, sensor) in heaters.items()},
        fit=ranges)


def read_run(folder: Path, file: str) -> rt.Record:
    """One run as it was recorded; the steps have a doubled time stamp every 10 s, which ``jitter=1.0`` allows."""
    with warnings.catch_warnings():  # the notes of the record say the same
        warnings.simplefilter("ignore")
        return rt.read_record(folder / "tclab_saopaulo" / file, nominal(295.0), jitter=1.0)


def means(run: rt.Record) -> rt.Record:
    """Every 5 s the mean of the readings around it, without glitches.

    The converter's step is 0.49 K and the sensors' own noise is larger, so the mean of some readings is finer than the
    step, and the noise of neighboring means is independent, as the tests assume. A running median is neither.
    """
    every = round(SAMPLE / run.sample_time)
    smooth = median_filter(run.outputs, (9, 1), mode="nearest")
    clean = np.where(np.abs(run.outputs - smooth) > GLITCH, smooth, run.outputs)
    readings = uniform_filter1d(clean, every, axis=0, mode="nearest")
    return rt.Record(sample_time=SAMPLE, inputs=run.inputs[::every], outputs=readings[::every],
                     input_names=run.input_names, output_names=run.output_names, name=run.name)


def without_glitches(run: rt.Record) -> rt.Record:
    """The 9 s running median of the readings."""
    return run.with_outputs(median_filter(run.outputs, (round(9.0 / run.sample_time) | 1, 1), mode="nearest"))


def rest_value(run: rt.Record, seconds: float = 15.0) -> float:
    """Mean of the cooler sensor's first readings [K], which stands for the room."""
    return float(without_glitches(run)["T2"][run.time < run.time[0] + seconds].mean())


def simulated(seed: int, *, second: bool = True, seconds: int = 3500) -> rt.Record:
    """A run of a board with coupling, lag and radiation, in steps of 35 s, read with noise; heater 2 off if asked."""
    rng = np.random.default_rng(seed)
    n = seconds // 35
    levels = np.column_stack([rng.uniform(10.0, 87.0, n), rng.uniform(17.0, 84.0, n) if second else np.zeros(n)])
    levels[:20] = [50.0, 50.0 if second else 0.0]
    drive = rt.Record(sample_time=1.0, inputs=np.repeat(levels, 35, axis=0), outputs=np.zeros((35 * n, 0)),
                      input_names=["Q1", "Q2"], output_names=[])
    run = rt.thermal.simulate(rt.systems.tclab(), drive)
    noise = np.array([0.42, 0.85]) * rng.standard_normal(run.outputs.shape)
    return run.with_outputs(run.outputs + noise)


def runs(folder: Path) -> tuple[rt.Record, rt.Record]:
    """Training run on both heaters and the run on heater 1 alone: measured if the folder is there, else simulated."""
    if (folder / "tclab_saopaulo").is_dir():
        return read_run(folder, TRAINING), read_run(folder, HEATER_1)
    print("SIMULATED: there is no folder tclab_saopaulo in", folder)
    return simulated(1), simulated(2, second=False)


def diagnose(training: rt.Record, validation: rt.Record, effects: tuple[str, ...] = EFFECTS) -> rt.diagnosis.Diagnosis:
    """Diagnose the window of the training run, with the run on heater 1 alone held out."""
    room = float(np.mean([rest_value(training), rest_value(validation)]))
    return rt.diagnose(nominal(room), means(training).between(*WINDOW), validation=means(validation), effects=effects)


def calibrated(system: rt.System, training: rt.Record, validation: rt.Record) -> rt.calibration.Fit:
    """Every conductance, gain and lag of a system, fitted to the whole training run by its free run.

    The diagnosis weighs short times more, because draughts are random; a model for free runs is fitted to a free run.
    """
    names = [*(f"links.{link.name}.conductance" for link in system.links), "inputs.Q1.gain", "inputs.Q2.gain",
             *(f"sensors.{name}.time_constant" for name, sensor in system.sensors.items() if sensor.time_constant)]
    ranges = {name: (0.2 * system.parameter(name), 5.0 * system.parameter(name)) for name in names}
    return rt.calibrate(system, without_glitches(training), parameters=ranges, loss="soft_l1",
                        noise=STEP / 12**0.5, validation=without_glitches(validation))


def picture(before: rt.calibration.Fit, after: rt.calibration.Fit) -> str:
    """Readings of the run that no fit has seen, with what both models make of it; SVG."""
    from matplotlib import pyplot as plt  # heavy, only when a picture is wanted

    (run,) = after.validation_data
    names = list(after.validation_residuals[0])
    with rt.report.house_style():
        figure, axes = plt.subplots(len(names), 1, figsize=(7.0, 5.0), sharex=True, layout="constrained")
        for ax, name in zip(axes, names, strict=True):
            ax.plot(run.time[::_DRAWN], (run[name] - 273.15)[::_DRAWN], color="0.6", label="measured, another day")
            for fit, style, what in ((before, "--", "convection only"), (after, "-", "with the three effects")):
                error = float(fit.validation_rmse[name])
                modelled = run[name] - fit.validation_residuals[0][name] - 273.15
                ax.plot(run.time[::_DRAWN], modelled[::_DRAWN], style,
                        label=f"{what}: {error:.2f} K")
            ax.set(ylabel=f"{name} [°C]")
            ax.legend(fontsize="small", loc="lower right")
        axes[-1].set(xlabel="time [s]")
    return rt.report.Figure.draw(figure, alt="Readings of both sensors on an unseen day, and two models.",
                                 caption="Heater 1 alone.").svg


def main(folder: Path, out: Path | None = None) -> None:
    """Print the diagnosis and what it is worth on the run it has not seen; write model and picture if asked."""
    training, validation = runs(folder)
    found = diagnose(training, validation)
    print(found)
    print("alternatives:", found.alternatives)
    print("\nfree-run RMSE of T1/T2 [K]     training run    heater 1 alone")
    fits = []
    for what, system in (("convection only", found.nominal.system), ("with the effects", found.fit.system)):
        fit = calibrated(system, training, validation)
        fits.append(fit)
        scores = (f"{rmse['T1']:.2f}/{rmse['T2']:.2f}" for rmse in (fit.rmse, fit.validation_rmse))
        print(f"{what:<29} {next(scores):>13} {next(scores):>17}")
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        system = fits[1].system.model_copy(update={"name": "board with two heaters, coupled, with late sensors"})
        rt.thermal.write_system(system, out / "augmented.toml")
        (out / "gap.svg").write_text(picture(*fits) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else DEFAULT, Path(sys.argv[2]) if len(sys.argv) > 2 else None)
