"""What is known of noisy inputs: instruments beside them, or the variance of their noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from robthermal._arrays import Array
from robthermal.errors import InputError
from robthermal.signals import Record

from .._checks import positive_number


def checked_noise(noise: Mapping[str, Any], names: Sequence[str], inputs: Sequence[Array]) -> Array:
    """Variance of the noise of each input, zero where none is given."""
    _known(noise, names, "noise")
    found = np.array([positive_number(noise[name], f"noise of {name!r}") if name in noise else 0.0 for name in names])
    for i, name in enumerate(names):
        spread = float(np.sqrt(np.mean(np.concatenate([u[:, i] - u[:, i].mean() for u in inputs]) ** 2)))
        if found[i] >= spread:
            raise InputError(f"{found[i]:g} is the whole standard deviation of {name!r}, {spread:.3g}, or more",
                             where=f"noise[{name!r}]", expected="the noise of the sensor alone",
                             remedy="Leave this input out: the record shows nothing of it but noise.")
    return found**2


def with_instruments(instruments: Mapping[str, Any], records: Sequence[Record], *, several: bool) -> list[Array]:
    """Inputs of every record with the noisy ones replaced by their instruments."""
    names = records[0].input_names
    _known(instruments, names, "instruments")
    columns = [record.inputs.copy() for record in records]
    for name, given in instruments.items():
        signals = list(given) if several and isinstance(given, (list, tuple)) else [given]
        if len(signals) != len(records):
            raise InputError(f"{len(signals)} signals for {len(records)} records", where=f"instruments[{name!r}]",
                             expected="one for each record, in a list")
        for column, signal in zip(columns, signals, strict=True):
            column[:, names.index(name)] = _checked(signal, len(column), f"instruments[{name!r}]")
    for name in instruments:
        i = names.index(name)
        if all(np.array_equal(column[:, i], record.inputs[:, i])
               for column, record in zip(columns, records, strict=True)):
            raise InputError(f"the instrument of {name!r} is the input itself", where=f"instruments[{name!r}]",
                             expected="a signal with other noise: a second sensor, or a set-point")
    return columns


def _known(given: Mapping[str, Any], names: Sequence[str], where: str) -> None:
    unknown = [name for name in given if name not in names]
    if unknown:
        raise InputError(f"{', '.join(map(repr, unknown))} is not an input of the record", where=where,
                         expected=", ".join(names))


def _checked(signal: Any, length: int, where: str) -> Array:
    try:
        found = np.asarray(signal, dtype=float)
    except (TypeError, ValueError) as error:
        raise InputError("holds something other than numbers", where=where) from error
    if found.shape != (length,):
        raise InputError(f"has shape {found.shape}", where=where, expected=f"({length},), as the record")
    if not np.isfinite(found).all():
        raise InputError(f"sample {int(np.flatnonzero(~np.isfinite(found))[0])} is not finite", where=where)
    return found
