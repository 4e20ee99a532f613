"""Upper bounds of the peak-to-peak gain, proven."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import scipy

from .._arrays import Array
from ..verification import Certificate, establish, not_certified
from ._bound import GainBound
from ._levels import plant_norm
from ._stability import coordinates, solve
from ._systems import Plant, made_by, read_plant

# share added to the ellipsoid, and floor of its coordinates, in turn, until the proof holds
_SLACKS = ((1e-8, 1e-9), (1e-5, 1e-7), (1e-4, 1e-5), (1e-3, 1e-4), (1e-2, 1e-3))
_SCAN = 25  # decays tried before the best is refined


def peak(system: Any) -> GainBound:
    """Certify how large the output can get for ever, per largest input, from zero state.

    Euclidean norms at every time. A positive system with one input and output has its gain at frequency zero; for
    every other system an invariant ellipsoid gives a bound (the star norm), which may be cautious.

    Parameters
    ----------
    system : control.StateSpace or control.TransferFunction
        Continuous or sampled.

    Returns
    -------
    GainBound
        ``upper`` is proven, certificate of kind "peak"; ``lower`` is the H-infinity norm, which no peak gain is below.

    Raises
    ------
    InputError
        Another type, numbers that are not finite.

    References
    ----------
    Abedor, Nagpal and Poolla, A linear matrix inequality approach to peak-to-peak gain minimization, Int. J. Robust
    Nonlinear Control 6 (1996); Scherer, Gahinet and Chilali, IEEE Trans. Automatic Control 42 (1997).

    Examples
    --------
    >>> import control, robthermal as rt
    >>> gain = rt.certify.peak(control.ss([[-1.0]], [[1.0]], [[2.0]], 0))  # positive: 2/1
    >>> gain.holds, round(gain.upper, 9)
    (True, 2.0)
    """
    plant = read_plant(system)
    if not plant.stable:
        cert = not_certified("peak", system=plant.section, region={}, evidence={},
                             reason="an eigenvalue of A is not stable: outputs can grow without limit",
                             made_by=made_by("numpy eigenvalues", "not stable"),
                             claim="The peak-to-peak gain is finite.")
        return GainBound(np.inf, np.inf, np.nan, cert)
    lower, frequency = plant_norm(plant)
    if _positive(plant):
        cert = _establish(plant, lower * (1 + 1e-12) or 1e-300, {"method": "positive"}, "gain at zero")
        if cert.holds:
            return GainBound(float(cert.region["bound"]), lower, frequency, cert)
    for evidence, bound, status in ellipsoids(plant):
        cert = _establish(plant, bound, evidence, status)
        if cert.holds:
            break
    return GainBound(float(cert.region["bound"]) if cert.holds else np.inf, lower, frequency, cert)


def _establish(plant: Plant, bound: float, evidence: dict[str, Any], status: str) -> Certificate:
    return establish("peak", system=plant.section, region={"bound": float(bound)}, evidence=evidence, margin={},
                     made_by=made_by("scipy Lyapunov equation, line search", status))


def _positive(plant: Plant) -> bool:
    off = plant.A if plant.dt else plant.A - np.diag(np.diag(plant.A))
    return plant.D.shape == (1, 1) and all((matrix >= 0).all() for matrix in (off, plant.B, plant.C, plant.D))


def ellipsoids(plant: Plant) -> Iterator[tuple[dict[str, Any], float, str]]:
    """Evidence and bound, with more and more slack."""
    best = _best_decay(plant)
    for slack, floor in _SLACKS:
        Q = _ellipsoid(plant, best, slack, floor)
        share, squared = _share(plant, Q, best)
        evidence = {"method": "ellipsoid", "matrix": Q, "decay": best, "share": share}
        yield evidence, np.sqrt(squared) * (1 + 1e-8) or slack, f"slack {slack:g}"


def _best_decay(plant: Plant) -> float:
    """Decay of the smallest bound: the function has one valley in practice; a scan and a refinement find it."""
    values = plant.poles
    if not len(values):
        return 0.5
    most = 1 - abs(values).max() ** 2 if plant.dt else 2 * -values.real.max()

    def squared(log: float) -> float:
        return _share(plant, _smallest(plant, float(np.exp(log))), float(np.exp(log)))[1]

    grid = np.log(most) + np.log(np.geomspace(1e-3, 0.999, _SCAN))
    found = [squared(log) for log in grid]
    k = int(np.argmin(found))
    low, high = grid[max(k - 1, 0)], grid[min(k + 1, _SCAN - 1)]
    found = scipy.optimize.minimize_scalar(squared, bounds=(low, high), method="bounded", options={"xatol": 1e-4})
    return float(np.exp(found.x))


def _smallest(plant: Plant, decay: float) -> Array:
    """Q of the smallest ellipsoid with this decay."""
    Q = solve(_slowed(plant, decay), plant.B @ plant.B.T, bool(plant.dt)) if len(plant.A) else np.zeros((0, 0))
    return np.full_like(plant.A, 1e300) if Q is None else Q


def _ellipsoid(plant: Plant, decay: float, slack: float, floor: float) -> Array:
    """Q a little larger than the smallest, so that the inequality is strict; solved in excited coordinates."""
    A, discrete = _slowed(plant, decay), bool(plant.dt)
    T = coordinates(A, plant.B @ plant.B.T, discrete, floor) if len(A) else None
    if T is None:
        return _smallest(plant, decay)
    own, driven = np.linalg.solve(T, A @ T), np.linalg.solve(T, plant.B)
    Q, more = solve(own, driven @ driven.T, discrete), solve(own, np.eye(len(A)), discrete)
    if Q is None or more is None:
        return _smallest(plant, decay)
    grown: Array = T @ (Q + slack * np.linalg.norm(Q) / np.linalg.norm(more) * more) @ T.T
    return (grown + grown.T) / 2


def _slowed(plant: Plant, decay: float) -> Array:
    return plant.A / np.sqrt(1 - decay) if plant.dt else plant.A + decay / 2 * np.eye(len(plant.A))


def _share(plant: Plant, Q: Array, decay: float) -> tuple[float, float]:
    """Share of the state in the output's inequality, and bound²."""
    state, direct = plant.C @ Q @ plant.C.T / decay, plant.D @ plant.D.T

    def squared(share: float) -> float:
        return float(np.linalg.eigvalsh(state / share + direct / (1 - share)).max())

    if not direct.any():
        return 1 - 1e-9, squared(1 - 1e-9)
    found = scipy.optimize.minimize_scalar(squared, bounds=(1e-9, 1 - 1e-9), method="bounded", options={"xatol": 1e-9})
    return float(found.x), float(found.fun)
