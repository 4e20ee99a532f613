"""What `usable_current` returns: the current that may be recommended, and the four bounds it is the least of."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from .._drawing import axes_for
from .._pandas import pd
from ..errors import Outcome
from ..verification import Certificate
from ._sections import Interval

BOUNDS = ("contraction", "box", "runaway", "rating")


@dataclass(frozen=True)
class CurrentBound:
    """One of the four bounds of a usable current.

    Parameters
    ----------
    current : float
        The largest current this bound allows for every module [A]; inf where it does not apply.
    certificate : Certificate or None
        Proof for that current, where there is one.
    basis : {"proven", "computed", "declared"}
        A certificate, a computation without proof, or the system file.
    text : str
        What the bound says, or why it does not apply.
    """

    current: float
    certificate: Certificate | None
    basis: Literal["proven", "computed", "declared"]
    text: str

    def __str__(self) -> str:
        return f"{self.current:.4g} A ({self.basis}): {self.text}"


@dataclass(frozen=True)
class UsableCurrent:
    """The current that every module of a machine may have, and what limits it.

    Parameters
    ----------
    current : float
        Usable current c [A]: every module, at the same time and independently, may have any current in [0, c], [-c, 0]
        or [-c, c]; 0 if none.
    direction : {"cooling", "heating", "symmetric"}
        Which of the three.
    limited_by : {"contraction", "box", "runaway", "rating"}
        Name of the smallest bound.
    limits : dict
        The four bounds by name.
    range : dict
        {module: (lower, upper)} of the headline [A].
    box : dict
        {lump: (lower, upper)} that is never left at the headline [K]; empty if there is none.
    invariance, contraction : Certificate
        The box is never left with the currents of `range`; in it the network contracts.
    outcome : Outcome
        "usable", or "none" and why.
    limiting_parameter : str or None
        With ranges of parameters: the one whose range costs most of the current.
    """

    current: float
    direction: str
    limited_by: str
    limits: dict[str, CurrentBound]
    range: dict[str, Interval]
    box: dict[str, Interval]
    invariance: Certificate
    contraction: Certificate
    outcome: Outcome
    limiting_parameter: str | None = None

    @property
    def holds(self) -> bool:
        """Whether both certificates of the headline hold for a current above zero."""
        return self.outcome.ok

    def table(self) -> pd.DataFrame:
        """The four bounds [A], how each is known, and what each says."""
        rows = {name: (bound.current, bound.basis, bound.text) for name, bound in self.limits.items()}
        return pd.DataFrame.from_dict(rows, orient="index", columns=["current [A]", "basis", "meaning"])

    def __str__(self) -> str:
        amounts = {name: f"{one.current:.4g} A" if one.current < np.inf else "no bound"
                   for name, one in self.limits.items()}
        lines = [f"  {name:<12}{amounts[name]:>11}  {bound.basis}" for name, bound in self.limits.items()]
        return "\n".join([self.outcome.text, *lines])

    def plot(self, ax: Any = None) -> Any:
        """Draw the four bounds as bars, the usable current as a line; returns the matplotlib axes.

        Bars of bounds far beyond the usable current end at the edge of the picture, with their number.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Axes to draw into; default new ones.
        """
        ax = axes_for(ax, figsize=(6.4, 2.4))
        widest = 2.5 * self.current if self.current > 0 else min([b.current for b in self.limits.values()
                                                                  if 0 < b.current < np.inf], default=1.0)
        names = [name for name in BOUNDS if name in self.limits]
        values = [self.limits[name].current for name in names]
        colors = ["C3" if name == self.limited_by else "0.7" for name in names]
        ax.barh(names, np.minimum(values, widest), color=colors)
        for row, value in enumerate(values):
            label = f" {value:.3g} A" if value < np.inf else " no bound"
            inside = value <= 0.8 * widest
            ax.text(value if inside else widest, row, label, va="center", ha="left" if inside else "right")
        ax.axvline(self.current, color="k", lw=1)
        ax.invert_yaxis()
        ax.set(xlim=(0.0, widest), xlabel=f"current, {self.direction} [A]",
               title=f"usable current {self.current:.3g} A, limited by {self.limited_by}")
        return ax
