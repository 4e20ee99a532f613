"""The diagnosis job: records read, effects searched, residuals before and after for the report."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..calibration._data import as_data
from ..calibration._score import validate
from ..diagnosis import Diagnosis, Refit, diagnose
from ..errors import Diverged, InputError
from ..signals import Record
from ..thermal import System

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Residuals:
    """Free-run residuals of one record.

    Parameters
    ----------
    kind : str
        "train" or "validation".
    name : str
        Of the record.
    time : ndarray, shape (n,)
        Sample times [s].
    before, after : dict
        {sensor: measured − model (n,)} [K], nominal system refitted and with the effects; nan if the model runs away.
    """

    kind: str
    name: str
    time: Array
    before: dict[str, Array]
    after: dict[str, Array]


@dataclass(frozen=True, eq=False)
class Diagnosed:
    """A diagnosis with what its report draws.

    Parameters
    ----------
    diagnosis : Diagnosis
        What was found.
    residuals : tuple of Residuals
        One per record.
    files : tuple of Path
        System file and records.
    """

    diagnosis: Diagnosis
    residuals: tuple[Residuals, ...]
    files: tuple[Path, ...]

    @property
    def holds(self) -> bool:
        """Whether one set of effects, or none, explains the records."""
        return self.diagnosis.outcome.ok


def diagnose_records(system: System, files: tuple[Path, ...], train: Sequence[Record],
                     validation: Sequence[Record] = (), progress: Callable[[str], None] = lambda stage: None
                     ) -> Diagnosed:
    """Diagnose a system on records.

    Parameters
    ----------
    system : System
        Nominal.
    files : tuple of Path
        Input files, for their hashes.
    train, validation : sequence of Record
        Fitted, and not seen by any fit.
    progress : callable, optional
        Called with a sentence before every stage.

    Returns
    -------
    Diagnosed

    Raises
    ------
    InputError
        As `rt.diagnose`.

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 100.0}},
    ...                 links=[{"between": ("bar", "room"), "conductance": 0.5}], inputs={"heater": {"lump": "bar"}},
    ...                 sensors={"T": {"lump": "bar", "noise": 0.05}})
    >>> drive = rt.Record(sample_time=10.0, inputs=np.repeat([4.0, 0.0, 6.0, 2.0], 50), outputs=np.zeros((200, 0)),
    ...                   input_names=["heater"], output_names=[])
    >>> run = rt.thermal.simulate(bar.with_parameters({"sensors.T.time_constant": 30.0}), drive)
    >>> noisy = run.with_outputs(run.outputs + 0.05 * np.random.default_rng(1).standard_normal((200, 1)))
    >>> found = rt.project.diagnose_records(bar, (), [noisy])
    >>> found.holds, found.diagnosis.effects[0].label, found.residuals[0].kind
    (True, 'sensor_lag(T)', 'train')
    """
    try:
        found = diagnose(system, list(train), validation=list(validation) or None, progress=progress)
    except InputError as error:
        where = error.where.replace("argument records", "training records")
        where = where.replace("argument validation", "--validation").replace("argument system", f"system {system.name}")
        raise InputError(error.what, where=where, expected=error.expected, remedy=error.remedy) from None
    progress("running both models freely")
    return Diagnosed(found, (*_trained(found), *_unseen(found, validation)), files)


def _trained(found: Diagnosis) -> Iterator[Residuals]:
    for path, before, after in zip(found.nominal.along, found.nominal.residuals, found.fit.residuals, strict=True):
        names = path.one.sensors
        yield Residuals("train", path.one.label, path.time, _by_name(names, before), _by_name(names, after))


def _unseen(found: Diagnosis, records: Sequence[Record]) -> Iterator[Residuals]:
    """As the hold-out test runs them: initial temperatures from the first tenth, then free."""
    for record in records:
        before, after = (_free_run(fit, record) for fit in (found.nominal, found.fit))
        yield Residuals("validation", record.name or "record", record.time, before, after)


def _free_run(fit: Refit, record: Record) -> dict[str, Array]:
    one = as_data(fit.structure.base, record, "validation")[0]
    try:
        return _by_name(one.sensors, validate(fit.system, one, "free", fit.floor.noise)[1])
    except Diverged:
        return _by_name(one.sensors, np.full(one.readings.shape, np.nan))


def _by_name(names: Sequence[str], residuals: Array) -> dict[str, Array]:
    return {name: residuals[:, i] for i, name in enumerate(names)}
