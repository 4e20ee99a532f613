"""What to measure beside the records: a parameter by itself, or what no record holds."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from ...fitting import Ranges
from ..effects import Candidate

_ACCURACY = {"resistance.value": 0.005, "seebeck.value": 0.01}  # four-wire at a known temperature; open-circuit voltage


@dataclass(frozen=True)
class Measurement:
    """A parameter to measure by itself.

    Parameters
    ----------
    parameter : str
        Of the system's fit table.
    accuracy : float
        Standard deviation that was assumed of it, relative [-].
    """

    parameter: str
    accuracy: float

    def __str__(self) -> str:
        how = ("four-wire, at a known temperature" if self.parameter.endswith("resistance.value") else
               "from the open-circuit voltage at two known temperatures")
        return (f"measure {self.parameter} by itself ({how}) to {100 * self.accuracy:.2g} %, and give it to the system "
                "with that sigma in its fit table")


def measurements(ranges: Ranges) -> list[Measurement]:
    """Fitted parameters that can be measured apart: resistance and Seebeck coefficient of a module, electrically."""
    return [Measurement(name, accuracy) for name in ranges.names for ending, accuracy in _ACCURACY.items()
            if name.startswith("modules.") and name.endswith(ending) and " = " not in name]


def instead(candidates: Iterable[Candidate]) -> str:
    """What would show these effects and no aliases of them."""
    return "; ".join(dict.fromkeys(map(_instead, candidates)))


def _instead(candidate: Candidate) -> str:
    return candidate.effect.measure.format(*candidate.where) or candidate.effect.separated_by


def most_informative(worth: Mapping[Measurement, float], least: float) -> Measurement | None:
    """The measurement that is worth most, if it is worth at least as much."""
    best = max(worth, key=lambda option: worth[option], default=None)
    return best if best is not None and worth[best] >= least else None
