"""The dual-Youla parameter of measured plants, of one channel or several in each subsystem."""

from __future__ import annotations

from typing import Any

from ...errors import InputError
from ._coprime import coprime
from ._frf import Measured
from ._matrix_factors import matrix_factors
from ._matrix_uncertainty import matrix_uncertainty
from ._uncertainty import Uncertainty, from_factors


def dual_youla(P_frf: Measured, P0: Any, K0: Any, *, confidence: float = 0.95,
               measured_in_closed_loop: bool = False) -> Uncertainty:
    """Delta_p = (Dk + P_frf Nk)⁻¹ (P_frf - P0) Dp of measured plants, Evers (6.21) corrected.

    Parameters
    ----------
    P_frf : 2x2 frequency response, or list of them
        Measured plants: python-control FRD [rad/s] or the result of rt.identify [Hz], on one frequency grid. Of
        subsystems with several inputs and outputs: all of subsystem 1, then of 2.
    P0, K0 : 2x2 StateSpace or TransferFunction, or pairs
        Model and controllers, diagonal; or pairs of state spaces of any size.
    confidence : float
        Probability that all true values are in the confidence circles at once, for responses with covariance.
    measured_in_closed_loop : bool
        Whether the plants were measured while K0 controlled them and stayed bounded: then K0 stabilizes them, and no
        encirclement is counted.

    Returns
    -------
    Uncertainty
        Samples and envelope at the frequencies that are decided; see the documentation, "Coupling".

    Raises
    ------
    InputError
        For an unstable nominal loop, a grid too coarse for a resonance of P0 or not covering it, a measured plant
        that K0 does not stabilize, or of which its confidence set does not tell, NaN or wrong shapes.

    Examples
    --------
    See :class:`Uncertainty`.

    >>> import robthermal as rt
    >>> rt.coupling.dual_youla.__name__
    'dual_youla'
    """
    if _has_matrices(P0) or _has_matrices(K0):
        return matrix_uncertainty(P_frf, matrix_factors(*_pair(P0, "P0"), *_pair(K0, "K0")), "P_frf", confidence,
                                  measured_in_closed_loop)
    return from_factors(P_frf, coprime(P0, K0), "P_frf", confidence, measured_in_closed_loop)


def _has_matrices(systems: Any) -> bool:
    """Whether a pair holds a system of more than one input or output."""
    return isinstance(systems, (tuple, list)) and any(
        (getattr(one, "ninputs", 1), getattr(one, "noutputs", 1)) != (1, 1) for one in systems)


def _pair(systems: Any, where: str) -> tuple[Any, Any]:
    if not isinstance(systems, (tuple, list)) or len(systems) != 2:
        raise InputError(f"{type(systems).__name__} beside subsystems of several inputs and outputs", where=where,
                         expected="a pair of systems")
    return systems[0], systems[1]
