"""Losses of a healthy machine by natural convection, where its records say that no conductance is constant.

Most machines without a fan lose their heat by air that moves by itself, and most networks give them constant
conductances. What that leaves of healthy records hides small changes and stands in for large ones. One law for all
losses has no unknown more than constant conductances.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ...errors import Diverged, InputError
from ...thermal import System, constant_losses, natural_losses
from ..evidence import expected_rms, square_beyond_noise
from ..fit import Refit

_CLEARLY = 0.5  # of the mean square beyond noise, that natural convection may leave at most
_CONSTANT = 0.9  # of it, with a single conductance constant again: a fan blows on that part
_LARGE = 0.2  # of the conductance of all losses: a part that a fan cools has that much


@dataclass(frozen=True)
class Convection:
    """Losses taken as natural convection, and what that does to the healthy records.

    Parameters
    ----------
    links : tuple of str
        Names of the links to ambients.
    without, rms : float
        Free-run residual of the fit to the reference records with constant conductances, and as they are taken [K].
    system : System
        Nominal system with these losses.
    """

    links: tuple[str, ...]
    without: float
    rms: float
    system: System

    @property
    def exponent(self) -> float:
        """Power of the difference to which the losses per kelvin grow [-]."""
        return self.system.parameter(f"links.{self.links[0]}.natural.exponent")

    @property
    def own_names(self) -> dict[str, str]:
        """Gains of these losses, and the conductances that the nominal system has in their place."""
        return {f"links.{name}.natural.gain": f"links.{name}.conductance" for name in self.links}

    def __str__(self) -> str:
        several = len(self.links) > 1
        return (f"The loss{'es' * several} along {', '.join(self.links)} {'are' if several else 'is'} taken as natural "
                f"convection, G (|ΔT| / 10 K)^{self.exponent:g} ΔT, here and in the system of the answer: with "
                f"constant conductances the model leaves {self.without:.2g} K of the reference records, so "
                f"{self.rms:.2g} K. Radiation, or anything else by which losses grow, may be the reason.")

    def to_dict(self) -> dict[str, Any]:
        """What ``diagnosis.json`` holds under "convection" of "reference".

        Returns
        -------
        dict
        """
        return {"links": list(self.links), "exponent": self.exponent, "rms_without": self.without, "rms": self.rms}


def convection_of(system: System, fitted: Callable[[System], Refit]) -> Convection | None:
    """Natural convection of all losses that are not constant; None where constant conductances do about as well.

    Parameters
    ----------
    system : System
        Nominal system with constant conductances.
    fitted : callable
        Fits a system to the reference records.
    """
    links = constant_losses(system)
    if not links:
        return None
    plain = fitted(system)
    if not square_beyond_noise(plain) > expected_rms(plain) ** 2:  # nothing to speak of is left
        return None
    best = _or_none(system, links, fitted)
    if best is None or not square_beyond_noise(best) < _CLEARLY * square_beyond_noise(plain):
        return None
    for name in _large(plain.system, links):
        fewer = tuple(one for one in links if one != name)
        fit = _or_none(system, fewer, fitted)
        if fit is not None and square_beyond_noise(fit) < _CONSTANT * square_beyond_noise(best):
            links, best = fewer, fit
    return Convection(links, plain.rms, best.rms, natural_losses(system, links))


def _large(system: System, links: tuple[str, ...]) -> list[str]:
    """Links that take much of the losses, the largest conductance first."""
    G = {name: system.parameter(f"links.{name}.conductance") for name in links}
    return sorted((name for name in links if G[name] >= _LARGE * sum(G.values())), key=lambda name: -G[name])


def _or_none(system: System, links: tuple[str, ...], fitted: Callable[[System], Refit]) -> Refit | None:
    """The fit with these losses by natural convection; None without any, or where it runs away."""
    try:
        return fitted(natural_losses(system, links)) if links else None
    except (Diverged, InputError):
        return None
