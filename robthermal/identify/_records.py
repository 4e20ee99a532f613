"""What every estimator asks of its records before any arithmetic, and the spectra it works on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import combinations_with_replacement
from typing import Any

import numpy as np

from robthermal._arrays import Array
from robthermal.errors import InputError
from robthermal.signals import Record

from ._threads import run_all

_SILENT = 1e-12  # standard deviation relative to the largest value, below which a signal is constant to rounding
_LEVEL = 1e3 * np.finfo(float).eps  # of the largest value: a line below it may be nothing but rounding
_SIDE_BY_SIDE = (50_000, 2_000_000)  # samples between which channels are transformed together: time against memory
_COPIES = 1e-12  # squared relative distance below which inputs are linear combinations of each other


def as_records(records: Any) -> tuple[Record, ...]:
    """One record or a sequence of records as a tuple whose channels and sample time agree."""
    if isinstance(records, Record):
        found: tuple[Any, ...] = (records,)
    elif isinstance(records, (list, tuple)):
        found = tuple(records)
    else:
        raise _not_a_record(records, "records")
    if not found:
        raise InputError("the list of records is empty", where="records", expected="at least one rt.Record")
    for place, record in enumerate(found):
        if not isinstance(record, Record):
            raise _not_a_record(record, f"records[{place}]")
        if record.averaged:
            raise InputError("the readings are means over every sample", where=f"records[{place}]",
                             expected="readings at the samples: a mean is half a sample late, and attenuates",
                             remedy="Log samples for a frequency response; calibrate and diagnose take this record.")
        _check_alike(found[0], record, place)
    for names, kind in ((found[0].input_names, "input"), (found[0].output_names, "output")):
        if not names:
            raise InputError(
                f"the record has no {kind}", where=f"{kind}s", remedy=f"A frequency response needs at least one {kind}."
            )
    return found


def _not_a_record(value: Any, where: str) -> InputError:
    return InputError(
        f"got {type(value).__name__}",
        where=where,
        expected="an rt.Record, or a list of them",
        remedy="Build one with rt.Record(sample_time=, inputs=, outputs=, input_names=, output_names=).",
    )


def _check_alike(first: Record, record: Record, place: int) -> None:
    if abs(record.sample_time - first.sample_time) > 1e-9 * first.sample_time:
        raise InputError(
            f"sample_time is {record.sample_time!r} s, that of records[0] is {first.sample_time!r} s",
            where=f"records[{place}]",
            expected="one sample time in all records",
            remedy="Resample one of them first.",
        )
    for kind in ("input_names", "output_names"):
        mine, theirs = list(getattr(record, kind)), list(getattr(first, kind))
        if mine != theirs:
            raise InputError(
                f"{kind} are {mine}, those of records[0] are {theirs}",
                where=f"records[{place}]",
                expected="the same channels in the same order in all records",
                remedy="Use record.select(inputs=[...], outputs=[...]).",
            )


def mean_inputs(records: Sequence[Record]) -> dict[str, float]:
    """Mean of every input over all samples of all records: the operating point of an experiment.

    Parameters
    ----------
    records : sequence of Record
        Records of one experiment with the same inputs, at least one.

    Returns
    -------
    dict
        Input name: mean in the unit of the record, ambients [K].

    Examples
    --------
    >>> import robthermal as rt
    >>> r = rt.Record(sample_time=1.0, inputs=[1.0, 3.0], outputs=[300.0, 300.0], input_names=["q"], output_names=["T"])
    >>> rt.identify.mean_inputs([r])
    {'q': 2.0}
    """
    n = sum(len(record) for record in records)
    return {name: float(sum(record[name].sum() for record in records)) / n for name in records[0].input_names}


def check_excitation(signals: Sequence[Array], names: Sequence[str], *, where: str = "inputs") -> None:
    """Refuse signals (each (n, n_u), one per experiment) that are constant, or combinations of each other."""
    gram, varies = np.zeros((len(names), len(names))), np.zeros(len(names), dtype=bool)
    for signal in signals:
        own, largest = _gram(signal)
        gram += own
        varies |= np.sqrt(np.diag(own) / len(signal)) > _SILENT * largest
    for i, name in enumerate(names):
        if not varies[i]:
            raise InputError(
                f"{name!r} is constant ({signals[0][0, i]:g} throughout): it does not excite the system",
                where=where,
                expected="a signal that varies in at least one record",
                remedy="Excite it (multisine, noise, staircase), or leave it out with record.select(inputs=[...]).",
            )
    scale = np.sqrt(np.diag(gram))
    values, vectors = np.linalg.eigh(gram / np.outer(scale, scale))
    if values[0] < _COPIES:
        # The null vector names the inputs that take part in the combination.
        involved = [name for name, part in zip(names, vectors[:, 0], strict=True) if abs(part) > 1e-3]
        raise InputError(
            f"{', '.join(map(repr, involved))} are copies or linear combinations of each other at all frequencies",
            where=where,
            expected="inputs that vary independently",
            remedy="Excite them with different phases, or in separate records passed as a list.",
        )


def _gram(signal: Array) -> tuple[Array, Array]:
    """Products of the deviations from the mean (n_u, n_u), and largest absolute values (n_u,), of a signal (n, n_u)."""
    n, channels = signal.shape
    centered, largest = np.empty((channels, n)), np.empty(channels)  # numbers of a channel lie side by side

    def center(c: int) -> None:
        centered[c] = signal[:, c]
        largest[c] = _most(centered[c])
        centered[c] -= centered[c].mean()

    run_all(center, range(channels), worth=channels > 1 and n > _SIDE_BY_SIDE[0])
    gram = np.empty((channels, channels))
    for i, j in combinations_with_replacement(range(channels), 2):  # a product of two rows is three times as fast so
        gram[i, j] = gram[j, i] = centered[i] @ centered[j]
    return gram, largest


@dataclass(frozen=True)
class Spectrum:
    """DFT of one record, normalized by 1/sqrt(N), bins 1 ... (N-1)//2: Evers (4.2). Bin 0 and Nyquist are left out."""

    U: Array  # (n_u, F)
    Y: Array  # (n_y, F)
    n_samples: int
    rounding: Array = field(default_factory=lambda: np.empty(0))  # (n_y,): lines of Y below may be nothing but that

    @property
    def n_bins(self) -> int:
        return int(self.U.shape[1])


