"""The law h(ΔT) = a + b ΔT^c as a result: its values, its links in a system, its picture. Evers (2.13)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .._arrays import Floats
from .._drawing import axes_for
from .._pandas import pd
from ..errors import InputError, Outcome
from ..thermal import Link, Natural, System


@dataclass(frozen=True, eq=False)
class ConvectionLaw:
    """h(ΔT) = a + b ΔT^c.

    Parameters
    ----------
    a, b, c : float
        Coefficients of the law: at rest [W/(m² K)], its rise [W/(m² K^(1+c))], exponent [-].
    covariance : ndarray, shape (3, 3)
        Of (a, b, c), from the scatter of the points; infinite with three points, or where scatter says nothing.
    area : float
        Surface that loses the heat [m²].
    points : pandas.DataFrame
        Per steady plateau: "difference" ΔT, the mean over the surface [K], "coefficient" h [W/(m² K)], "heat" [W],
        "spread" of the temperatures on the body [K].
    outcome : Outcome
        Codes "fitted", "undetermined" (not ok) where the points do not determine all three, "not_uniform" (not ok)
        where the body was taken for one temperature and is not, "not_explained" (not ok) where the model of the body
        does not reproduce the readings.
    """

    a: float
    b: float
    c: float
    covariance: Floats
    area: float
    points: pd.DataFrame
    outcome: Outcome

    def coefficient(self, difference: Any) -> Floats:
        """The law at some temperature differences.

        Parameters
        ----------
        difference : array_like
            Between body and air [K].

        Returns
        -------
        ndarray
            h [W/(m² K)].
        """
        return law_at(np.array([self.a, self.b, self.c]), np.abs(np.asarray(difference, np.float64)))

    def deviation(self, difference: Any) -> Floats:
        """Standard deviation of the law at some temperature differences, to first order in the coefficients.

        Parameters
        ----------
        difference : array_like
            Between body and air, not zero [K].

        Returns
        -------
        ndarray
            [W/(m² K)]; infinite where the covariance is.
        """
        excess = np.abs(np.asarray(difference, np.float64))
        if not np.isfinite(self.covariance).all():
            return np.full(excess.shape, math.inf)
        slope = np.stack([np.ones_like(excess), excess**self.c, self.b * excess**self.c * np.log(excess)], axis=-1)
        return np.sqrt(np.einsum("...i,ij,...j->...", slope, self.covariance, slope))

    def link(self) -> dict[str, Any]:
        """The law as keys of a system's link: conductance [W/K] and natural convection."""
        return _keys(self, self.area)

    def applied(self, system: System, *, ambient: str, film: float) -> System:
        """A system whose links to an ambient follow this law.

        Parameters
        ----------
        system : System
            Its links between lumps and the ambient are films of one coefficient: conductance = film · area.
        ambient : str
            Name of the ambient.
        film : float
            Film coefficient with which these links were made [W/(m² K)].

        Returns
        -------
        System
            Every such link with conductance a · area and natural convection b · area, c.

        Raises
        ------
        InputError
            No such links, or a coefficient that is not positive.
        """
        areas = film_areas(system, ambient, film)
        links = tuple(Link(between=link.between, name=link.name, radiation=link.radiation, step=link.step,
                           follow=link.follow, temperature_law=link.temperature_law,
                           **_keys(self, areas[link.name])) if link.name in areas else link
                      for link in system.links)
        return system.model_copy(update={"links": links})

    def __str__(self) -> str:
        names = zip("abc", (self.a, self.b, self.c), np.sqrt(np.diag(self.covariance)), strict=True)
        return "\n".join([*(f"{name}  {value:.4g} ± {std:.2g}" for name, value, std in names), str(self.outcome)])

    def plot(self, ax: Any = None) -> Any:
        """Coefficient of every plateau and the law with its 95 % band, like Evers figure 2.11; returns the axes.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Axes to draw into; default new ones.
        """
        ax = axes_for(ax)
        grid = np.linspace(0.0, 1.05 * float(self.points["difference"].max()), 200)[1:]
        ax.plot(self.points["difference"], self.points["coefficient"], "s", label="plateaus")
        line, = ax.plot(grid, self.coefficient(grid), label="a + b ΔT^c")
        if np.isfinite(self.covariance).all():
            low, high = (self.coefficient(grid) + side * 1.96 * self.deviation(grid) for side in (-1, 1))
            ax.fill_between(grid, low, high, alpha=0.25, color=line.get_color())
        ax.set(xlabel="difference to the air [K]", ylabel="film coefficient [W/(m² K)]")
        ax.legend()
        return ax


def law_at(p: Floats, excess: Floats) -> Floats:
    """a + b ΔT^c of p = (a, b, c)."""
    return np.asarray(p[0] + p[1] * excess ** p[2], np.float64)


def film_areas(system: System, ambient: str, film: float) -> Mapping[str, float]:
    """Areas [m²] of the links between lumps and an ambient, by name, from the coefficient they were made with."""
    if not (math.isfinite(film) and film > 0):
        raise InputError(f"film = {film!r}", where="argument film", expected="a positive number [W/(m² K)]")
    links = [link for link in system.links if ambient in link.between and link.conductance > 0]
    if not links:
        raise InputError(f"no lump loses heat to {ambient!r}", where="argument ambient",
                         expected="an ambient of the system with links: " + (", ".join(system.ambients) or "none"),
                         remedy="Give the rods of the Assembly a convection, and the same number as film.")
    natural = [link.name for link in links if link.natural is not None]
    if natural:
        raise InputError(f"link {natural[0]!r} has natural convection already", where="argument system",
                         expected="films of one constant coefficient")
    return {link.name: link.conductance / film for link in links}


def _keys(law: ConvectionLaw, area: float) -> dict[str, Any]:
    natural = Natural(gain=law.b * area, exponent=law.c)
    return {"conductance": law.a * area, "natural": natural.model_dump()}
