"""The structured singular value of a system at every frequency: scalings held constant on intervals, proven there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from robthermal.errors import InputError
from robthermal.linear import frequency_norm, hinf
from robthermal.verification import Certificate

from ..._control import control
from .._outcomes import CouplingCode
from ._blocks import Complex, Real, read_blocks
from ._intervals import Samples, cover
from ._mu import bounds
from ._result import MuBound

_BACK_OFF = (1.01, 1.014, 1.018)  # bounds tried, relative to the largest mu found; 2 % is promised
_CLOSE = 1.02


def mu_bound(sys: Any, blocks: Sequence[Sequence[Any]] | None = None) -> MuBound:
    """Bound the structured singular value over all frequencies, between the grid points too.

    On every interval of an adaptive partition of [0, ∞] (discrete time: [0, pi/dt]) one constant scaling gives
    sigma_max(D_L M D_R⁻¹) < upper. A certificate of kind "frequency" proves it (one full block: kind "hinf").

    Parameters
    ----------
    sys : control.StateSpace
        Stable, continuous or discrete (dt in seconds); p outputs, m inputs.
    blocks : sequence of tuple, optional
        Blocks of Delta (m, p), see `mu`. Omitted: one full block, the H-infinity norm.

    Returns
    -------
    MuBound
        `upper` is proven, and at most 2 % above the largest upper bound that `mu` finds at any frequency; it is inf
        where the certificate does not hold. `lower` is attained at `frequency` by `delta`.

    Raises
    ------
    InputError
        An unstable system, no state space, no sample time, block sizes that do not match.

    Notes
    -----
    Robust stability for every stable Delta of the structure with H-infinity norm at most 1/upper follows (Packard and
    Doyle, Automatica 29 (1993), theorem 4.6). See "Structured singular value" in the explanations.

    Examples
    --------
    >>> import control, robthermal as rt
    >>> M = control.ss([[-1.0, 0.0], [0.0, -1.0]], [[1.0, 0.0], [0.0, 1.0]], [[0.0, 4.0], [1.0, 0.0]], 0)
    >>> b = rt.coupling.mu_bound(M, [("full", 1, 1), ("full", 1, 1)])  # mu = sqrt(4)/|1 + jw|
    >>> round(b.lower, 4), b.upper < 2.04, rt.verify(b.certificate).valid
    (2.0, True, True)
    """
    system = _read_system(sys)
    structure = read_blocks(blocks, (system.ninputs, system.noutputs))
    samples = Samples(system, structure)
    if len(structure.blocks) == 1 and not structure.blocks[0].repeated:
        return _one_block(system, samples)
    samples.search()
    for factor in _BACK_OFF:
        partition = cover(samples, factor)
        certificate = frequency_norm(system, partition.edges, partition.bound, left=_plain(partition.left),
                                     right=_plain(partition.right), blocks=blocks)
        if certificate.holds:
            break
    return _result(samples, partition.bound, certificate)


def _plain(scalings: Complex) -> Complex | Real:
    """Real numbers where all are: shorter files and faster proofs."""
    return scalings if scalings.imag.any() else scalings.real


def _one_block(system: control.StateSpace, samples: Samples) -> MuBound:
    found = hinf(system)
    samples.search()
    samples.add(np.array([found.frequency]))
    return _result(samples, found.upper, found.certificate)


def _result(samples: Samples, upper: float, certificate: Certificate) -> MuBound:
    omega, lower, curve = samples.table()
    worst = int(np.argmax(lower))
    _, _, delta = bounds(samples.at(omega[worst:worst + 1]), samples.structure)
    if not certificate.holds:
        upper = np.inf
        outcome = CouplingCode.NOT_PROVEN.outcome(
            f"No upper bound is proven: {certificate.reason}. The largest one seen is {curve.max():.5g}: an estimate.",
            remedy="Reduce the order of the system and try again.")
    elif upper <= _CLOSE * lower[worst]:
        outcome = CouplingCode.MET.outcome("The upper bound is proven, and within 2 % of a perturbation that is known.")
    else:
        outcome = CouplingCode.GAP.outcome(
            f"The upper bound is proven; the worst perturbation found gives {lower[worst]:.5g}.")
    return MuBound(float(lower[worst]), float(upper), delta[0], outcome, float(omega[worst]), certificate, omega,
                   (lower, curve))


def _read_system(sys: Any) -> control.StateSpace:
    if not isinstance(sys, control.StateSpace):
        raise InputError(f"sys is a {type(sys).__name__}", where="sys", expected="a control.StateSpace",
                         remedy="Convert it with control.ss; for a matrix or a frequency response use rt.coupling.mu.")
    if sys.dt is True:
        raise InputError("sys has no sample time (dt is True)", where="sys",
                         expected="dt = 0 for continuous time, or the sample time in seconds")
    for name in "ABCD":
        if not np.isfinite(np.asarray(getattr(sys, name))).all():
            raise InputError(f"matrix {name} has an entry that is not finite", where="sys", expected="finite numbers")
    poles = np.linalg.eigvals(np.asarray(sys.A)) if sys.nstates else np.zeros(0)
    size = np.abs(poles) - 1 if sys.dt else poles.real
    if (size >= 0).any():
        pole = complex(poles[size.argmax()])
        raise InputError(f"sys is not stable: pole at {pole:.6g}", where="sys",
                         expected="all poles " + ("inside the unit circle" if sys.dt else "in the left half-plane"),
                         remedy="Close the loop first; remove hidden modes (control.minreal).")
    if sys.dt is None:
        return control.StateSpace(sys.A, sys.B, sys.C, sys.D, 0, remove_useless_states=False)
    return sys
