"""The largest current with which a box contracts: one of the four bounds of a usable current, not a limit for use."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, Outcome
from ..thermal import System
from ..verification import Certificate
from ._contraction import METHODS, Method, contraction
from ._energy import energy_rate
from ._jacobian import BoxJacobian, box_jacobian
from ._lyapunov import Structure, best_matrix, block_pattern, check_choice, largest_growth
from ._outcomes import CertifyCode
from ._polytope import MOST, Cuts, polytope
from ._sections import JACOBIAN, Interval, Temperatures, region_section
from ._weights import has_weights

Direction = Literal["symmetric", "cooling", "heating"]
DIRECTIONS = ("cooling", "heating", "symmetric")
_SPAN = {"symmetric": (-1.0, 1.0), "cooling": (0.0, 1.0), "heating": (-1.0, 0.0)}
_HIGHEST = 1e4  # A
_LOWEST = 1e-6
_PRECISION = 1e-5
_PRECISION_MATRIX = 4e-3  # every step may cost seconds
_GIVEN_UP = (0.0, 1e-4, 1e-3, 1e-2, 0.05, 0.15, 0.3, 0.5, 0.75, 1.0)  # the proof may know less than the search


@dataclass(frozen=True)
class CurrentLimit:
    """Contraction limit inside a box; not a limit for use.

    With these currents any two trajectories approach each other as long as both stay in the box. Whether the machine
    stays in it is another question: `usable_current` answers it.

    Parameters
    ----------
    current : float
        The box contracts for all currents in [-c, c], [0, c] or [-c, 0] [A]; 0 if not even for zero current.
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
                    method: Method = "energy", parameters: Mapping[str, Interval] | None = None,
                    structure: Structure = "full", large: bool = False) -> CurrentLimit:
    """Find the contraction limit inside a box, with its certificate; not a limit for use.

    The certificate says that trajectories *in* the box approach each other, not that they stay there: such currents may
    overheat the machine. Which currents it can bear is the question of `usable_current`, of which this is one bound.

    Parameters
    ----------
    system : System
        Network with at least one module.
    temperature : tuple or mapping
        Box as in `contraction` [K].
    direction : {"symmetric", "cooling", "heating"}
        Range [-c, c], [0, c] or [-c, 0], the same for every module.
    method : {"energy", "sum", "max", "lyapunov"}
        As in `contraction`.
    parameters, structure, large
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
        raise InputError(f"method = {method!r}", where="argument method",
                         expected='"energy", "sum", "max" or "lyapunov"')
    if method == "lyapunov":
        check_choice(system, structure, large)
    if not system.modules:
        raise InputError("the system has no thermoelectric module", where="argument system",
                         remedy="Without modules use rt.certify.contraction with current={}.")

    def box(c: float, hull: bool = False) -> BoxJacobian:
        region = region_section(system, current_range(system, direction, c), temperature, parameters,
                                (*JACOBIAN, "inputs"))
        return box_jacobian(system, region, hull=hull)

    if method == "lyapunov":
        low = _matrix_limit(box, block_pattern(system, structure))
    elif method == "energy":
        low, _ = bisect(lambda c: energy_rate(box(c)) > 0)
    else:
        low, _ = bisect(lambda c: has_weights(box(c), method))
    for back_off in _GIVEN_UP:
        c = low * (1 - back_off)
        certificate = contraction(system, current=current_range(system, direction, c), temperature=temperature,
                                  method=method, parameters=parameters, structure=structure, large=large)
        if certificate.holds:
            return CurrentLimit(c, direction, method, certificate, _outcome(c, direction, method, back_off))
    return CurrentLimit(0.0, direction, method, certificate, CertifyCode.NOT_CERTIFIED.outcome(
        f"Not certified, not even without current: {certificate.reason}", remedy=""))


def bisect(holds: Callable[[float], bool], precision: float = _PRECISION) -> tuple[float, float]:
    """Largest current that holds and smallest that does not, close together."""
    low, high = 0.0, 1.0
    while holds(high) and high < _HIGHEST:
        low, high = high, 2 * high
    while high - low > precision * high and _LOWEST < high < _HIGHEST:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low, high


def _matrix_limit(box: Callable[[float, bool], BoxJacobian], pattern: NDArray[np.bool_]) -> float:
    """Between what V = eᵀEe reaches and what frozen eigenvalues allow: few matrix inequalities."""
    if polytope(box(1.0, True)).count > MOST:
        return 0.0
    low, _ = bisect(lambda c: energy_rate(box(c, False)) > 0)
    _, high = bisect(lambda c: largest_growth(polytope(box(c, False))) < 0)
    cuts = Cuts()
    while high - low > _PRECISION_MATRIX * high:
        middle = 0.5 * (low + high)
        found = best_matrix(box(middle, True), pattern, cuts=cuts, first=True)
        low, high = (middle, high) if found is not None and found.rate > 0 else (low, middle)
    return low


def current_range(system: System, direction: str, c: float) -> dict[str, tuple[float, float]]:
    """{module: (lower, upper)} [A] of currents up to c in one direction."""
    low, high = _SPAN[direction]
    return {name: (low * c + 0.0, high * c) for name in system.modules}


def _outcome(c: float, direction: str, method: str, back_off: float) -> Outcome:
    given_up = f", {100 * back_off:g} % given up for the proof" if back_off else ""
    return CertifyCode.CERTIFIED.outcome(
        f"{c:.4g} A, {direction}: contraction limit inside the box; not a limit for use (method {method}{given_up}).",
        remedy="rt.certify.usable_current tells which currents the machine can bear.")
