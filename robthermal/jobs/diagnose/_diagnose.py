"""The diagnosis job: records read, effects searched, residuals before and after for the report."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...diagnosis import Diagnosis, LinearizedRecord, diagnose
from ...diagnosis.path import LinearizedResponse
from ...errors import InputError
from ...identify import FrequencyResponse
from ...signals import Record
from ...thermal import System
from ._long_enough import long_enough
from ._welch import welch

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
        Times of the samples [s].
    before, after : dict
        {sensor: measured − model (n,)} [unit], nominal system refitted and with the effects; nan if the model runs
        away.
    unit : str
        Of all sensors: a record with temperatures and voltages has residuals in "K" and residuals in "V".
    """

    kind: str
    name: str
    time: Array
    before: dict[str, Array]
    after: dict[str, Array]
    unit: str = "K"

    @property
    def frequency(self) -> Array:
        """Frequencies of `spectra` [Hz]."""
        return np.asarray(self._welch(np.zeros_like(self.time))[0])

    def spectra(self) -> tuple[dict[str, Array], dict[str, Array]]:
        """Amplitude spectral densities [unit/√Hz] of the residuals before and after, by Welch's method."""
        before, after = ({name: np.sqrt(self._welch(values)[1]) for name, values in residuals.items()}
                         for residuals in (self.before, self.after))
        return before, after

    def _welch(self, values: Array) -> tuple[Array, Array]:
        n = values.size
        f, power = welch(values, float(self.time[1] - self.time[0]), max(min(n, 8), n // 4))
        return f[1:], power[1:]


@dataclass(frozen=True, eq=False)
class ResponseResiduals:
    """What two models leave of one frequency response.

    Parameters
    ----------
    name : str
        Of the response.
    frequency : ndarray, shape (n,)
        Of its bins [Hz].
    before, after : dict
        {"output/input": size of measured - model (n,)} [output unit / input unit].
    """

    name: str
    frequency: Array
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
        One per record and unit.
    responses : tuple of ResponseResiduals
        One per frequency response fitted.
    files : tuple of Path
        System file and records.
    """

    diagnosis: Diagnosis
    residuals: tuple[Residuals, ...]
    responses: tuple[ResponseResiduals, ...]
    files: tuple[Path, ...]

    @property
    def holds(self) -> bool:
        """Whether one set of effects, or none, explains the records."""
        return self.diagnosis.outcome.ok


def diagnose_records(system: System, files: tuple[Path, ...], train: Sequence[Record | FrequencyResponse],
                     validation: Sequence[Record | FrequencyResponse] = (),
                     progress: Callable[[str], None] = lambda stage: None, *,
                     operating_point: Mapping[str, float] | None = None, session_gain: bool = False,
                     reference: Sequence[Record | FrequencyResponse] = (), augment: bool = False,
                     refine: bool = False) -> Diagnosed:
    """Diagnose a system on records and frequency responses.

    Parameters
    ----------
    system : System
        System with nominal parameters.
    files : tuple of Path
        Input files, for their hashes.
    train, validation : sequence of Record or FrequencyResponse
        Fitted, and not seen by any fit.
    progress : callable, optional
        Called with a sentence before every stage.
    operating_point, session_gain
        As in `rt.diagnose`.
    reference : sequence of Record
        Records of the healthy machine; then the question is what has changed since.
    augment : bool
        Whether the new records are compared with a model that has what the reference records alone name.
    refine : bool
        Whether the lump in which something is left is split in two, as in `rt.diagnose`.

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
    >>> found = rt.jobs.diagnose_records(bar, (), [noisy])
    >>> # of one lump, a lag of the heater looks the same: ambiguous
    >>> found.holds, found.diagnosis.effects[0].label, found.residuals[0].kind
    (False, 'sensor_lag(T)', 'train')
    """
    train, validation, reference = map(long_enough, (train, validation, reference))
    try:
        found = diagnose(system, list(train), validation=list(validation) or None, progress=progress,
                         operating_point=operating_point or None, session_gain=session_gain,
                         reference=list(reference) or None, augment=augment, refine=refine)
    except InputError as error:
        where = error.where.replace("argument records", "new records" if reference else "training records")
        where = where.replace("argument reference", "--reference").replace("argument refine", "--refine")
        where = where.replace("argument augment", "--augment")
        where = where.replace("argument validation", "--validation").replace("argument system", f"system {system.name}")
        raise InputError(error.what, where=where, expected=error.expected, remedy=error.remedy) from None
    progress("running both models freely")
    return Diagnosed(found, (*_trained(found), *_validation(found)), tuple(_responses(found)), files)


def _trained(found: Diagnosis) -> Iterator[Residuals]:
    for path, before, after in zip(found.nominal.paths, found.nominal.residuals, found.fit.residuals, strict=True):
        if isinstance(path, LinearizedRecord):
            names = path.one.sensors
            yield from _by_unit(found, "train", path.one.label, path.time, _by_name(names, before),
                                _by_name(names, after))


def _responses(found: Diagnosis) -> Iterator[ResponseResiduals]:
    """Real parts stand above imaginary parts."""
    for path, before, after in zip(found.nominal.paths, found.nominal.residuals, found.fit.residuals, strict=True):
        if isinstance(path, LinearizedResponse):
            n = path.one.frequencies.size
            sizes = (np.hypot(r[:n], r[n:]) for r in (before, after))
            yield ResponseResiduals(path.one.label, path.one.frequencies,
                                    *(_by_name(path.one.sensors, size) for size in sizes))


def _validation(found: Diagnosis) -> Iterator[Residuals]:
    """The free runs of the hold-out test: initial temperatures and the session's gains of the record's own."""
    for one in () if found.hold_out is None else found.hold_out.residuals:
        yield from _by_unit(found, "validation", one.name, one.time, one.before, one.after)


def _by_unit(found: Diagnosis, kind: str, name: str, time: Array, before: dict[str, Array], after: dict[str, Array]
             ) -> Iterator[Residuals]:
    """Temperatures, then voltages: they are drawn on scales of their own."""
    unit_of = {sensor: found.system.sensors[sensor].unit for sensor in before}
    for unit in sorted(set(unit_of.values())):
        mine = [sensor for sensor in before if unit_of[sensor] == unit]
        yield Residuals(kind, name, time, {n: before[n] for n in mine}, {n: after[n] for n in mine}, unit)


def _by_name(names: Sequence[str], residuals: Array) -> dict[str, Array]:
    return {name: residuals[:, i] for i, name in enumerate(names)}
