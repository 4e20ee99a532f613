"""What would resolve a remainder: which sensor, which input, which lump to split."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ...thermal import System
from ..evidence import Remainder

_NEARLY = 0.9  # of the share of the first lump: its heat explains the remainder as well


@dataclass(frozen=True)
class Resolving:
    """What to measure, or to refine, where something is left beyond the noise.

    Parameters
    ----------
    lump : str
        Lump in which a free heat removes most of the remainder: the one to split.
    sensor : str
        Lump that needs a sensor: the first without one among those that explain it as well; empty if all have one.
    input : str
        Heater or module to drive alone: the nearest to the lump; empty if no input reaches it.
    shortest, longest : float
        Periods of that input that show the remainder: the band that holds most of its power [s].
    others : tuple of str
        Lumps that explain the remainder as well.
    located : bool
        Whether a free heat into that lump removes enough to ask for it to be split.

    Examples
    --------
    >>> import robthermal as rt
    >>> what = rt.diagnosis.Resolving("x3", "", "Q1", 200.0, 3000.0)
    >>> print(what)
    What would resolve it: x3 split in two; Q1 alone, with periods of 200 to 3000 s.
    """

    lump: str
    sensor: str
    input: str
    shortest: float
    longest: float
    others: tuple[str, ...] = ()
    located: bool = True

    def __str__(self) -> str:
        said = [f"{self.lump} split in two"] if self.located else []
        if self.sensor and self.located:
            said.append(f"a sensor at {self.sensor}" + (", which explains it as well" if self.sensor in self.others else
                                                       ""))
        if self.input:
            said.append(f"{self.input} alone, with periods of {_round(self.shortest)} to {_round(self.longest)} s")
        return f"What would resolve it: {'; '.join(said)}." if said else ""

    def to_dict(self) -> dict[str, Any]:
        """As in ``diagnosis.json``.

        Returns
        -------
        dict
        """
        return {"split": self.lump, "sensor": self.sensor or None, "input": self.input or None,
                "periods": [self.shortest, self.longest], "lumps_alike": list(self.others)}


def resolving(rest: Remainder, system: System) -> Resolving | None:
    """What would tell where a remainder comes from; None of one that only validation records leave.

    Parameters
    ----------
    rest : Remainder
        What is left beyond the noise.
    system : System
        Nominal system that was diagnosed.
    """
    if rest.elsewhere:
        return None
    places = [(lump, share) for lump, share in rest.where if lump in system.lumps]
    lump, best = places[0]
    alike = tuple(name for name, share in places[1:] if share >= _NEARLY * best)
    read = {sensor.lump for sensor in system.thermometers.values()}
    unread = [name for name in (lump, *alike) if name not in read]
    return Resolving(lump, unread[0] if unread else "", _nearest_input(system, lump), 1.0 / rest.high, 1.0 / rest.low,
                     alike, rest.located)


def _nearest_input(system: System, lump: str) -> str:
    """Heater or module with the least thermal resistance to a lump; empty if none reaches it."""
    drives: dict[str, tuple[str, ...]] = {name: (one.lump,) for name, one in system.inputs.items() if one.gain}
    drives |= {name: (one.hot, one.cold) for name, one in system.modules.items()}
    nearest = system.nearest_lumps(dict.fromkeys(place for places in drives.values() for place in places)).get(lump)
    return next((name for name, places in drives.items() if nearest in places), "")


def _round(seconds: float) -> str:
    """Two digits, without an exponent up to a million."""
    return f"{float(f'{seconds:.2g}'):g}"
