"""The largest current that can be certified."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from ..errors import InputError, Outcome
from ..thermal import System
from ..verification import Certificate
from ._contraction import METHODS, Method, contraction
from ._energy import energy_rate
from ._jacobian import box_jacobian
from ._sections import Temperatures, region_section
from ._weights import has_weights

Direction = Literal["symmetric", "cooling", "heating"]
_SPAN = {"symmetric": (-1.0, 1.0), "cooling": (0.0, 1.0), "heating": (-1.0, 0.0)}
_HIGHEST = 1e4  # A
_PRECISION = 1e-5


@dataclass(frozen=True)
class CurrentLimit:
    """Largest certified current.

    Parameters
    ----------
    current : float
        Every module may have any current in [-c, c], [0, c] or [-c, 0] [A]; 0 if not even zero current is certified.
    direction : str
        "symmetric", "cooling" or "heating".
    method : str
        Of the certificate.
    certificate : Certificate
        For exactly that range.
    outcome : Outcome
        "certified", or why not.
    """

    current: float
    direction: str
    method: str
    certificate: Certificate
    outcome: Outcome

    def __str__(self) -> str:
        return self.outcome.text


def largest_current(system: System, *, temperature: Temperatures, direction: Direction = "symmetric",
                    method: Method = "energy") -> CurrentLimit:
    """Find the largest current range that can be certified, with its certificate.

    Parameters
    ----------
    system : System
        Network with at least one module.
    temperature : tuple or mapping
        Box as in `contraction` [K].
    direction : {"symmetric", "cooling", "heating"}
        Range [-c, c], [0, c] or [-c, 0], the same for every module.
    method : {"energy", "sum", "max"}
        As in `contraction`.

    Returns
    -------
    CurrentLimit

    Raises
    ------
    InputError
        A system without modules, unknown direction or method, a bad box.

    Examples
    --------
    >>> import robthermal as rt
    >>> limit = rt.certify.largest_current(rt.systems.two_module(), temperature=(278.15, 358.15), direction="cooling")
    >>> round(limit.current, 1), limit.certificate.holds
    (5.5, True)
    """
    if direction not in _SPAN:
        raise InputError(f"direction = {direction!r}", where="argument direction",
                         expected='"symmetric", "cooling" or "heating"')
    if method not in METHODS:
        raise InputError(f"method = {method!r}", where="argument method", expected='"energy", "sum" or "max"')
    if not system.modules:
        raise InputError("the system has no thermoelectric module", where="argument system",
                         remedy="Without modules use rt.certify.contraction with current={}.")

    def holds(c: float) -> bool:
        box = box_jacobian(system, region_section(system, _range(system, direction, c), temperature))
        return energy_rate(box) > 0 if method == "energy" else has_weights(box, method)

    low, high = 0.0, 1.0
    while holds(high) and high < _HIGHEST:
        low, high = high, 2 * high
    while high - low > _PRECISION * high and high < _HIGHEST:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if holds(middle) else (low, middle)
    for back_off in (0.0, 1e-4, 1e-3, 1e-2, 0.05, 1.0):
        c = low * (1 - back_off)
        certificate = contraction(system, current=_range(system, direction, c), temperature=temperature, method=method)
        if certificate.holds:
            return CurrentLimit(c, direction, method, certificate, _outcome(c, direction, method, back_off))
    return CurrentLimit(0.0, direction, method, certificate, Outcome(
        False, "not_certified", f"Not certified, not even without current: {certificate.reason}"))


def _range(system: System, direction: str, c: float) -> dict[str, tuple[float, float]]:
    low, high = _SPAN[direction]
    return {name: (low * c + 0.0, high * c) for name in system.modules}


def _outcome(c: float, direction: str, method: str, back_off: float) -> Outcome:
    given_up = f", {100 * back_off:g} % given up for the proof" if back_off else ""
    return Outcome(True, "certified",
                   f"Certified for {direction} currents up to {c:.4g} A (method {method}{given_up}).")
