"""National Instruments TDMS: channels by name, time from a channel or from the waveform increment."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ._checks import Array
from ._source import refuse_large

# What npTDMS raises where it does not know the bytes. OverflowError: a place in the file, or a date.
_UNKNOWN = (ValueError, KeyError, OverflowError, struct.error)
_READING = (*_UNKNOWN, OSError, NotImplementedError)  # also: the disk or the rights to it; kinds of properties
_EXPORT = "Export the channels to CSV."


class TdmsSource:
    """A TDMS file, its list of channels read."""

    def __init__(self, path: Path, max_bytes: float | None):
        nptdms = _require_nptdms()
        self.path = path
        self._library = nptdms
        try:
            described = nptdms.TdmsFile.read_metadata(path)
            self._group = {channel.name: group.name for group in described.groups() for channel in group.channels()}
            found = [channel for group in described.groups() for channel in group.channels()]
        except _READING as error:
            raise _refusal(error, path) from error
        if not found:
            raise InputError("this is no TDMS file, or it holds no channels", where=f"{path}")
        refuse_large(path, 8.0 * sum(len(channel) for channel in found), "bytes unpacked", max_bytes)
        names = [channel.name for channel in found]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise InputError(f"channel {twice!r} stands in several groups", where=f"{path}", remedy="Keep one of them.")
        self._waveforms = {channel.name: _waveform(channel, path) for channel in found}
        self._has_clock = any(name.split("[")[0].strip().lower() == "time" for name in names)
        self._made_time = () if self._has_clock else ("time",)
        started = next((channel.properties.get("wf_start_time") for channel in found), None)
        self.origin = None if started is None else str(started)  # a date, as ISO text
        self.headers = self._made_time + tuple(names)

    def everything(self) -> tuple[dict[str, Any], dict[str, str]]:
        """All numeric channels, time made from the waveform increment where there is none; and what the others are."""
        try:
            with self._library.TdmsFile.open(self.path) as file:
                raw = {name: np.asarray(file[group][name][:]) for name, group in self._group.items()}
        except _READING as error:
            raise _refusal(error, self.path) from error
        columns = {name: np.asarray(column, np.float64) for name, column in raw.items() if column.dtype.kind in "fiu"}
        columns |= {name: column.astype("datetime64[ns]") for name, column in raw.items() if column.dtype.kind == "M"}
        left_out = {name: "text" for name in raw if name not in columns}
        if self._made_time and columns:
            lengths = [len(column) for column in columns.values()]
            n = max(set(lengths), key=lengths.count)
            names = [name for name, column in columns.items() if len(column) == n]
            columns = {"time": self._made(names, n), **columns}
        return columns, left_out

    def _made(self, names: Sequence[str], n: int) -> Array:
        increments = {self._waveforms[name] for name in names}
        if len(increments) > 1:
            raise InputError(
                f"the channels have different increments and offsets: {sorted(increments, key=str)} s",
                where=f"{self.path}",
                expected="one sampling for all channels",
            )
        increment, offset = increments.pop()
        if increment is None or increment <= 0.0:
            raise InputError(
                "there is no time: neither a channel 'time' nor the property wf_increment",
                where=f"{self.path}",
                remedy="Write a channel 'time' [s].",
            )
        rows: Array = np.arange(n, dtype=np.float64)
        return offset + increment * rows


def _refusal(error: Exception, path: Path) -> InputError:
    """What stopped the reader. npTDMS raises the same for damage and for kinds of data it lacks: neither is claimed."""
    if isinstance(error, NotImplementedError):
        return InputError(f"npTDMS does not read this kind of data ({error})", where=f"{path}", remedy=_EXPORT)
    if isinstance(error, OSError):
        return InputError(f"the file cannot be read ({error})", where=f"{path}")
    return InputError(f"this is no TDMS file that npTDMS reads: it has another format, is damaged, or holds a kind of "
                      f"data that npTDMS lacks ({error})", where=f"{path}", remedy=_EXPORT)


def _waveform(channel: Any, path: Path) -> tuple[float | None, float]:
    """Increment and offset of the samples [s]."""
    found: list[float | None] = []
    for name, default in (("wf_increment", None), ("wf_start_offset", 0.0)):
        value = channel.properties.get(name, default)
        if value is not None and not (isinstance(value, int | float | np.number) and np.isfinite(value)):
            raise InputError(f"channel {channel.name!r}: {name} is {value!r}", where=f"{path}",
                             expected="a finite number [s]")
        found.append(None if value is None else float(value))
    return found[0], found[1] or 0.0


def _require_nptdms() -> Any:
    try:
        # Imported here: an optional extra.
        import nptdms
    except ImportError:
        raise InputError(
            "TDMS files need the package npTDMS, which is not installed",
            remedy="Install it with: pip install 'robthermal[tdms]'",
        ) from None
    return nptdms
