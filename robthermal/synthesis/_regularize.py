"""Plants without enough weights: channels of their own, as small as they help.

Added outputs and inputs only raise the norm: what a controller reaches with them it also reaches without.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .._arrays import Array
from ..linear import Plant, responder
from ._plant import GeneralizedPlant, to_continuous

_RANK = 1e-9  # relative: a direct path smaller than this is none
_AXIS = 1e-8  # relative distance of a zero from the axis that counts as on it


def lacks_control_weight(plant: GeneralizedPlant) -> bool:
    """Whether some control does not appear in z, at infinite frequency or at a zero on the axis (continuous)."""
    return _lost(plant.A, plant.B2, plant.C1, plant.D12) is not None


def lacks_noise(plant: GeneralizedPlant) -> bool:
    """Whether some measurement is free of disturbance, at infinite frequency or at a zero on the axis (continuous)."""
    return _lost(plant.A.T, plant.C2.T, plant.B1.T, plant.D21.T) is not None


def missing_weights(plant: GeneralizedPlant) -> str:
    """Which weights are missing, at which frequency, and what to add: sentences to follow others; empty: none."""
    work, side = to_continuous(plant) if plant.dt else (plant, 1.0)
    missing = {"control shows in the performance outputs": _lost(work.A, work.B2, work.C1, work.D12),
               "measurement is disturbed": _lost(work.A.T, work.C2.T, work.B1.T, work.D21.T)}
    parts = [f"not every {what} at {_frequency(where, side, plant.dt)}"
             for what, where in missing.items() if where is not None]
    if not parts:
        return ""
    return (f" Weights are missing: {'; '.join(parts)}. Only small channels, added for the design, keep the gains "
            "finite: look at the margins, and add a small multiple of the controls to the performance outputs, or "
            "noise to the measurements.")


def _frequency(value: float, side: float, dt: float) -> str:
    """A frequency on the axis in words; of a sampled plant from that of its continuous image."""
    if not dt:
        return f"{value:.4g} rad/s" if np.isfinite(value) else "infinite frequency (rank of the direct path)"
    angle = 2 * np.arctan(value)
    return f"{(angle if side > 0 else np.pi - angle) / dt:.4g} rad/s"


def with_channels(plant: GeneralizedPlant, size: float, control_weight: bool, noise: bool) -> GeneralizedPlant:
    """Plant with z also `size` times the controls and states, w also `size` times noise on measurements and states.

    Sizes are relative to what controls and disturbances do at the plant's own frequencies.
    """
    n, n_u, n_y = len(plant.A), plant.B2.shape[1], len(plant.C2)
    found = plant
    if control_weight:
        u = size * np.diag(_typical(plant.A, plant.B2, plant.C1, plant.D12))
        x = size * np.eye(n) * _ratio(plant.C1, n)
        found = replace(found, C1=np.vstack([found.C1, np.zeros((n_u, n)), x]),
                        D11=np.vstack([found.D11, np.zeros((n_u + n, found.D11.shape[1]))]),
                        D12=np.vstack([found.D12, u, np.zeros((n, n_u))]))
    if noise:
        y = size * np.diag(_typical(plant.A.T, plant.C2.T, plant.B1.T, plant.D21.T))
        x = size * np.eye(n) * _ratio(plant.B1.T, n)
        found = replace(found, B1=np.hstack([found.B1, np.zeros((n, n_y)), x]),
                        D11=np.hstack([found.D11, np.zeros((len(found.D11), n_y + n))]),
                        D21=np.hstack([found.D21, y, np.zeros((n_y, n))]))
    return found


def _rank_lost(D12: Array) -> bool:
    values = np.linalg.svd(D12, compute_uv=False)
    return len(D12) < D12.shape[1] or bool(values[-1] <= _RANK * values[0])


def _lost(A: Array, B: Array, C: Array, D: Array) -> float | None:
    """Frequency at which a tall system loses rank [rad/s], infinity for its direct path; None where there is none.

    Invariant zeros on the axis come from the zero pencil compressed by the range of D.
    """
    if _rank_lost(D):
        return np.inf
    n = len(A)
    if n == 0:
        return None
    Q, R = np.linalg.qr(D, mode="complete")
    k = D.shape[1]
    feedback = np.linalg.solve(R[:k], Q[:, :k].T @ C)
    own, seen = A - B @ feedback, Q[:, k:].T @ C
    values = np.linalg.eigvals(own)
    sizes: Array = abs(values)
    for value in values[abs(values.real) <= _AXIS * np.maximum(sizes, 1e-3 * float(sizes.max()))]:
        gap = np.linalg.svd(np.vstack([own - 1j * value.imag * np.eye(n), seen]), compute_uv=False)[-1]
        if gap <= _AXIS * max(float(np.linalg.norm(own, 2)), 1e-300):
            return float(abs(value.imag))
    return None


def _typical(A: Array, B: Array, C: Array, D: Array) -> Array:
    """Size of what every input does to the outputs, at frequencies between the slowest and the fastest mode."""
    modes: Array = abs(np.linalg.eigvals(A)) if len(A) else np.ones(1)
    modes = modes[modes > 1e-9 * float(modes.max())]
    middle = float(np.exp(np.log(modes).mean())) if len(modes) else 1.0
    omega = middle * np.geomspace(0.1, 10, 7)
    size = np.linalg.norm(responder(Plant(A, B, C, D, 0.0))(omega * 1.0001), axis=1).max(axis=0)
    top = float(size.max()) if size.any() else 1.0
    return np.maximum(size, 1e-3 * top)


def _ratio(C: Array, n: int) -> float:
    """Size of one state in the outputs, on average."""
    return float(np.linalg.norm(C)) / max(n, 1) or 1.0
