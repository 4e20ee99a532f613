"""Names and ranges of [certify]: what the system does not have, and ends the wrong way round, are refused at once."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from difflib import get_close_matches

from ...errors import InputError
from ...thermal import System

Pair = tuple[float, float]
_LISTED = 12  # names in a message


def check_names(system: System, ranges: Mapping[str, Mapping[str, Pair]], setpoints: Collection[str], where: str,
                adopt: bool) -> None:
    """Refuse names that the system does not have.

    Parameters
    ----------
    system : System
        System whose claims are asked for.
    ranges : mapping
        Ranges of "ambient", "current", "heat" and "parameters", by name.
    setpoints : collection of str
        Modules that have a set-point.
    where : str
        File and table, for the message.
    adopt : bool
        Whether effects may still be added to the system, with parameters and heats of their own.
    """
    known = {"ambient": ("ambient", system.ambient_names), "current": ("module", system.module_names),
             "setpoint": ("module", system.module_names), "heat": ("lump", system.lump_names),
             "parameters": ("parameter", system.parameter_names)}
    for key, names in {**ranges, "setpoint": setpoints}.items():
        kind, there = known[key]
        for name in names:
            if name not in there and not (adopt and key in ("parameters", "heat")):
                near = get_close_matches(name, there, n=1)
                more = f" and {len(there) - _LISTED} more" if len(there) > _LISTED else ""
                raise InputError(f"there is no {kind} {name!r}", where=f"{where} {key}",
                                 expected=f"one of {', '.join(there[:_LISTED]) or 'none'}{more}",
                                 remedy=f"Did you mean {near[0]!r}?" if near else "")


def check_ends(ranges: Mapping[str, Mapping[str, Pair]], temperature: Pair | None, where: str) -> None:
    """Refuse ranges whose lower end is above the upper one.

    Parameters
    ----------
    ranges : mapping
        Ranges of "ambient", "current", "heat" and "parameters", by name.
    temperature : tuple of float or None
        Box of all lumps.
    where : str
        File and table, for the message.
    """
    pairs = {f"{key}.{name}": pair for key, names in ranges.items() for name, pair in names.items()}
    for key, (low, high) in (pairs | ({"temperature": temperature} if temperature else {})).items():
        if low > high:
            raise InputError(f"[{low:g}, {high:g}]", where=f"{where} {key}", expected="[lower, upper]",
                             remedy=f"Write [{high:g}, {low:g}].")
