"""Tables of a project file that ask for further stages: [identify.NAME], [diagnose], [design], [couple]."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from ._toml import Number, Table

Use = Literal["train", "validation", "none"]
Pair = tuple[Number, Number]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
FILE_NAME = r"^[A-Za-z0-9][A-Za-z0-9_-]{0,63}$"  # of a response: it becomes the name of a file


class RecordEntry(Table):
    """One entry of a list of records that says how its file is read."""

    file: str
    record: dict[str, Any] = {}
    columns: dict[str, Any] = {}


class IdentifyTable(Table):
    """[identify.NAME]: a frequency response, with the options of `robthermal frf`."""

    records: Annotated[list[str | RecordEntry], Field(min_length=1)]
    inputs: list[str] = []
    outputs: list[str] = []
    method: str = "lpm"
    half_width: Annotated[int, Field(ge=1)] = 8
    degree: Annotated[int, Field(ge=0)] = 2
    poles: list[Number] = []
    pole_deviation: Positive | None = None
    basis: list[str] = []
    band: Pair | None = None
    reference: str | list[str] = []
    instruments: dict[str, str] = {}
    input_noise: dict[str, Positive] = {}
    use: Use = "train"
    operating_point: dict[str, Number] = {}


class DiagnoseTable(Table):
    """[diagnose]: look for what the model lacks."""

    adopt: Annotated[bool, Field(strict=True)] = False
    session_gain: bool = False


class DesignTable(Table):
    """[design]: what to regulate, how fast, and in which form; temperatures in the unit of the system file."""

    regulate: dict[str, str] = {}
    setpoint: dict[str, Number] = {}
    bandwidth: Positive | None = None
    current: dict[str, Pair] = {}
    sample_time: Positive = 1.0
    sensors: list[str] | None = None
    method: Literal["energy", "sum", "max", "lyapunov"] = "energy"
    margins: dict[str, Number] = {}
    export: list[Literal["c", "mat", "json"]] = []
    setpoint_ramp: dict[str, Positive] = {}


class CoupleTable(Table):
    """[couple]: a coupling file, or its tables; responses of [identify] by name, "identify.NAME"."""

    spec: str | None = None
    name: str | None = None
    sample_time: Number | None = None
    export: list[str] = []
    frf_1: list[str] | None = None
    frf_2: list[str] | None = None
    frf: list[str] | None = None
    circles: bool | None = None
    coupling: dict[str, Any] = {}
    subsystems: dict[str, Any] = {}
    uncertainty: dict[str, Any] = {}
    design: dict[str, Any] = {}


@dataclass(frozen=True)
class Identification:
    """A frequency response to be estimated.

    Parameters
    ----------
    name : str
        Name of the response, and of its file.
    records : tuple of Path
        Paths of the record files.
    options : IdentifyTable
        Options of the estimate.
    operating_point : dict
        Means of heaters [unit], module currents [A] and ambients [K]; empty: those of the records.
    """

    name: str
    records: tuple[Path, ...]
    options: IdentifyTable
    operating_point: Mapping[str, float]

    @property
    def reference(self) -> tuple[str, ...]:
        """Columns of the reference of a closed loop; none of an open one."""
        asked = self.options.reference
        return (asked,) if isinstance(asked, str) else tuple(asked)

    @property
    def use(self) -> Use:
        """What calibration and diagnosis do with it."""
        return self.options.use
