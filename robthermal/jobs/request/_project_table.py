"""[project]: files of a job, and which machine and document its report is about."""

from __future__ import annotations

from datetime import date
from typing import Annotated, Any

from pydantic import BeforeValidator, Field

from ._stage_tables import RecordEntry
from ._toml import Table


def _day(value: Any) -> Any:
    """A date of TOML as text, like one in quotes."""
    return value.isoformat() if isinstance(value, date) else value


Line = Annotated[str, Field(max_length=100, pattern=r"^[^\x00-\x1f\x7f]*$")]


class ProjectTable(Table):
    """[project]: files are relative to the project file."""

    name: str
    system: str
    train: list[str | RecordEntry] = []
    validation: list[str | RecordEntry] = []
    label: str = ""
    notes: Annotated[str, Field(max_length=20_000)] = ""
    median_filter: Annotated[float, Field(gt=0, allow_inf_nan=False)] | None = None
    serial: Line = ""
    operator: Line = ""
    revision: Line = ""
    date: Annotated[Line, BeforeValidator(_day)] = ""

    @property
    def identity(self) -> dict[str, str]:
        """What is stated of machine and document, by the name it has in the report."""
        stated = {"serial number": self.serial, "operator": self.operator, "revision": self.revision, "date": self.date}
        return {name: text.strip() for name, text in stated.items() if text.strip()}
