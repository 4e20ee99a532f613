"""Observer gains from one linear matrix inequality: a quadratic norm in which the error decays over a whole box.

In coordinates √E e the error obeys e⁺ = (A - L C + Σ B_j D_j S_j) e, D_j the slopes of module j, anywhere in the hull
of a few corners. A multiplier Π_j per module takes the corners out of the large inequality, and then the gain can be
eliminated from it (proof: docs/explanations/observers.md). What is left is linear in P and Π and small.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..conic import Inequality, inside
from ..errors import InputError, Outcome
from ._error_box import Block
from ._modules import Array
from ._observer_model import ObserverModel
from ._outcomes import DesignCode

_LARGEST = 40  # lumps: the time grows with their sixth power
_KEPT = 0.5  # share of the margin that a gain nearer to the wanted one must leave
_DIGITS = 7  # of the gain


@dataclass(frozen=True)
class Norm:
    """A norm for which some gain makes the error decay, as computed in floating point.

    Parameters
    ----------
    margin : float
        By how much V = eᵀPe falls per unit of |e|², with P <= I; not positive where nothing was found.
    factor : float
        Of the decay asked for: V⁺ < factor² V.
    matrix, storage : ndarray, shapes (n, n) and (n + 2 m, n + 2 m)
        P, and Φ = diag(factor² P, 0) - multipliers of the m modules.
    model : ndarray, shape (n, n + 2 m)
        Error dynamics side by side, [A, B].
    reads : ndarray, shape (n_sensors, n + 2 m)
        Sensor matrix side by side with zeros, [C, 0].
    """

    margin: float
    factor: float
    matrix: Array
    storage: Array
    model: Array
    reads: Array

    def central_gain(self) -> Array:
        """The gain that decays fastest in this norm."""
        reach = np.linalg.solve(self.storage, self.reads.T)
        return np.linalg.solve(self.reads @ reach, (self.model @ reach).T).T

    def left(self, gain: Array) -> float:
        """Margin that a gain leaves: V⁺ <= (factor² - left) V over the box where it is positive."""
        M = self.model - gain @ self.reads
        return float(np.linalg.eigvalsh(self.storage - M.T @ self.matrix @ M)[0])


def find_norm(model: ObserverModel, found: list[Block], factor: float) -> Norm:
    """Solve the inequality for a decay by `factor` per sample over the box of the blocks.

    With Φ = diag(c²P, 0) - Σ [S_j 0; 0 1]ᵀ Π_j [S_j 0; 0 1] and N a basis of the kernel of [C 0]: P <= I, Φ >= t,
    Nᵀ(Φ - [A B]ᵀ P [A B])N >= t, and [1; D]ᵀ Π_j [1; D] >= 0 at every corner D of module j.
    """
    n, faces = len(model.A_d), 2 * len(found)
    if n > _LARGEST:
        raise InputError(f"{n} lumps", where='argument method = "lmi"', expected=f"at most {_LARGEST} lumps",
                         remedy='Reduce the system (rt.thermal.reduce), or use method "kalman" or "positive".')
    root = np.sqrt(model.equations.capacity)
    A, C = model.A_d * root[:, None] / root, model.C / root
    B, S, corners = np.zeros((n, faces)), np.zeros((faces, n)), []
    for j, block in enumerate(found):
        own, lumps = slice(2 * j, 2 * j + 2), [block.a, block.b]
        middle = 0.5 * (block.hull.max(axis=0) + block.hull.min(axis=0))
        size = np.abs(block.hull - middle).max() or 1.0
        B[:, own] = model.Gamma[:, lumps] * root[:, None] * size
        S[own, lumps] = np.diag(1 / root[lumps])
        A += B[:, own] @ (middle / size) @ S[own]
        corners.append(np.unique((block.hull - middle) / size, axis=0))
    both = np.block([[S, np.zeros((faces, faces))], [np.zeros((faces, n)), np.eye(faces)]])
    whole, reads = np.hstack([A, B]), np.hstack([C, np.zeros((len(C), faces))])
    form = _symmetric(n)
    multipliers = [_symmetric(4)] * len(found)
    grown = np.zeros((len(form), n + faces, n + faces))
    grown[:, :n, :n] = factor**2 * form
    taken = [_congruent(unit, both[_rows(j, faces)]) for j, unit in enumerate(multipliers)]
    storage = np.concatenate([grown, *(-part for part in taken)])
    kernel = np.linalg.svd(reads)[2][len(C):].T
    held = storage.copy()
    held[:len(form)] -= _congruent(form, whole)
    size, still = len(storage), np.zeros((n, n))
    inequalities = [Inequality(np.zeros((n + faces,) * 2), storage, 1.0),
                    Inequality(np.zeros((kernel.shape[1],) * 2), _congruent(held, kernel), 1.0),
                    Inequality(np.eye(n), np.concatenate([-form, np.zeros((size - len(form), *still.shape))]))]
    for j, (unit, own_corners) in enumerate(zip(multipliers, corners, strict=True)):
        first = len(form) + j * len(unit)
        for D in own_corners:
            slopes = np.zeros((size, 2, 2))
            slopes[first:first + len(unit)] = _congruent(unit, np.vstack([np.eye(2), D]))
            inequalities.append(Inequality(np.zeros((2, 2)), slopes))
    point = inside(inequalities)
    P, Phi = (np.tensordot(point.x[:len(parts)], parts, 1) for parts in (form, storage))
    least = min(_least(one, point.x) for one in inequalities)  # what the solver says is not believed
    value = point.value if np.isfinite(point.value) and least > -1e-6 * max(point.value, 0.0) else -np.inf
    return Norm(value, factor, P, Phi, whole, reads)


def nearest_gain(norm: Norm, model: ObserverModel, wanted: Array) -> tuple[Array, float]:
    """Gain nearest to a wanted one, on the way to the fastest, that keeps half of the margin; and what it leaves.

    The gains that leave a margin are a convex set: the bisection finds its border.
    """
    root = np.sqrt(model.equations.capacity)[:, None]
    far, near = norm.central_gain(), root * wanted
    enough = _KEPT * norm.left(far)

    def at(share: float) -> Array:
        return _rounded((near + share * (far - near)) / root)

    low, high = 0.0, 1.0
    if norm.left(root * at(0.0)) >= enough:
        high = 0.0
    while high - low > 1e-4:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if norm.left(root * at(middle)) >= enough else (middle, high)
    return at(high), norm.left(root * at(high))


def robust_gain(model: ObserverModel, found: list[Block], factor: float, wanted: Array) -> tuple[Array, Outcome]:
    """Gain near a wanted one that decays by `factor` per sample over the box; the wanted one where none was found."""
    norm = find_norm(model, found, factor)
    gain, left = nearest_gain(norm, model, wanted) if norm.margin > 0 else (wanted, 0.0)
    if not left > 0:
        asked = f" by {factor:.6g} per sample" if factor < 1 else ""
        return wanted, DesignCode.NOT_CONTRACTING.outcome(
            f"On {', '.join(model.sensors)} no gain was found with which the error decays{asked} in one quadratic norm "
            "over this box; this is the Kalman gain.")
    reached = float(np.sqrt(factor**2 - left))
    return gain, DesignCode.DESIGNED.outcome(
        f"In one quadratic norm the error decays at least by {reached:.7f} per sample over the box, as computed here "
        "in floating point: .certify(current, temperature) proves it.")


def helpful_sensors(model: ObserverModel, found: list[Block], factor: float) -> list[str]:
    """Further sensors of the system each of which, added alone, lets the error decay; the most helpful first."""
    system = model.system
    taken = {system.sensors[name].lump for name in model.sensors}
    quick = [name for name, sensor in system.thermometers.items()
             if sensor.lump not in taken and sensor.time_constant + sensor.delay <= model.sample_time]
    margin = {name: find_norm(ObserverModel.of(system, [*model.sensors, name], model.sample_time), found, factor).margin
              for name in quick}
    return sorted((name for name in quick if margin[name] > 0), key=lambda name: -margin[name])


def _rounded(gain: Array) -> Array:
    """Seven digits of the largest entry of every column: short in a certificate, and nothing is lost."""
    places = _DIGITS - 1 - np.floor(np.log10(np.abs(gain).max(axis=0) + 1e-300)).astype(int)
    return np.column_stack([np.round(column, place) for column, place in zip(gain.T, places.tolist(), strict=True)])


def _rows(j: int, faces: int) -> list[int]:
    """Temperatures and heats of module j."""
    return [2 * j, 2 * j + 1, faces + 2 * j, faces + 2 * j + 1]


def _symmetric(n: int) -> Array:
    """Unit matrices of the symmetric ones, (n (n + 1)/2, n, n)."""
    i, j = np.triu_indices(n)
    units = np.zeros((len(i), n, n))
    units[np.arange(len(i)), i, j] = units[np.arange(len(i)), j, i] = 1.0
    return units


def _congruent(matrices: Array, T: Array) -> Array:
    """TᵀMT of every matrix."""
    return T.T @ matrices @ T


def _least(one: Inequality, x: Array) -> float:
    return float(np.linalg.eigvalsh(one.constant + np.tensordot(x, one.slopes, 1))[0])
