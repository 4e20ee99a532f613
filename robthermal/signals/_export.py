"""A record as a table: on the screen, as a data frame, in a file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from .._pandas import pd
from .._write import whole_file
from ..errors import InputError
from ._checks import channel_names
from ._names import suggestion
from ._stated import KEY, comment
from ._units import kelvin_to_celsius

if TYPE_CHECKING:
    from ._record import Record

_MEANS = "readings"  # rows of a record of means: readings over the step before, inputs from the stamp on
_SHOWN_NAME = 24  # characters of a channel name in the table on the screen


def frame(record: Record) -> pd.DataFrame:
    """Columns time, inputs, outputs; that readings are means stands in `attrs`."""
    if "time" in record.names:
        raise InputError("a channel is called 'time'", where="record", remedy="Rename it: that column holds the time.")
    columns = {"time": record.time} | {name: np.array(record[name]) for name in record.names}
    table = pd.DataFrame(columns)
    if record.averaged:
        table.attrs[KEY] = _MEANS
    return table


def summary(record: Record) -> str:
    """Name, length, and the range of every channel."""
    title = f"Record {record.name!r}" if record.name else "Record"
    lines = [f"{title}: {record.n_samples} samples of {record.sample_time:.10g} s, from {record.start_time:.10g} s"
             + (", readings are means over the sample before" if record.averaged else "")]
    rows = [("", "channel", "min", "max", "unit")]
    for kind, names in (("input", record.input_names), ("output", record.output_names)):
        for name in names:
            column = record[name]
            shown = name if len(name) <= _SHOWN_NAME else name[: _SHOWN_NAME - 1] + "…"
            rows.append((kind, shown, f"{column.min():.6g}", f"{column.max():.6g}", record.units.get(name, "")))
    widths = [max(len(row[i]) for row in rows) for i in range(5)]
    for kind, name, low, high, unit in rows:
        cells = (f"{kind:<{widths[0]}}", f"{name:<{widths[1]}}", f"{low:>{widths[2]}}", f"{high:>{widths[3]}}", unit)
        lines.append("  " + "  ".join(cells).rstrip())
    return "\n".join(lines + [f"  note: {note}" for note in record.notes])


def write(record: Record, path: Path, temperature_unit: str, temperatures: Sequence[str] | None) -> None:
    """Write `path` in the format of its suffix; the file appears only when it is complete."""
    save_records([record], path, temperature_unit, temperatures)


def save_records(records: Sequence[Record], path: str | Path, temperature_unit: str = "K",
                 temperatures: Sequence[str] | None = None) -> None:
    """Write the parts of one measurement into one file, one after the other on their own times.

    Parameters
    ----------
    records : sequence of Record
        With the same channels, in the order of time.
    path : str or Path
        ``.csv``, ``.parquet`` or ``.mat``.
    temperature_unit : {"K", "degC"}
        Unit of the temperatures in the file.
    temperatures : sequence of str, optional
        Which channels are temperatures; default those whose unit is K.

    Raises
    ------
    InputError
        Another suffix, channels that differ, names that the format cannot hold.

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> one = rt.Record(sample_time=1.0, inputs=np.ones(3), outputs=np.ones(3), input_names=["u"], output_names=["y"])
    >>> rt.signals.save_records([one[:2], one[1:]], "parts.csv")
    """
    path = Path(path)
    if any(record.names != records[0].names for record in records):
        raise InputError("the parts have different channels", where="argument records", expected="the same in all")
    if any(record.averaged != records[0].averaged for record in records):
        raise InputError("some parts hold means, others do not", where="argument records", expected="the same in all",
                         remedy="Save them in files of their own.")
    writer = _WRITERS.get(path.suffix.lower())
    if writer is None:
        raise InputError(
            f"the file name ends in {path.suffix!r}", where=f"{path}", expected=f"one of {', '.join(_WRITERS)}"
        )
    table = pd.concat([_in_unit(record, frame(record), temperature_unit, temperatures) for record in records])
    with whole_file(path) as part:
        writer(table, part, path, _MEANS if records[0].averaged else "")


def _in_unit(record: Record, table: pd.DataFrame, unit: str, temperatures: Sequence[str] | None) -> pd.DataFrame:
    if unit not in ("K", "degC"):
        raise InputError(f"temperature_unit is {unit!r}", where="argument temperature_unit", expected="'K' or 'degC'")
    if temperatures is None:
        named = tuple(name for name in record.names if record.units.get(name) == "K")
    else:
        named = channel_names(temperatures, "temperatures")
    for name in named:
        if name not in record.names:
            raise InputError(
                f"there is no channel {name!r}",
                where="argument temperatures",
                remedy=suggestion(name, record.names),
            )
    if unit == "K":
        return table
    if not named:
        raise InputError(
            "no channel is known to be a temperature",
            where="argument temperatures",
            expected="their names, or units={'T1': 'K', ...} in the record",
        )
    for name in named:
        table[name] = kelvin_to_celsius(table[name].to_numpy())
    return table


def _write_csv(table: pd.DataFrame, part: Path, path: Path, averaged: str) -> None:
    for name in table.columns:
        if name != name.strip() or any(sign in name for sign in ',;\t"\r\n#[]'):
            raise InputError(
                f"the channel name {name!r} cannot be a CSV header",
                where=f"{path}",
                remedy="Rename it: no separators, quotes, '#', brackets or outer spaces.",
            )
    with part.open("w", encoding="utf-8", newline="") as file:
        file.write(comment(averaged) if averaged else "")
        table.to_csv(file, index=False, lineterminator="\n")


def _write_parquet(table: pd.DataFrame, part: Path, path: Path, averaged: str) -> None:
    pyarrow, parquet = require_pyarrow()
    arrow = pyarrow.table({name: table[name].to_numpy() for name in table.columns},
                          metadata={KEY: averaged} if averaged else None)
    parquet.write_table(arrow, part)


def _write_matlab(table: pd.DataFrame, part: Path, path: Path, averaged: str) -> None:
    for name in table.columns:
        if not (name.isidentifier() and name.isascii() and name[0] != "_" and len(name) <= 63):
            raise InputError(
                f"the channel name {name!r} is no MATLAB variable name",
                where=f"{path}",
                remedy="Use letters, digits and underscores, or save as .csv.",
            )
    if averaged and KEY in table.columns:
        raise InputError(f"a channel is called {KEY!r}", where=f"{path}",
                         remedy="Rename it: in a file of means that variable says so.")
    columns = {name: table[name].to_numpy() for name in table.columns} | ({KEY: averaged} if averaged else {})
    with part.open("wb") as file:
        scipy.io.savemat(file, columns, do_compression=True, oned_as="column", long_field_names=True)


def require_pyarrow() -> tuple[Any, Any]:
    """The modules pyarrow and pyarrow.parquet, or the message that says how to install them."""
    try:
        # Imported here: an optional extra, and slow to load.
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise InputError(
            "Parquet files need the package pyarrow, which is not installed",
            remedy="Install it with: pip install 'robthermal[parquet]'",
        ) from None
    return pyarrow, pyarrow.parquet


_WRITERS = {".csv": _write_csv, ".parquet": _write_parquet, ".mat": _write_matlab}