def spectrum_of(inputs: Array, outputs: Array) -> Spectrum:
    """Spectra of the deviations from the mean; input bins that hold rounding errors only are set to exactly zero."""
    n, n_u, n_y = len(inputs), inputs.shape[1], outputs.shape[1]
    whole = np.empty((n_u + n_y, n // 2 + 1), dtype=complex)
    spectra, level = whole[:, 1 : (n - 1) // 2 + 1], np.empty(n_u + n_y)

    def transform(c: int) -> None:  # channel by channel: a record of ten million samples must not be copied whole
        column = np.array(inputs[:, c] if c < n_u else outputs[:, c - n_u])
        level[c] = _LEVEL * _most(column)
        column -= column.mean()
        np.fft.rfft(column, norm="ortho", out=whole[c])
        if c < n_u:
            row = spectra[c]
            if np.abs(row.view(float)).min(initial=np.inf) <= level[c]:  # else no line is so small
                row[np.abs(row) <= level[c]] = 0.0

    run_all(transform, range(n_u + n_y), worth=_SIDE_BY_SIDE[0] < n < _SIDE_BY_SIDE[1])
    return Spectrum(U=spectra[:n_u], Y=spectra[n_u:], n_samples=n, rounding=level[n_u:])


def rounding_level(signals: Array) -> Array:
    """Size of a spectral line, per channel of `signals` (n, channels), that may be nothing but rounding."""
    return np.array([_LEVEL * _most(column) for column in signals.T])  # by column: many times faster than axis=0


def _most(column: Array) -> float:
    """Largest absolute value."""
    return float(max(column.max(), -column.min()))


def rounding_of(signals: Sequence[Array]) -> Array:
    """The largest rounding level per channel over several records."""
    return np.max([rounding_level(one) for one in signals], axis=0)
