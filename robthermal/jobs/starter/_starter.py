"""A project to start from: commented files, and records to replace."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

import numpy as np

from ...errors import InputError
from ...signals import Record, staircase
from ...thermal import System, read_system, simulate
from ..folder import output_folder

_TRUTH = {"links.sink-room.conductance": 0.92, "links.stage-room.conductance": 0.05,
          "modules.m1.conductance.value": 0.31}  # of the machine the records come from; the file says something else
_CURRENTS = {"train": (0.0, 0.8, 0.3, 1.1, 0.0, -0.3), "validation": (0.5, 1.0, 0.1)}
_HEATS = {"train": (0.0, 0.0, 1.5, 0.5, 1.0, 0.0), "validation": (0.0, 1.2, 0.4)}
_SAMPLE, _HOLD = 5.0, 300.0  # s
_FILES = ("project.toml", "setup.toml")


def new_project(folder: str | Path) -> Path:
    """Write a commented project that `run_job` accepts as it is, with simulated records to replace.

    Parameters
    ----------
    folder : str or Path
        Must not exist, or be empty.

    Returns
    -------
    Path
        The project file.

    Raises
    ------
    InputError
        There is something already, or the place cannot be written.

    Examples
    --------
    >>> from pathlib import Path
    >>> import robthermal as rt
    >>> project = rt.jobs.read_project(rt.jobs.new_project("bench"))
    >>> project.name, sorted(path.name for path in Path("bench").iterdir())
    ('Cooled stage', ['project.toml', 'setup.toml', 'train.csv', 'validation.csv'])
    """
    target = Path(folder)
    if target.exists() and (not target.is_dir() or any(target.iterdir())):
        raise InputError("is there already", where=str(target), expected="a new folder, or an empty one",
                         remedy="Choose another name: nothing is overwritten.")
    with output_folder(target) as partial:
        for name in _FILES:
            text = (files(__package__) / name).read_text(encoding="utf-8")
            (partial / name).write_text(text, encoding="utf-8", newline="\n")
        system = read_system(partial / "setup.toml")
        for seed, kind in enumerate(_CURRENTS):
            _record(system, kind, seed).save(partial / f"{kind}.csv", temperature_unit="degC",
                                             temperatures=["room", *system.sensors])
    return target / "project.toml"


def _record(system: System, kind: str, seed: int) -> Record:
    """Simulated with other conductances than those of the file, and with noise."""
    current, heat = (staircase(list(levels[kind]), _HOLD, sample_time=_SAMPLE) for levels in (_CURRENTS, _HEATS))
    inputs = np.column_stack([current, heat, np.full(len(current), system.ambients["room"].temperature)])
    drive = Record(sample_time=_SAMPLE, inputs=inputs, outputs=np.zeros((len(current), 0)),
                   input_names=["m1", "heater", "room"], output_names=[])
    clean = simulate(system.with_parameters(_TRUTH), drive)
    noise = np.random.default_rng(seed).normal(0.0, 0.01, clean.outputs.shape)
    return clean.with_outputs(clean.outputs + noise)
