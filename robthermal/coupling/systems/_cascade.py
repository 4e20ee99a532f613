"""From zeros, poles and gain to a state space: a chain of first- and second-order sections with exactly these poles."""

from __future__ import annotations

import numpy as np

from ..._arrays import Array
from ..._control import control
from ._zpk import Zpk

Matrices = tuple[Array, Array, Array, Array]


def realize(system: Zpk) -> control.StateSpace:
    """State space of order len(poles), block triangular: its eigenvalues are the given poles.

    Parameters
    ----------
    system : Zpk
        Proper, roots in conjugate pairs.
    """
    chain = _no_states()
    for poles, zeros in grouped(system):
        chain = _series(chain, _section(poles, zeros))
    A, B, C, D = chain
    n = len(A)
    if n:
        B, C = _equal_size(B, C, system.gain)
        A, B, C = _scaled(A, B, C)
    else:
        D = D * system.gain
    return control.StateSpace(A, B, C, D * (system.gain if n else 1.0), system.dt)


def grouped(system: Zpk) -> list[tuple[list[complex], list[complex]]]:
    """Poles and zeros of each section of order one or two.

    Parameters
    ----------
    system : Zpk
        A proper system.
    """
    groups = _pole_groups(system.poles)
    return list(zip(groups, _shared_zeros(groups, system.zeros), strict=True))


def _no_states() -> Matrices:
    return np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), np.ones((1, 1))


def _pole_groups(poles: Array) -> list[list[complex]]:
    """Conjugate pairs, pairs of neighboring real poles, and at most one single real pole."""
    groups = [[p, p.conjugate()] for p in poles if p.imag > 0]
    real = sorted((p for p in poles if p.imag == 0), key=lambda p: p.real)
    groups += [real[k : k + 2] for k in range(0, len(real), 2)]
    return [[complex(p) for p in group] for group in groups]


def _shared_zeros(groups: list[list[complex]], zeros: Array) -> list[list[complex]]:
    """Zeros given to the sections: conjugate pairs first, each root to the nearest section with room.

    Equal zeros go to different sections where they can: a double zero at the origin in one section would cancel to
    rounding over (omega/corner)² there, in two sections only to rounding over omega/corner in each.
    """
    shared: list[list[complex]] = [[] for _ in groups]
    pairs = [[complex(z), complex(z.conjugate())] for z in zeros if z.imag > 0]
    for root in pairs + [[complex(z)] for z in zeros if z.imag == 0]:
        room = [k for k, group in enumerate(groups) if len(group) - len(shared[k]) >= len(root)]
        without = [k for k in room if root[0] not in shared[k]] or room
        nearest = min(without, key=lambda k: min(abs(root[0] - pole) for pole in groups[k]))
        shared[nearest] += root
    return shared


def _section(poles: list[complex], zeros: list[complex]) -> Matrices:
    """Monic section of order one or two, from differences of roots only: close ones keep their digits."""
    direct = float(len(poles) == len(zeros))
    if len(poles) == 1:
        c = (poles[0] - zeros[0]).real if zeros else 1.0
        return np.array([[poles[0].real]]), np.ones((1, 1)), np.array([[c]]), np.array([[direct]])
    sigma, omega = poles[0].real, poles[0].imag
    if omega:  # normal form: x1 = omega u/d, x2 = (lambda - sigma) u/d
        A = np.array([[sigma, omega], [-omega, sigma]])
        C = np.array([_over_pair(sigma, omega, zeros)])
    else:  # x2 = u/(lambda - p2), x1 = x2/(lambda - p1): numerator in Newton's form
        A = np.array([[sigma, 1.0], [0.0, poles[1].real]])
        C = np.array([_over_reals(sigma, poles[1].real, zeros)])
    return A, np.array([[0.0], [1.0]]), C, np.array([[direct]])


def _over_pair(sigma: float, omega: float, zeros: list[complex]) -> list[float]:
    if not zeros:
        return [1.0 / omega, 0.0]
    if len(zeros) == 1:
        return [(sigma - zeros[0].real) / omega, 1.0]
    at_sigma = ((sigma - zeros[0]) * (sigma - zeros[1])).real
    if zeros[0].imag:
        a, b = zeros[0].real, abs(zeros[0].imag)
        at_sigma = (sigma - a) ** 2
        return [(at_sigma + (b - omega) * (b + omega)) / omega, 2 * (sigma - a)]
    return [(at_sigma - omega**2) / omega, (sigma - zeros[0].real) + (sigma - zeros[1].real)]


def _over_reals(p1: float, p2: float, zeros: list[complex]) -> list[float]:
    if not zeros:
        return [1.0, 0.0]
    if len(zeros) == 1:
        return [p1 - zeros[0].real, 1.0]
    value = ((p1 - zeros[0]) * (p1 - zeros[1])).real
    return [value, ((p1 - zeros[0]) + (p2 - zeros[1])).real]


def _series(first: Matrices, second: Matrices) -> Matrices:
    A1, B1, C1, D1 = first
    A2, B2, C2, D2 = second
    A = np.block([[A1, np.zeros((len(A1), len(A2)))], [B2 @ C1, A2]])
    return A, np.vstack([B1, B2 @ D1]), np.hstack([D2 @ C1, C2]), D2 @ D1


def _equal_size(B: Array, C: Array, gain: float) -> tuple[Array, Array]:
    root = float(np.sqrt(abs(gain)))
    return B * root, C * (gain / root if root else 0.0)


def _scaled(A: Array, B: Array, C: Array) -> tuple[Array, Array, Array]:
    """State units, powers of two, that make rows and columns of similar size; no rounding."""
    exponent = np.zeros(len(A))
    off = np.abs(A - np.diag(np.diag(A)))
    for _ in range(20):
        units = 2.0**exponent
        inward = (off * units[None, :] / units[:, None]).sum(axis=1) + np.abs(B[:, 0]) / units
        outward = (off * units[None, :] / units[:, None]).sum(axis=0) + np.abs(C[0]) * units
        known = (inward > 0) & (outward > 0)
        step = np.zeros(len(A))
        step[known] = np.round(0.5 * np.log2(inward[known] / outward[known]) * 0.7)
        if not step.any():
            break
        exponent = exponent + step
    units = 2.0**exponent
    return A * units[None, :] / units[:, None], B / units[:, None], C * units[None, :]
