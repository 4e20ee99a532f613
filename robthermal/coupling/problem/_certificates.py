"""The proofs of a coupling: internal stability, H-infinity norms, and the robust number between grid points."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..._arrays import Array
from ..._control import control
from ...linear import frequency_radius, hinf, hinf_norm, interval_norms, interval_radii, stability
from ...verification import Certificate
from ..factors import Intervals
from ..systems import Response, connected
from ._norms import NORMS

_PROOF_MARGINS = (1.002, 1.01, 1.04)  # first asked for; then, where the proof fails, backed off


@dataclass
class Proofs:
    """Collects numbers and certificates; without `prove` floats only.

    Parameters
    ----------
    prove : bool
        Whether to make certificates.
    certificates : dict of Certificate
        Those made so far that hold, by what they prove.
    failed : list of str
        What could not be proven.
    """

    prove: bool
    certificates: dict[str, Certificate] = field(default_factory=dict)
    failed: list[str] = field(default_factory=list)

    def stable(self, A: Array, dt: float, what: str) -> bool:
        """Whether a state matrix is stable: proven, or by its eigenvalues when nothing is to be proven."""
        if not len(A):
            return True
        if not self.prove:
            roots = np.linalg.eigvals(A)
            return bool(np.all(np.abs(roots) < 1) if dt else np.all(roots.real < 0))
        n = len(A)
        system = control.StateSpace(A, np.zeros((n, 1)), np.zeros((1, n)), [[0.0]], dt, remove_useless_states=False)
        return self._kept(stability(system), what)

    def norm(self, system: control.StateSpace, what: str) -> float:
        """Upper bound of the H-infinity norm at every frequency; the estimate when nothing is to be proven."""
        system = control.StateSpace(*connected(system.A, system.B, system.C, system.D), system.dt,
                                    remove_useless_states=False)
        if not system.nstates:
            return float(np.linalg.norm(system.D, 2))
        if not self.prove:
            return float(hinf_norm(system)[0])
        bound = hinf(system)
        if self._kept(bound.certificate, what):
            return float(bound.upper)
        return float("inf")

    def radius(self, system: control.StateSpace, intervals: Intervals) -> tuple[float, float]:
        """Upper bound of rho(|Delta_k| R) over all frequencies, and where it is about attained [rad/s]."""
        radii = np.asarray(interval_radii(system, intervals.edges, intervals.envelopes))
        worst = float(np.max(radii))
        where = _where(system, intervals, int(np.argmax(radii)))
        if not self.prove:
            return worst, where
        if worst == 0.0:  # one-way coupling without interaction: nilpotent, robust whatever the envelope
            proof = frequency_radius(system, intervals.edges[[0, -1]], intervals.widest(), 1e-6)
            return (0.0 if self._kept(proof, NORMS["robust"].proof) else float("inf")), where
        merged = intervals.merged(radii, worst)
        for margin in _PROOF_MARGINS:
            bound = worst * margin if worst >= 1.0 else min(worst * margin, 0.5 * (1.0 + worst))
            certificate = frequency_radius(system, merged.edges, merged.envelopes, bound)
            if certificate.holds:
                break
        return (bound if self._kept(certificate, NORMS["robust"].proof) else float("inf")), where

    def small_gain(self, system: control.StateSpace, intervals: Intervals, weights: Array) -> float:
        """sup of sigma_max(Delta_k) times the weight of each interval: level sets, not proven."""
        if not np.any(weights) or not np.any(system.C) and not np.any(system.D):
            return 0.0
        floor = np.max(weights) * 1e-12
        scalings = np.maximum(weights, floor)[:, None, None] * np.eye(2)
        return float(np.max(interval_norms(system, intervals.edges, left=scalings))) * _PROOF_MARGINS[0]

    def _kept(self, certificate: Certificate, what: str) -> bool:
        if certificate.holds:
            self.certificates[what] = certificate
        else:
            self.failed.append(f"{what}: {certificate.reason}")
        return bool(certificate.holds)


def _where(system: control.StateSpace, intervals: Intervals, index: int) -> float:
    """Frequency in an interval where rho(|Delta_k| R) is largest [rad/s]."""
    points = intervals.points(index)
    products = np.abs(np.moveaxis(Response(system)(points), -1, 0)) @ intervals.envelopes[index]
    return float(points[np.argmax(np.max(np.abs(np.linalg.eigvals(products)), axis=1))])
