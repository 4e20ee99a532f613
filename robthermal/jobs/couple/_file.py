"""SPEC.toml of `robthermal couple`: two subsystems, measured responses, and what the filters shall do."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, ValidationError

from ..._checks import quoted
from ...errors import InputError, Outcome
from ...identify import FrequencyResponse
from ..request import Number, Table, read_toml, refusal
from ._frf import plant_remarks, plants_from_pairs, plants_from_whole
from ._systems import LTI, System, SystemTable, files_of, linear_system

_REMEDY = 'See the documentation, "Command line", robthermal couple, or the example examples/scanner.'
_MANUAL = ("X_hat", "Y_hat")
_SYSTEMS = ("X_hat", "Y_hat", "Z1", "Z2", "weight")
_OF_MATRICES = {"weight", "margin", "basis", "order", "pole", "couple", "cutoff", "X_hat", "Y_hat"}
_OF_EVALUATE = {"X_hat", "Y_hat", "Z1", "Z2", "weight", "window", "cutoff"}  # what a manual design may say
Files = Annotated[list[str], Field(min_length=1, max_length=1000)]


class CouplingTable(Table):
    """[coupling]."""

    name: str
    sample_time: Annotated[Number, Field(ge=0)]
    export: list[Literal["mat", "c", "h"]] = []


class SubsystemTable(Table):
    """[subsystems.1] and [subsystems.2]."""

    name: str = ""
    plant: System
    controller: System
    disturbance: System | None = None


class SubsystemsTable(Table):
    """[subsystems]."""

    one: SubsystemTable = Field(alias="1")
    two: SubsystemTable = Field(alias="2")


class UncertaintyTable(Table):
    """[uncertainty]: measured plants, a diagonal pair of files or one whole file per machine position."""

    frf_1: Files | None = None
    frf_2: Files | None = None
    frf: Files | None = None
    circles: Annotated[bool, Field(strict=True)] = True
    confidence: Annotated[Number, Field(gt=0, lt=1)] = 0.95
    measured_in_closed_loop: Annotated[bool, Field(strict=True)] = False


class DesignTable(Table):
    """[design]: keyword arguments of the synthesis, or given filters. Option values are checked there."""

    window: Number | None = None
    msd_limit: Number | None = None
    objective: str | None = None
    hinf_limit: Number | None = None
    improvement_limit: Number | None = None
    margin: Number | None = None
    stable_controller: Annotated[bool, Field(strict=True)] | None = None
    basis: str | None = None
    order: Annotated[int, Field(strict=True, ge=1, le=500)] | None = None
    pole: Any = None
    couple: list[str] | None = None
    cutoff: Annotated[Number, Field(gt=0)] | None = None
    weight: System | None = None
    X_hat: System | None = None
    Y_hat: System | None = None
    Z1: System | None = None
    Z2: System | None = None


class _File(Table):
    coupling: CouplingTable
    subsystems: SubsystemsTable
    uncertainty: UncertaintyTable | None = None
    design: DesignTable = DesignTable()


@dataclass(frozen=True, eq=False)
class CouplingJob:
    """A coupling to be designed, or a given one to be judged.

    Parameters
    ----------
    name : str
        Of the design.
    names : tuple of str
        Of the subsystems.
    plants, controllers, disturbances : tuple of LTI
        Of subsystems 1 and 2.
    measured : tuple of FrequencyResponse
        2x2 plants, one per machine position; empty without uncertainty.
    measured_files : tuple of str
        The files of each, for messages.
    manual : bool
        Whether the filters are given.
    options : dict
        Keyword arguments of `rt.coupling.synthesize`, or of `evaluate` for given filters; frequencies in rad/s. Of
        several inputs and outputs, of `synthesize_matrix` and `evaluate_matrix`.
    files : tuple of Path
        The coupling file and every file it names.
    exports : tuple of str
        Endings of further files with the filters: "mat", "c", "h".
    circles : bool
        Whether the confidence circles of measured plants with covariance enter the envelope.
    confidence : float
        Probability that all true values are in their circles at once.
    measured_in_closed_loop : bool
        Whether the plants were measured while these controllers ran: then no encirclement is counted.
    """

    name: str
    names: tuple[str, str]
    plants: tuple[LTI, LTI]
    controllers: tuple[LTI, LTI]
    disturbances: tuple[LTI | float, LTI | float]
    measured: tuple[FrequencyResponse, ...]
    measured_files: tuple[str, ...]
    manual: bool
    options: dict[str, Any]
    files: tuple[Path, ...]
    exports: tuple[str, ...] = ()
    circles: bool = True
    confidence: float = 0.95
    measured_in_closed_loop: bool = False

    @property
    def matrices(self) -> bool:
        """Whether a subsystem has more than one input or output."""
        return any((plant.ninputs, plant.noutputs) != (1, 1) for plant in self.plants)

    @property
    def remarks(self) -> tuple[Outcome, ...]:
        """What the claims about the measured plants leave out; empty if nothing."""
        return tuple(plant_remarks(self.measured, self.measured_files, self.circles))


def read_coupling(path: str | Path) -> CouplingJob:
    """Read a coupling file and the files it names.

    Parameters
    ----------
    path : str or Path
        SPEC.toml; other files are relative to it. Frequencies in it are hertz.

    Returns
    -------
    CouplingJob

    Raises
    ------
    InputError
        Naming file, table, key and remedy.

    Examples
    --------
    >>> from pathlib import Path
    >>> import robthermal as rt
    >>> loop = "plant = { num = [0.01], den = [1.0, -0.99] }\\ncontroller = 20.0\\n"
    >>> _ = Path("SPEC.toml").write_text('[coupling]\\nname = "pair"\\nsample_time = 0.01\\n'
    ...     f"[subsystems.1]\\n{loop}[subsystems.2]\\n{loop}[design]\\nX_hat = -0.9\\n")
    >>> job = rt.jobs.read_coupling("SPEC.toml")
    >>> job.name, job.manual, job.plants[0].dt
    ('pair', True, 0.01)
    """
    path = Path(path)
    return _job(read_toml(path, _File, _REMEDY), path)


def coupling_from_tables(tables: Mapping[str, Any], path: Path) -> CouplingJob:
    """A coupling from tables that stand in another file.

    Parameters
    ----------
    tables : mapping
        What SPEC.toml would hold.
    path : Path
        File they stand in; other files are relative to it.

    Returns
    -------
    CouplingJob

    Raises
    ------
    InputError
        As `read_coupling`.
    """
    try:
        return _job(_File(**tables), path)
    except ValidationError as error:
        raise refusal(error, path, _REMEDY) from None


def _job(data: _File, path: Path) -> CouplingJob:
    dt, halves = data.coupling.sample_time, (data.subsystems.one, data.subsystems.two)
    manual = any(getattr(data.design, key) is not None for key in _MANUAL)
    plants, controllers = (tuple(linear_system(getattr(half, key), dt, f"[subsystems.{k}] {key}", path)
                                 for k, half in enumerate(halves, 1)) for key in ("plant", "controller"))
    shape = (sum(plant.noutputs for plant in plants), sum(plant.ninputs for plant in plants))
    measured, groups = _measured(data.uncertainty, dt, path, shape)
    tables = [*(getattr(half, key) for half in halves for key in ("plant", "controller", "disturbance")),
              *(getattr(data.design, key) for key in _SYSTEMS)]
    files = (path, *(file for table in tables for file in files_of(table, path)), *(f for pair in groups for f in pair))
    return CouplingJob(
        data.coupling.name, (halves[0].name or "subsystem 1", halves[1].name or "subsystem 2"),
        (plants[0], plants[1]), (controllers[0], controllers[1]), _disturbances(halves, dt, path), measured,
        tuple(", ".join(file.name for file in group) for group in groups), manual,
        dict(_options(data.design, manual, dt, path, shape != (2, 2))), files,
        _exports(data.coupling.export, dt, path),
        **_options_of(data.uncertainty))


def _options_of(table: UncertaintyTable | None) -> dict[str, Any]:
    keys = ("circles", "confidence", "measured_in_closed_loop")
    return {} if table is None else {key: getattr(table, key) for key in keys}


def _exports(endings: Sequence[str], dt: float, path: Path) -> tuple[str, ...]:
    if not dt and {"c", "h"} & set(endings):
        raise InputError("a continuous-time coupling has no C source", where=f"{path} [coupling] export",
                         expected='["mat"]', remedy="Give a sample_time.")
    return tuple(dict.fromkeys(endings))


def _disturbances(halves: tuple[SubsystemTable, SubsystemTable], dt: float, path: Path) -> tuple[Any, Any]:
    tables = [half.disturbance for half in halves]
    if (tables[0] is None) != (tables[1] is None):
        lacking = 1 if tables[0] is None else 2
        raise InputError(f"subsystem {lacking} has no disturbance, the other has one",
                         where=f"{path} [subsystems.{lacking}]", expected="a disturbance for both, or for none",
                         remedy="disturbance = 0 says that there is none.")
    return tuple(1.0 if table is None else linear_system(table, dt, f"[subsystems.{k}] disturbance", path)
                 for k, table in enumerate(tables, 1))  # type: ignore[return-value]  # two of them


def _measured(table: UncertaintyTable | None, dt: float, path: Path, shape: tuple[int, int]
              ) -> tuple[tuple[FrequencyResponse, ...], list[list[Path]]]:
    """Plants, and the files of each."""
    if table is None:
        return (), []
    where, folder = f"{path} [uncertainty]", path.parent
    if (table.frf is None) == (table.frf_1 is None and table.frf_2 is None):
        raise InputError("gives no files, or gives frf and frf_1, frf_2", where=where,
                         expected="frf_1 and frf_2, or frf", remedy="Leave [uncertainty] out for a nominal design.")
    if table.frf is not None:
        whole = [folder / name for name in table.frf]
        return plants_from_whole(whole, dt, shape), [[file] for file in whole]
    if shape != (2, 2):
        raise InputError("frf_1 and frf_2 beside subsystems of several inputs and outputs", where=where,
                         expected=f"frf: files of all {shape[0]} outputs and {shape[1]} inputs")
    first, second = ([folder / name for name in names or []] for names in (table.frf_1, table.frf_2))
    if len(first) != len(second):
        raise InputError(f"{len(first)} files in frf_1, {len(second)} in frf_2", where=where,
                         expected="two lists of one length: the k-th files are one machine position")
    return plants_from_pairs(first, second, dt), [list(pair) for pair in zip(first, second, strict=True)]


def _options(table: DesignTable, manual: bool, dt: float, path: Path, matrices: bool) -> Iterator[tuple[str, Any]]:
    """What the file says, in the units of the python functions."""
    where = f"{path} [design]"
    given = [key for key in DesignTable.model_fields if getattr(table, key) is not None]
    single = [key for key in given if matrices and key not in _OF_MATRICES]
    if single:
        raise InputError(f"{single[0]} beside subsystems of several inputs and outputs", where=where,
                         expected=f"only {', '.join(sorted(_OF_MATRICES))}",
                         remedy="It is for subsystems of one input and one output each: leave it out.")
    factors = [key for key in ("Z1", "Z2") if key in given]
    if not manual and factors:
        raise InputError(f"{factors[0]} without X_hat and Y_hat", where=where,
                         expected="Z1, Z2 with given filters only", remedy="The synthesis constructs its own.")
    searched = [key for key in given if manual and key not in _OF_EVALUATE]
    if searched:
        raise InputError(f"{searched[0]} beside given filters", where=where,
                         expected=f"with X_hat or Y_hat only {', '.join(sorted(_OF_EVALUATE))}",
                         remedy="Leave X_hat and Y_hat out to have filters designed.")
    for key in given:
        value = getattr(table, key)
        if isinstance(value, SystemTable):
            yield key, linear_system(value, dt, f"[design] {key}", path)
        elif key == "cutoff":
            yield key, 2 * np.pi * value
        else:
            yield key, _poles(value, where) if key == "pole" else value


def _poles(value: Any, where: str) -> Any:
    """A real pole, or a list of poles; TOML has no complex numbers, a pair [re, im] stands for one."""
    try:
        if isinstance(value, list):
            return [complex(*map(float, pole)) if isinstance(pole, list) else complex(pole) for pole in value]
        return float(value)
    except (TypeError, ValueError):
        raise InputError(f"pole = {quoted(value)}", where=where,
                         expected="a number, or a list of numbers and pairs [re, im]",
                         remedy="Poles are points of the z or s plane.") from None
