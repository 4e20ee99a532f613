"""PROJECT.toml: which system, which records, what to calibrate, what to certify."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError

from ..._celsius import HIGHEST_CELSIUS, LOWEST_KELVIN
from ...errors import InputError
from ...signals import celsius_to_kelvin, declared
from ...thermal import FitRange, System, fit_in_kelvin, read_system
from ..measured import ReadTable
from ._claim_names import check_ends, check_names
from ._project_table import ProjectTable
from ._stage_tables import (
    FILE_NAME,
    CoupleTable,
    DesignTable,
    DiagnoseTable,
    Identification,
    IdentifyTable,
    Pair,
    RecordEntry,
)
from ._toml import Number, Table, read_toml, refusal

_REMEDY = "See the documentation, \"Project file\", or start from the demo's."
Method = Literal["energy", "sum", "max", "lyapunov"]
Structure = Literal["full", "block"]
Direction = Literal["symmetric", "cooling", "heating"]
Initial = Literal["free", "measured", "system"]
Loss = Literal["linear", "soft_l1", "huber"]
ParameterSet = Literal["ellipsoid", "box"]
TemperatureLower = Literal["reported", "held"]
Remarks = Literal["pass", "fail"]
Ranges = Mapping[str, tuple[float, float]]
METHODS: tuple[Method, ...] = ("energy", "sum", "max", "lyapunov")
STRUCTURES: tuple[Structure, ...] = ("full", "block")
DIRECTIONS: tuple[Direction, ...] = ("symmetric", "cooling", "heating")


class CalibrateTable(Table):
    """[calibrate]: what `rt.calibrate` may do."""

    initial: Initial = "free"
    loss: Loss = "linear"
    parameters: dict[str, dict[str, Number]] = {}
    responses: list[str] = []
    max_iterations: Annotated[int, Field(ge=1, le=10_000, strict=True)] = 200


class CertifyTable(Table):
    """[certify]: the boxes of the claims, temperatures in the unit of the system file."""

    temperature: Pair | None = None
    ambient: dict[str, Pair] = {}
    current: dict[str, Pair] | None = None
    heat: dict[str, Pair] | None = None
    setpoint: dict[str, Number] = {}
    method: Method = "energy"
    structure: Structure = "full"
    large: bool = False
    parameters: Literal["calibration", "none"] | dict[str, Pair] = "calibration"
    set: ParameterSet = "ellipsoid"
    temperature_lower: TemperatureLower = "reported"


Size = Annotated[float, Field(ge=0, allow_inf_nan=False, strict=True)]


class GateTable(Table):
    """[gate]: when the verdict is FAIL."""

    tolerance: Size | dict[str, Size] = {}
    confidence: Annotated[float, Field(gt=0.5, lt=1, allow_inf_nan=False, strict=True)] = 0.95
    remarks: Remarks = "pass"


class _File(Table):
    project: ProjectTable
    gate: GateTable = GateTable()
    identify: dict[Annotated[str, Field(pattern=FILE_NAME)], IdentifyTable] = {}
    diagnose: DiagnoseTable | None = None
    design: DesignTable | None = None
    couple: CoupleTable | None = None
    calibrate: CalibrateTable = CalibrateTable()
    certify: CertifyTable = CertifyTable()
    record: dict[str, Any] = {}
    columns: dict[str, Any] = {}


@dataclass(frozen=True)
class Boxes:
    """What is to be certified, kelvin.

    Parameters
    ----------
    temperature : tuple of float
        Box of the current limits [K].
    ambient, current, heat : dict
        Ranges by name [K], [A], [W]; lumps that `heat` does not name get what their heaters' declared limits allow.
    setpoint : dict
        Regulated cold faces [K].
    method : str
        Norm of the contraction.
    structure : str
        Method "lyapunov": "full" or "block" P.
    large : bool
        Method "lyapunov": search P for more than 40 lumps too.
    parameters : str or mapping
        "calibration": ranges of what was calibrated; "none": the parameters as they stand; or {parameter: (lower,
        upper)}, each in its unit.
    confidence : float
        Of the ranges from a calibration.
    set : {"ellipsoid", "box"}
        Set that these ranges cover, as in `Fit.ranges`.
    temperature_lower : {"reported", "held"}
        Whether the lower end of `temperature` must be held by the box that is never left, or is only reported.
    """

    temperature: tuple[float, float] = (278.15, 358.15)
    ambient: dict[str, tuple[float, float]] | None = None
    current: dict[str, tuple[float, float]] | None = None
    heat: dict[str, tuple[float, float]] | None = None
    setpoint: dict[str, float] | None = None
    method: Method = "energy"
    structure: Structure = "full"
    large: bool = False
    parameters: Literal["calibration", "none"] | Ranges = "calibration"
    confidence: float = 0.95
    set: ParameterSet = "ellipsoid"
    temperature_lower: TemperatureLower = "reported"


@dataclass(frozen=True)
class Gate:
    """When the verdict of a job is FAIL.

    Parameters
    ----------
    tolerance : dict
        Largest root mean square beyond the noise by sensor [K]; "default" for those not named; 3 times the noise of
        the sensor where neither is given.
    remarks : {"pass", "fail"}
        "fail": a remark is a failure too.
    """

    tolerance: Mapping[str, float] = field(default_factory=dict)
    remarks: Remarks = "pass"

    def of(self, sensor: str, noise: float) -> float:
        """Tolerance of a sensor [K].

        Parameters
        ----------
        sensor : str
            Name of the sensor.
        noise : float
            Its standard deviation [K].
        """
        return self.tolerance.get(sensor, self.tolerance.get("default", 3.0 * noise))


@dataclass(frozen=True)
class Project:
    """A job: a system, its records, what to calibrate and what to certify.

    Parameters
    ----------
    name, label : str
        For the report; the label stands over everything, for example "SIMULATED DATA".
    system : System
        Nominal system with its [fit] ranges.
    train, validation : tuple of Path
        Paths of the record files to fit and to validate on.
    median_filter : float or None
        Length of a median filter for the outputs [s], None for none.
    initial, loss : str
        As in `rt.calibrate`.
    boxes : Boxes
        What to certify.
    files : tuple of Path
        Every input file, for the hashes of the report.
    gate : Gate
        When the verdict is FAIL.
    diagnose : bool
        Whether to look for what the model lacks.
    session_gain : bool
        Whether the diagnosis lets every record have its own gains.
    reading : mapping
        Record file to tables [record] and [columns] that say how it is read, besides the system's own.
    path : Path
        The project file itself; other files are relative to it.
    system_file : Path
        File of the system.
    identify : tuple of Identification
        Frequency responses to estimate.
    responses : tuple of Path
        Files of frequency responses to calibrate on, besides those of `identify`.
    adopt : bool
        Whether an effect that the diagnosis names goes into the certified system.
    design : DesignTable or None
        Controller to design.
    couple : CoupleTable or None
        Subsystems to couple.
    notes : str
        What the reader of the report should know about machine and measurement, paragraphs between blank lines.
    max_iterations : int
        After how many iterations a calibration stops.
    identity : mapping
        Serial number, operator, revision and date, as far as stated: for the head of the report and the page to sign.
    """

    name: str
    label: str
    system: System
    train: tuple[Path, ...]
    validation: tuple[Path, ...]
    median_filter: float | None
    initial: Initial
    loss: Loss
    boxes: Boxes
    files: tuple[Path, ...]
    gate: Gate = Gate()
    diagnose: bool = False
    session_gain: bool = False
    reading: Mapping[Path, tuple[ReadTable, ...]] = field(default_factory=dict)
    path: Path = Path()
    system_file: Path = Path()
    identify: tuple[Identification, ...] = ()
    responses: tuple[Path, ...] = ()
    adopt: bool = False
    design: DesignTable | None = None
    couple: CoupleTable | None = None
    notes: str = ""
    max_iterations: int = 200
    identity: Mapping[str, str] = field(default_factory=dict)


def read_project(path: str | Path) -> Project:
    """Read a project file and the system it names.

    Parameters
    ----------
    path : str or Path
        Project file to read, TOML.

    Returns
    -------
    Project

    Raises
    ------
    InputError
        Naming file, table, key and remedy.

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.jobs.read_project(rt.jobs.demo_project()).name
    'Two-module setup (simulated demo)'
    """
    path = Path(path)
    data = read_toml(path, _File, _REMEDY)
    folder, head = path.parent, data.project
    system_file = _beside(folder, head.system, path)
    system = _with_fit(read_system(system_file), data.calibrate.parameters, path)
    reading: dict[Path, tuple[ReadTable, ...]] = {}
    train, validation = (tuple(_record_file(entry, folder, path, data, reading) for entry in entries)
                         for entries in (head.train, head.validation))
    identify = tuple(_identification(name, table, system, path, data, reading)
                     for name, table in data.identify.items())
    responses = tuple(_beside(folder, name, path, "calibrate") for name in data.calibrate.responses)
    asked = data.diagnose or DiagnoseTable()
    measured = dict.fromkeys([*train, *validation, *(file for one in identify for file in one.records), *responses])
    return Project(head.name, head.label, system, train, validation, head.median_filter, data.calibrate.initial,
                   data.calibrate.loss, _boxes(system, data.certify, data.gate.confidence, path, asked.adopt),
                   (path, system_file, *measured), _gate(system, data.gate, path), data.diagnose is not None,
                   asked.session_gain, reading, path, system_file, identify, responses, asked.adopt, data.design,
                   data.couple, head.notes.strip(), data.calibrate.max_iterations, head.identity)


def _identification(name: str, table: IdentifyTable, system: System, path: Path, data: _File,
                    reading: dict[Path, tuple[ReadTable, ...]]) -> Identification:
    where = f"{path} [identify.{name}] operating_point"
    point = {key: in_kelvin(value, system.temperature_unit, f"{where} {key}") if key in system.ambients else value
             for key, value in table.operating_point.items()}
    unknown = [key for key in point if key not in (*system.inputs, *system.modules, *system.ambients)]
    if unknown:
        raise InputError(f"there is no input {unknown[0]!r}", where=where,
                         expected="some of " + ", ".join((*system.inputs, *system.modules, *system.ambients)))
    files = tuple(_record_file(entry, path.parent, path, data, reading, f"identify.{name}") for entry in table.records)
    return Identification(name, files, table, point)


def _record_file(entry: str | RecordEntry, folder: Path, project: Path, data: _File,
                 reading: dict[Path, tuple[ReadTable, ...]], table: str = "project") -> Path:
    """File of an entry; how it is read is kept: [record] and [columns] of the project, then those of the entry."""
    own = RecordEntry(file=entry) if isinstance(entry, str) else entry
    file = _beside(folder, own.file, project, table)
    tables: tuple[ReadTable, ...] = ((data.record, data.columns, str(project)),
                                     (own.record, own.columns, f"{project} [{table}] {own.file}"))
    declared(*tables)  # refuses unknown keys before any record is read
    kept = tuple(one for one in tables if one[0] or one[1])
    if [one[:2] for one in reading.get(file, kept)] != [one[:2] for one in kept]:
        raise InputError(f"{own.file!r} is read in two ways", where=f"{project} [{table}]",
                         remedy="Give it the same `record` and `columns` wherever it is named.")
    reading[file] = kept
    return file


def _beside(folder: Path, name: str, project: Path, table: str = "project") -> Path:
    file = folder / name
    if not file.is_file():
        raise InputError(f"{name!r} does not exist", where=f"{project} [{table}]",
                         remedy="Paths are relative to the project file.")
    return file


def _with_fit(system: System, ranges: dict[str, dict[str, float]], path: Path) -> System:
    if not ranges:
        return system
    try:
        fit = {name: FitRange(**bounds) for name, bounds in fit_in_kelvin(ranges, system.temperature_unit).items()}
        return System(**{**dict(system), "fit": fit})
    except ValidationError as error:
        raise refusal(error, path, _REMEDY) from None
    except InputError as error:
        raise InputError(error.what, where=f"{path} [calibrate.parameters] {error.where}", expected=error.expected,
                         remedy=error.remedy) from None


def _gate(system: System, table: GateTable, path: Path) -> Gate:
    if not isinstance(table.tolerance, dict):
        return Gate({"default": table.tolerance}, table.remarks)
    unknown = [name for name in table.tolerance if name not in (*system.sensors, "default")]
    if unknown:
        raise InputError(f"there is no sensor {unknown[0]!r}", where=f"{path} [gate] tolerance",
                         expected="one of " + ", ".join((*system.sensors, "default")))
    return Gate(table.tolerance, table.remarks)


def _boxes(system: System, table: CertifyTable, confidence: float, path: Path, adopt: bool) -> Boxes:
    unit, where = system.temperature_unit, f"{path} [certify]"
    ranges = {"ambient": table.ambient, "current": table.current or {}, "heat": table.heat or {},
              "parameters": {} if isinstance(table.parameters, str) else table.parameters}
    check_names(system, ranges, table.setpoint, where, adopt)
    check_ends(ranges, table.temperature, where)
    box = range_in_kelvin(table.temperature, unit, f"{where} temperature") if table.temperature else None
    return Boxes(temperature=box or Boxes().temperature,
                 ambient={name: range_in_kelvin(pair, unit, f"{where} ambient.{name}")
                          for name, pair in table.ambient.items()},
                 current=table.current, heat=table.heat,
                 setpoint={name: in_kelvin(value, unit, f"{where} setpoint.{name}")
                           for name, value in table.setpoint.items()},
                 method=table.method, structure=table.structure, large=table.large, parameters=table.parameters,
                 confidence=confidence, set=table.set, temperature_lower=table.temperature_lower)


def in_kelvin(value: float, unit: str, where: str, low: float | None = None) -> float:
    """A temperature in the unit of a system file [K]; what looks like the other unit is refused.

    Nothing looks like kelvin that is the upper end of a range whose lower end does not.
    """
    if unit == "degC" and value > HIGHEST_CELSIUS and not (low is not None and low < LOWEST_KELVIN):
        raise InputError(f"{value:g} °C is above {HIGHEST_CELSIUS:g} °C: it looks like kelvin", where=where,
                         remedy="The system file says degC: give degrees Celsius. For a machine that is so hot write "
                                'it in kelvin, with temperature_unit = "K".')
    if unit == "K" and value < LOWEST_KELVIN:
        raise InputError(f"{value:g} K is below {LOWEST_KELVIN:g} K: it looks like degrees Celsius", where=where,
                         remedy="The system file says K: give kelvin.")
    return float(celsius_to_kelvin(value)) if unit == "degC" else float(value)


def range_in_kelvin(pair: Pair, unit: str, where: str) -> tuple[float, float]:
    """Both ends of a range [K]."""
    return in_kelvin(pair[0], unit, where), in_kelvin(pair[1], unit, where, low=pair[0])
