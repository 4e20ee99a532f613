"""What splitting a lump does to the remainder and the verdict."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from .._html import short_table
from ..errors import Outcome
from ..thermal import System
from ._judge import Verdict


@dataclass(frozen=True)
class Split:
    """One way to split a lump, fitted to the training records.

    Parameters
    ----------
    lump : str
        Lump that is split.
    moved : tuple of str
        What is attached to the other half, as in `rt.thermal.split_lump`.
    rms : float
        Free-run residual of the fit [K].
    """

    lump: str
    moved: tuple[str, ...]
    rms: float

    def __str__(self) -> str:
        away = " and ".join(name.partition(".")[2] for name in self.moved)
        return f"{self.lump} in two parts" + (f", {away} at the other one" if away else "")


@dataclass(frozen=True, eq=False, kw_only=True)
class Refinement:
    """The network with one lump split in two, diagnosed on the same records. An offer: the answer is not changed.

    Parameters
    ----------
    best : Split
        The way to split that leaves the least; `lump` is its lump.
    tried : tuple of Split
        All ways that were tried, the best first.
    conductance : tuple of float
        Between the parts, with its standard deviation [W/K].
    before, after : mapping
        Remainder of the free runs beyond the noise on "train" and, if given, "validation" records [K].
    verdict : str
        Of the diagnosis with the split network.
    effects : tuple of str
        Labels of what it names.
    system : System
        The split network refitted, with these effects.
    outcome : Outcome
        Code "finer"; "not_finer" (not ok) where no split removes enough of the remainder.

    Examples
    --------
    >>> import robthermal as rt
    >>> best = rt.diagnosis.Split("x3", ("sensors.T3",), 0.021)
    >>> split = rt.thermal.split_lump(rt.systems.two_module(), best.lump, best.moved)
    >>> finer = rt.diagnosis.Refinement(
    ...     best=best, tried=(best,), conductance=(1.2, 0.1), before={"train": 0.3}, after={"train": 0.0},
    ...     verdict="consistent", effects=(), system=split.system, outcome=rt.diagnosis.DiagnosisCode.FINER.outcome())
    >>> print(finer.best)
    x3 in two parts, T3 at the other one
    """

    best: Split
    tried: tuple[Split, ...]
    conductance: tuple[float, float]
    before: Mapping[str, float]
    after: Mapping[str, float]
    verdict: Verdict
    effects: tuple[str, ...]
    system: System
    outcome: Outcome

    @property
    def lump(self) -> str:
        """Lump that is split."""
        return self.best.lump

    def __str__(self) -> str:
        return str(self.outcome)

    def _repr_html_(self) -> str:
        rows = [("split", str(self.best)), ("between the parts", "{:.4g} ± {:.2g} W/K".format(*self.conductance)),
                ("verdict", self.verdict)]
        rows += [(f"remainder, {kind}", f"{self.before[kind]:.3g} K before, {self.after[kind]:.3g} K after")
                 for kind in self.before]
        return short_table("Refinement", rows, str(self.outcome))

    def to_dict(self) -> dict[str, Any]:
        """As in ``diagnosis.json``.

        Returns
        -------
        dict
        """
        value, std = self.conductance
        return {"lump": self.lump, "moved": list(self.best.moved), "before": dict(self.before),
                "after": dict(self.after), "verdict": self.verdict, "effects": list(self.effects),
                "conductance": {"value": value, "std": std, "unit": "W/K"}, "helps": self.outcome.ok,
                "tried": [{"lump": one.lump, "moved": list(one.moved), "rms": one.rms} for one in self.tried],
                "text": self.outcome.text}
