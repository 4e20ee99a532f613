"""The convex program behind `synthesize`: coefficients of both filters under bounds at many frequencies.

Every closed-loop map is affine in the coefficients (Theorem 6.4 (b)), so norms of them give second-order cones. The one
product, |X̂||Ŷ| in the robustness condition, is replaced by an ellipse inside it that touches it where the last
solution was; a few rounds make the ellipse fit. Frequencies enter as they are needed: solve on few, look on many, add
those where a bound is broken. The caller proves what comes out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..._arrays import Array
from ...conic import NormBounds, smallest_bound
from ..problem import radius

_ROUNDS = 12
_TIGHT = 2e-3  # asked for more than needed, so that frequencies in between may be a little worse
_NONE = 1e-12  # uncertainty that counts as none
_SETTLED, _CALM = 1e-3, 2  # relative change of the objective, and rounds it must last: slow stretches happen


@dataclass(frozen=True)
class Responses:
    """Everything the program needs at the frequencies it may use; filter 0 is X, filter 1 is Y.

    Parameters
    ----------
    basis : ndarray, shape (n, n_f)
        Basis functions, the constant first.
    factor : ndarray, shape (2, n_f)
        Responses of Z1 and Z2.
    signal : ndarray, shape (2, n_f)
        What 1 + X and 1 + Y multiply in weight e12: weight S2 W2, weight S1 W1 [m].
    block : ndarray, shape (2, n_f)
        |D_k2|, |D_k1|: the entries of Delta_k are X̂ D_k2 and Ŷ D_k1.
    envelope : ndarray, shape (2, 2, n_f)
        R, largest |Delta_p|; zero where nothing is uncertain.
    """

    basis: Array
    factor: Array
    signal: Array
    block: Array
    envelope: Array

    def filters(self, coefficients: Array) -> tuple[Array, Array]:
        """X̂, Ŷ (2, n_f) and X, Y (2, n_f)."""
        hats = coefficients @ self.basis
        return hats, hats * self.factor


@dataclass(frozen=True)
class Demands:
    """What is minimized, and below which bounds everything else stays; None: no bound.

    Parameters
    ----------
    objective : str
        "h2" (the quadratic form), "hinf" or "improvement" (the larger of |1+X| and |1+Y|).
    quadratic : tuple of ndarray or None
        R of X and of Y for "h2": the objective is the norm of (R_X [1, x], R_Y [1, y]).
    limited : tuple of ndarray or None
        The same for the quantity that must stay below 1.
    hinf, improvement, radius, product : float or None
        Bounds of |weight [(1+Y)S1W1, (1+X)S2W2]|, of |1+X| and |1+Y|, of rho(|Delta_k| R), and of |XY|.
    free : tuple of bool
        Which of X, Y may differ from zero.
    """

    objective: str
    quadratic: tuple[Array, Array] | None = None
    limited: tuple[Array, Array] | None = None
    hinf: float | None = None
    improvement: float | None = None
    radius: float | None = None
    product: float | None = None
    free: tuple[bool, bool] = (True, True)


@dataclass(frozen=True)
class Solution:
    """Coefficients (2, n), the objective, whether the solver found them and the whole grid meets every bound."""

    coefficients: Array
    value: float
    solved: bool
    feasible: bool
    rounds: int


def solve(responses: Responses, demands: Demands, start: Array | None = None) -> Solution:
    """Minimize the objective; frequencies and ellipses are refined until nothing changes.

    Parameters
    ----------
    responses : Responses
        Maps from coefficients to responses.
    demands : Demands
        What of them.
    start : ndarray, shape (2, n), optional
        Coefficients where the first ellipses touch; default: |X̂| = |Ŷ|.
    """
    n, n_f = responses.basis.shape
    active = np.zeros(n_f, bool)
    active[:: max(1, n_f // 200)] = True
    active[[0, -1]] = True
    touching = Touching.at(responses, demands, start)
    found, calm = Solution(np.zeros((2, n)), np.nan, False, False, 0), 0
    for round_ in range(1, _ROUNDS + 1):
        point = smallest_bound(cones(responses, demands, touching, active), 2 * n)
        if not point.solved:
            # The ellipses of the last round hold its solution: only new frequencies can have made this infeasible.
            return replace(found, solved=False, rounds=round_)
        calm = calm + 1 if abs(point.value - found.value) <= _SETTLED * point.value else 0
        coefficients = point.x.reshape(2, n) * np.array(demands.free)[:, None]
        excess = violations(responses, demands, coefficients, point.value)
        broken = _peaks(excess) & (excess > 1)
        found = Solution(coefficients, point.value, True, not broken.any(), round_)
        if found.feasible and calm >= _CALM:
            break
        active |= broken
        touching = Touching.at(responses, demands, coefficients)
    return found


def violations(responses: Responses, demands: Demands, coefficients: Array, value: float) -> Array:
    """Largest ratio of what is to what may be, at every frequency; above 1: a bound is broken."""
    hats, filters = responses.filters(coefficients)
    ratios = [np.zeros(filters.shape[1])]
    maps = np.linalg.norm((1 + filters) * responses.signal, axis=0)
    if demands.objective == "hinf":
        ratios.append(maps / (value * (1 + _TIGHT)))
    if demands.hinf is not None:
        ratios.append(maps / demands.hinf)
    factors = np.max(np.abs(1 + filters)[list(demands.free)], axis=0)
    if demands.objective == "improvement":
        ratios.append(factors / (value * (1 + _TIGHT)))
    if demands.improvement is not None:
        ratios.append(factors / demands.improvement)
    if demands.radius is not None:
        ratios.append(radius(responses.envelope, *(np.abs(hats) * responses.block)) / demands.radius)
    if demands.product is not None:
        ratios.append(np.abs(filters[0] * filters[1]) / demands.product)
    return np.max(ratios, axis=0)


@dataclass(frozen=True)
class Touching:
    """Weights (2, n_f) of the ellipses w_X |X̂|² + w_Y |Ŷ|² <= 1, for the robustness and for |XY|."""

    robust: Array | None
    product: Array | None

    @classmethod
    def at(cls, responses: Responses, demands: Demands, coefficients: Array | None) -> Touching:
        """Where the filters of these coefficients touch; None: where |X̂| = |Ŷ|."""
        sizes = np.ones((2, responses.basis.shape[1]))
        if coefficients is not None:
            sizes = np.abs(responses.filters(coefficients)[0])
            # A filter near zero would make the ellipse a needle: keep the ratio of its axes within a hundred.
            sizes = np.maximum(sizes, 1e-2 * sizes.max(axis=0) + 1e-9)
        acting = np.array(demands.free)[:, None]  # a filter that is zero anyway leaves the other all the room
        sizes = sizes * acting
        robust = product = None
        if demands.radius is not None:
            limit = demands.radius * (1 - _TIGHT)
            robust = _ellipse(responses.envelope, limit, sizes * responses.block) * responses.block**2 * acting
        if demands.product is not None:
            unit = np.broadcast_to(np.eye(2)[:, :, None], responses.envelope.shape)
            gain = np.abs(responses.factor)
            product = _ellipse(unit, np.sqrt(demands.product * (1 - _TIGHT)), sizes * gain) * gain**2 * acting
        return cls(robust, product)


def _ellipse(envelope: Array, limit: float, sizes: Array) -> Array:
    """Weights w (2, n_f): w_1 a² + w_2 b² <= 1 implies rho <= limit, with equality in the direction of `sizes`.

    rho <= g  iff  a b det R + g (a r21 + b r12) <= g²  (for det R >= 0). The arithmetic-geometric mean makes a b
    convex, a <= (a²/a0 + a0)/2 makes the linear terms quadratic; both are equalities at (a0, b0), the point of the
    boundary along `sizes`. For det R < 0 the product is left out, which is safe.
    """
    (r11, r12), (r21, r22) = envelope
    det = np.maximum(r11 * r22 - r12 * r21, 0.0)
    a, b = np.maximum(sizes, _NONE)
    linear, product = limit * (a * r21 + b * r12), det * a * b
    # (a, b) times `scale` is on the boundary: product scale² + linear scale = limit²
    scale = 2 * limit**2 / np.maximum(linear + np.sqrt(linear**2 + 4 * product * limit**2), _NONE)
    a, b = a * scale, b * scale
    rest = limit**2 - limit * (a * r21 + b * r12) / 2
    return np.array([det * b / (2 * a) + limit * r21 / (2 * a), det * a / (2 * b) + limit * r12 / (2 * b)]) / rest


def cones(responses: Responses, demands: Demands, touching: Touching, active: Array) -> list[NormBounds]:
    """Cones of the program at the active frequencies (a mask), plus the quadratic forms."""
    n = len(responses.basis)
    rows = _affine(responses, active)
    signal = responses.signal[:, active]
    bounds = []
    none, some = np.zeros(active.sum()), np.ones(active.sum())
    if demands.quadratic is not None:
        bounds.append(_quadratic(demands.quadratic, 0.0, 1.0))
    elif demands.objective == "hinf":
        bounds.append(_maps(rows, signal, none, 1.0))
    else:
        bounds += _factors(rows, demands.free, none, 1.0)
    if demands.limited is not None:
        bounds.append(_quadratic(demands.limited, 1 - _TIGHT, 0.0))
    if demands.hinf is not None:
        scaled = signal / (demands.hinf * (1 - _TIGHT))
        bounds.append(_maps(rows, scaled, some, 0.0))
    if demands.improvement is not None:
        bounds += _factors(rows, demands.free, some * demands.improvement * (1 - _TIGHT), 0.0)
    hats = _real_rows(responses.basis[:, active], n)
    for weights in (touching.robust, touching.product):
        if weights is not None:
            used = weights[:, active].max(axis=0) > 1e-8
            scale = np.repeat(np.sqrt(weights[:, active][:, used]), 2, axis=0).T[:, :, None]
            bounds.append(NormBounds(hats[used] * scale, np.zeros((used.sum(), 4)), np.ones(used.sum())))
    for k in (0, 1):
        if not demands.free[k]:
            fixed = np.zeros((1, n, 2 * n))
            fixed[0, :, k * n: (k + 1) * n] = np.eye(n)
            bounds.append(NormBounds(fixed, np.zeros((1, n)), np.zeros(1)))
    return bounds


def _real_rows(functions: Array, n: int) -> Array:
    """Rows (n_f, 4, 2n) of (Re X, Im X, Re Y, Im Y) for functions (n, n_f), or one set for each filter (2, n, n_f)."""
    both = np.broadcast_to(functions, (2, *functions.shape[-2:]))
    rows = np.zeros((functions.shape[-1], 4, 2 * n))
    for k in (0, 1):
        rows[:, 2 * k, k * n: (k + 1) * n] = both[k].real.T
        rows[:, 2 * k + 1, k * n: (k + 1) * n] = both[k].imag.T
    return rows


def _affine(responses: Responses, active: Array) -> Array:
    """Rows of (Re X, Im X, Re Y, Im Y)."""
    functions = responses.factor[:, None, active] * responses.basis[None, :, active]
    return _real_rows(functions, len(responses.basis))


def _factors(rows: Array, free: tuple[bool, bool], bound: Array, slope: float) -> list[NormBounds]:
    """|1+X| and |1+Y| <= bound."""
    one = np.tile([1.0, 0.0], (len(rows), 1))
    return [NormBounds(rows[:, 2 * k: 2 * k + 2], one, bound, slope) for k in (0, 1) if free[k]]


def _maps(rows: Array, signal: Array, bound: Array, slope: float) -> NormBounds:
    """|[(1+X) s_X, (1+Y) s_Y]| <= bound: phases of the signals do not matter."""
    gain = np.repeat(np.abs(signal), 2, axis=0).T
    return NormBounds(rows * gain[:, :, None], gain * np.array([1.0, 0.0, 1.0, 0.0]), bound, slope)


def _quadratic(roots: tuple[Array, Array], bound: float, slope: float) -> NormBounds:
    """|(R_X [1, x], R_Y [1, y])| <= bound + slope t."""
    n = roots[0].shape[1] - 1
    matrix = np.zeros((sum(map(len, roots)), 2 * n))
    matrix[: len(roots[0]), :n], matrix[len(roots[0]):, n:] = roots[0][:, 1:], roots[1][:, 1:]
    return NormBounds(matrix[None], np.concatenate([R[:, 0] for R in roots])[None], np.array([bound]), slope)


def _peaks(values: Array) -> NDArray[np.bool_]:
    """Local maxima, ends included."""
    padded = np.pad(values, 1, constant_values=-np.inf)
    return (values >= padded[:-2]) & (values >= padded[2:])
