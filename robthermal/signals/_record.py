"""Record: inputs and outputs sampled uniformly in time, with names and units."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._html import short_table
from ..errors import InputError
from ._checks import (
    Array,
    channel_matrix,
    channel_names,
    channel_units,
    distinct,
    finite_number,
    positive_number,
    ripple_of,
    same_length,
    text,
    texts,
    truth,
)
from ._export import frame, summary, write
from ._figure import draw
from ._names import suggestion

if TYPE_CHECKING:
    import pandas as pd

    from .importing import Import


@dataclass(frozen=True, eq=False, init=False, repr=False)
class Record:
    """Measured or simulated signals, sampled uniformly; temperatures in kelvin.

    Inputs (heaters, currents, ambient temperatures) are held: row k acts over [t_k, t_k + sample_time).
    Outputs are read at t_k, before row k of the inputs has had any effect; or, where they are `averaged`, they are
    means over the sample that ends at t_k.

    Parameters
    ----------
    sample_time : float
        Time between rows [s].
    inputs : array_like, shape (n_samples, n_inputs) or (n_samples,)
        One column per name of `input_names`, held. May have no columns.
    outputs : array_like, shape (n_samples, n_outputs) or (n_samples,)
        One column per name of `output_names`, instantaneous. May have no columns.
    input_names, output_names : sequence of str
        Channel names; none twice.
    start_time : float, optional
        Time of the first row [s].
    units : mapping of str to str, optional
        Channel name to unit. Temperatures are in kelvin: ``"K"``.
    averaged : bool, optional
        Whether outputs are means over the sample before t_k, as loggers that average record them; default: read at t_k.
    ripple : mapping of str to array_like, optional
        Of inputs that change within samples and whose rows are means over these: the root mean square of what they are
        off the mean, (n_samples,). Modules heat by it. A file that is saved does not hold it.
    name : str, optional
        Name of the record, as reports show it.
    notes : sequence of str, optional
        What was done to the data on the way, in words.
    imported : Import, optional
        How the file was read, column by column; None for records that come from no file.

    Attributes
    ----------
    inputs, outputs : ndarray
        Read-only copies, float64, two-dimensional.

    Raises
    ------
    InputError
        NaN, infinite, complex, boolean or text values, lengths that differ, fewer than two rows, a sample time that is
        not positive, names that are missing, empty or used twice.

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> record = rt.Record(sample_time=0.5, inputs=np.ones(4), outputs=[[300.0], [300.5], [300.9], [301.2]],
    ...                    input_names=["heater"], output_names=["T1"], units={"T1": "K"})
    >>> record["T1"][1:3]
    array([300.5, 300.9])
    >>> before, after = record.split(1.0)
    >>> after.start_time, after.n_samples
    (1.0, 2)
    """

    sample_time: float
    inputs: Array
    outputs: Array
    input_names: tuple[str, ...]
    output_names: tuple[str, ...]
    start_time: float
    units: Mapping[str, str]
    averaged: bool
    ripple: Mapping[str, Array]
    name: str
    notes: tuple[str, ...]
    imported: Import | None

    def __init__(
        self,
        *,
        sample_time: float,
        inputs: ArrayLike,
        outputs: ArrayLike,
        input_names: Sequence[str],
        output_names: Sequence[str],
        start_time: float = 0.0,
        units: Mapping[str, str] | None = None,
        averaged: bool = False,
        ripple: Mapping[str, ArrayLike] | None = None,
        name: str = "",
        notes: Sequence[str] = (),
        imported: Import | None = None,
    ):
        h = positive_number(sample_time, "sample_time", "s")
        t0 = finite_number(start_time, "start_time", "s")
        input_list, output_list = channel_names(input_names, "input_names"), channel_names(output_names, "output_names")
        distinct(input_list, output_list)
        U = channel_matrix(inputs, input_list, "inputs", h, t0)
        Y = channel_matrix(outputs, output_list, "outputs", h, t0)
        same_length(U, Y)
        fields = {
            "sample_time": h,
            "inputs": U,
            "outputs": Y,
            "input_names": input_list,
            "output_names": output_list,
            "start_time": t0,
            "units": channel_units(units, input_list + output_list),
            "averaged": truth(averaged),
            "ripple": ripple_of(ripple, input_list, U.shape[0]),
            "name": text(name, "name"),
            "notes": texts(notes),
            "imported": imported,
        }
        for field, value in fields.items():
            object.__setattr__(self, field, value)  # frozen: this is the one place that writes

    @property
    def n_samples(self) -> int:
        """Number of rows."""
        return int(self.outputs.shape[0])

    @property
    def names(self) -> tuple[str, ...]:
        """All channel names, inputs first."""
        return self.input_names + self.output_names

    @property
    def time(self) -> Array:
        """Time of every row [s]."""
        rows: Array = np.arange(self.n_samples, dtype=np.float64)
        return self.start_time + self.sample_time * rows

    @property
    def duration(self) -> float:
        """Time the record covers [s]: the last input is held for one more sample."""
        return self.n_samples * self.sample_time

    def __len__(self) -> int:
        return self.n_samples

    def __contains__(self, name: object) -> bool:
        return name in self.names

    def __getitem__(self, key: str | slice) -> Any:
        """One channel by name, (n_samples,), or a part of the record by a slice of rows."""
        if isinstance(key, str):
            return self._column(key)
        if isinstance(key, slice):
            return self._rows(key)
        raise InputError(
            f"a record has no item {key!r}",
            where="record[...]",
            expected="a channel name, or a slice of rows",
            remedy="Write record['T1'] or record[100:200].",
        )

    def between(self, start: float, stop: float) -> Record:
        """Rows with start <= time < stop.

        Parameters
        ----------
        start, stop : float
            [s]; may lie outside the record, or be infinite.

        Returns
        -------
        Record
        """
        return self[self._row_at(start, "start") : self._row_at(stop, "stop")]

    def split(self, time: float) -> tuple[Record, Record]:
        """Cut the record in two.

        Parameters
        ----------
        time : float
            The second part starts with the first row that is not earlier [s].

        Returns
        -------
        before, after : Record
        """
        row = self._row_at(time, "time")
        if not 2 <= row <= self.n_samples - 2:
            raise InputError(
                f"time is {time!r} s",
                where="argument time",
                expected=f"a time that leaves two rows on either side, inside {self.start_time:.10g} s ... "
                f"{self.time[-1]:.10g} s",
            )
        return self[:row], self[row:]

    def select(self, inputs: Sequence[str] | None = None, outputs: Sequence[str] | None = None) -> Record:
        """Keep some channels.

        Parameters
        ----------
        inputs, outputs : sequence of str, optional
            Channels to keep, in the order wished; None keeps all. An output may be taken as input and the reverse.

        Returns
        -------
        Record
        """
        ins = self.input_names if inputs is None else channel_names(inputs, "inputs")
        outs = self.output_names if outputs is None else channel_names(outputs, "outputs")
        return self.changed(
            inputs=self._columns(ins),
            outputs=self._columns(outs),
            input_names=ins,
            output_names=outs,
            units={name: unit for name, unit in self.units.items() if name in ins + outs},
            ripple={name: column for name, column in self.ripple.items() if name in ins},
        )

    def with_outputs(self, outputs: ArrayLike, output_names: Sequence[str] | None = None) -> Record:
        """Same inputs, other outputs.

        Parameters
        ----------
        outputs : array_like, shape (n_samples, n_outputs)
            Temperatures of the new outputs [K].
        output_names : sequence of str, optional
            Default: the present ones.

        Returns
        -------
        Record
        """
        names = self.output_names if output_names is None else channel_names(output_names, "output_names")
        units = {name: unit for name, unit in self.units.items() if name in self.input_names + names}
        return self.changed(outputs=outputs, output_names=names, units=units)

    def to_frame(self) -> pd.DataFrame:
        """Copy as a table.

        Returns
        -------
        pandas.DataFrame
            Columns time [s], inputs, outputs.
        """
        return frame(self)

    def save(
        self,
        path: str | Path,
        temperature_unit: Literal["K", "degC"] = "K",
        temperatures: Sequence[str] | None = None,
    ) -> None:
        """Write a file that `read_record` reads back to the last digit.

        Parameters
        ----------
        path : str or Path
            ``.csv``, ``.parquet`` or ``.mat``. Names, numbers and time are written, and that readings are means over
            the sample before, in words that `read_record` finds; units, name and notes are not.
        temperature_unit : {"K", "degC"}, optional
            Unit of the temperatures in the file.
        temperatures : sequence of str, optional
            Which channels are temperatures; default: those whose unit is K. Needed for ``"degC"`` only.
        """
        write(self, Path(path), temperature_unit, temperatures)

    def plot(self) -> NDArray[Any]:
        """Inputs and outputs against time, each unit on axes of its own.

        Returns
        -------
        ndarray of matplotlib.axes.Axes, shape (n,)
            One for each unit of the inputs, then one for each unit of the outputs; two where all share a unit.
        """
        return draw(self)

    def __str__(self) -> str:
        return summary(self)

    def _repr_html_(self) -> str:
        rows = [("samples", f"{self.n_samples} of {self.sample_time:.10g} s")]
        for kind, names in (("input", self.input_names), ("output", self.output_names)):
            for name in names:
                known, unit = self[name][np.isfinite(self[name])], self.units.get(name, "")
                said = f"{known.min():.6g} to {known.max():.6g} {unit}".rstrip() if known.size else "no value"
                rows.append((f"{kind} {name}", said))
        return short_table(f"Record {self.name}".rstrip(), rows, " ".join(self.notes))

    def __repr__(self) -> str:
        title = f"{self.name!r}, " if self.name else ""
        return (
            f"<Record {title}{self.n_samples} samples of {self.sample_time:.10g} s, "
            f"inputs {list(self.input_names)}, outputs {list(self.output_names)}>"
        )

    def _column(self, name: str) -> Array:
        if name in self.input_names:
            return self.inputs[:, self.input_names.index(name)]
        if name in self.output_names:
            return self.outputs[:, self.output_names.index(name)]
        raise InputError(f"there is no channel {name!r}", where="record[...]", remedy=suggestion(name, self.names))

    def _columns(self, names: Sequence[str]) -> Array:
        matrix = np.empty((self.n_samples, len(names)))
        for place, name in enumerate(names):
            matrix[:, place] = self._column(name)
        return matrix

    def _rows(self, rows: slice) -> Record:
        if rows.step not in (None, 1):
            raise InputError(
                f"the step is {rows.step!r}",
                where="record[...]",
                expected="a slice without a step",
                remedy="Dropping rows aliases. Take means over n samples: rt.signals.block_means(record, n).",
            )
        start, stop, _ = rows.indices(self.n_samples)
        if stop - start < 2:
            raise InputError(
                f"rows {start} to {stop} hold {max(stop - start, 0)} samples",
                where="part of a record",
                expected=f"at least two of the {self.n_samples} rows",
            )
        return self.changed(
            inputs=self.inputs[start:stop],
            outputs=self.outputs[start:stop],
            start_time=self.start_time + start * self.sample_time,
            ripple={name: column[start:stop] for name, column in self.ripple.items()},
        )

    def _row_at(self, time: float, where: str) -> int:
        """First row that is not earlier than `time`, clipped to the record."""
        if isinstance(time, (int, float)) and math.isinf(time):
            return 0 if time < 0 else self.n_samples
        offset = (finite_number(time, where, "s") - self.start_time) / self.sample_time
        # 1e-9 of a sample: 0.1 * 3 is not 0.3, but the user means that row.
        return int(min(max(math.ceil(offset - 1e-9 * max(1.0, abs(offset))), 0), self.n_samples))

    def changed(self, **changes: Any) -> Record:
        """Copy with other fields; other inputs have no ripple unless it is given.

        Parameters
        ----------
        **changes
            Arguments of `Record`, by name.
        """
        fields = {field: getattr(self, field) for field in self.__dataclass_fields__}
        if "inputs" in changes:
            fields["ripple"] = None
        return Record(**{**fields, **changes})
