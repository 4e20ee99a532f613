"""Dates as seconds since the first one: zones, summer time, days of a spreadsheet."""

from __future__ import annotations

from zoneinfo import ZoneInfo

import numpy as np
from numpy.typing import NDArray

from ..._pandas import pd
from ...errors import InputError
from ._options import ImportOptions
from ._table import Action, Array, Table, spans
from ._tokens import short

_HOUR = 3_600_000_000_000  # ns
_DAY = 86400.0


def from_days(days: Array) -> pd.DatetimeIndex:
    """Dates of a spreadsheet's day numbers."""
    micro = np.rint(days * _DAY * 1e6).astype(np.int64)
    return pd.DatetimeIndex(np.datetime64("1899-12-30", "us") + micro.astype("timedelta64[us]"))


def since_first(table: Table, header: str, stamps: pd.DatetimeIndex, options: ImportOptions) -> tuple[Array, str]:
    """Seconds since the first stamp, and that stamp as ISO text.

    Parameters
    ----------
    table : Table
        For the lines in messages, and its list of actions.
    header : str
        Of the time column.
    stamps : DatetimeIndex
        Dates with or without a zone, one per row.
    options : ImportOptions
        Import options, of which `timezone` is used.

    Raises
    ------
    InputError
        Missing dates, an hour that is repeated or missing without a zone.
    """
    gone = np.asarray(stamps.isna())
    if gone.any():
        raise InputError(
            f"is empty or no time ({int(gone.sum())} of {len(gone)} rows)",
            where=table.place(int(np.argmax(gone)), header),
            expected="a time in every row",
            remedy="Repair or remove the line.",
        )
    if stamps.tz is None and options.timezone is not None:
        stamps = _localized(table, header, stamps, options.timezone)
        table.actions.append(Action("timezone", 1, f"stamps taken as {options.timezone}", header))
    origin = stamps[0].isoformat()
    zoned = stamps.tz is not None
    whole = stamps.tz_convert("UTC").tz_localize(None) if zoned else stamps
    ns = whole.to_numpy().astype("datetime64[ns]", copy=False).view(np.int64)
    if not zoned:
        _refuse_clock_change(table, header, ns)
    seconds = np.empty(len(ns))
    for part in spans(len(ns)):
        seconds[part] = (ns[part] - ns[0]) / 1e9
    return seconds, origin


def _localized(table: Table, header: str, stamps: pd.DatetimeIndex, zone: str) -> pd.DatetimeIndex:
    """Stamps in a zone; of a repeated hour the first pass is summer time."""
    key = ZoneInfo(zone)
    try:
        return stamps.tz_localize(key, ambiguous="infer")
    except Exception:  # pandas and pytz raise several kinds for hours that are missing or cannot be inferred
        pass
    for summer in (True, False):
        try:
            found = stamps.tz_localize(key, ambiguous=np.full(len(stamps), summer))
        except Exception as error:  # an hour that does not exist in this zone
            raise InputError(
                f"the stamps do not fit the zone {zone}: {short(error, 80)}",
                where=f"{table.where}, column {header!r}",
                expected="stamps that exist in this zone",
                remedy="Correct timezone.",
            ) from None
        if found.is_monotonic_increasing or not summer:
            return found
    return found


def _refuse_clock_change(table: Table, header: str, ns: NDArray[np.int64]) -> None:
    """A step back of an hour, or a missing hour, without a zone: summer time or a true gap, nobody knows."""
    if len(ns) < 2:
        return
    median = float(np.median(np.diff(ns), overwrite_input=True))
    if not 0 < median < 0.5 * _HOUR:
        return
    for offset, what in ((_HOUR, "goes back by one hour"), (-_HOUR, "lacks exactly one hour")):
        for part in spans(len(ns) - 1):
            steps = np.diff(ns[part.start : part.stop + 1])
            found = np.flatnonzero(np.abs(steps + offset - median) <= 0.5 * median)
            if found.size:
                row = part.start + int(found[0]) + 1
                before, after = pd.Timestamp(int(ns[row - 1])), pd.Timestamp(int(ns[row]))
                raise InputError(
                    f"the time {what} (from {before} to {after})",
                    where=table.place(row, header),
                    expected="a declared zone: this looks like a change to or from summer time",
                    remedy='Write timezone = "Europe/Berlin" (yours), or "UTC" if the clock did not change.',
                )
