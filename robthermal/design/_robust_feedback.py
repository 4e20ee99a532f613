"""State feedback with integral action for several linear plants at once, by a linear matrix inequality."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from scipy.linalg import expm, solve_discrete_are

from .._control import control
from ..conic import Form, Inequality, inside, largest_margin
from ..errors import InputError, Outcome
from ._constant_gain import ConstantGain
from ._error_box import Interval
from ._modules import Array
from ._numbers import expect, numbers
from ._outcomes import DesignCode
from ._plant import ColdSide, cold_side

_ROUNDS, _ADDED = 12, 3  # of the cutting planes, plants added in each
_BROKEN = 1e-4  # an inequality of matrices of size one is broken by this much: another round
_MOST = 256  # combinations of corners; beyond, all modules alike


@dataclass(frozen=True)
class RobustGain:
    """Gains of v = -K x + z, ż = Ki (r - y), and what is known about them.

    Parameters
    ----------
    K, integral : ndarray
        (m, n) [W/K] and (m, m) [W/(K s)].
    outcome : Outcome
        "designed", or "not_found".
    """

    K: Array
    integral: Array
    outcome: Outcome


def corner_plants(plain: ConstantGain, *, current: Interval, temperature: Interval) -> list[control.StateSpace]:
    """Cold sides that a constant gain leaves at the corners of a box: what the feedback law would have made one plant.

    Parameters
    ----------
    plain : ConstantGain
        From heats v to currents, I = I0 - g (v - v0).
    current : (lower, upper)
        Currents of all modules [A], each on its own.
    temperature : (lower, upper)
        Temperatures of all faces [K], each on its own.

    Returns
    -------
    list of control.StateSpace
        States: the lumps of `cold_side`. Inputs: the heats v, then the hot faces. Outputs: the cold faces. Near a
        corner the cold lump gets g (S x_c - R I) times the heat asked for, and K, S, R and their slopes act on the
        temperatures. All combinations of corners up to 256, beyond that all modules alike.

    Examples
    --------
    >>> import robthermal as rt
    >>> law = rt.design.feedback_linearization(rt.systems.two_module())
    >>> plants = rt.design.corner_plants(rt.design.constant_gain(law, [298.15] * 18), current=(0.0, 1.0),
    ...                                  temperature=(283.15, 313.15))
    >>> len(plants), plants[0].nstates
    (64, 8)
    """
    expect(plain, ConstantGain, "plain", "rt.design.constant_gain")
    plant, m = cold_side(plain.law), len(plain.law.names)
    for name, pair, least in (("current", current, -np.inf), ("temperature", temperature, 150.0)):
        ends = numbers(pair, name)
        if ends.shape != (2,) or not least <= ends[0] <= ends[1]:
            raise InputError(f"{name} = {pair!r}", where=f"argument {name}", expected="(lower, upper) in "
                             + ("kelvin" if least > 0 else "ampere"))
    points = list(product(temperature, temperature, current))  # hot, cold, I of one module
    ways = list(product(points, repeat=m)) if len(points) ** m <= _MOST else [(point,) * m for point in points]
    return [_at_corner(plain, plant, np.array(way)) for way in ways]


def _at_corner(plain: ConstantGain, plant: ColdSide, corner: Array) -> control.StateSpace:
    """One plant; a row hot, cold, current per module. Entries of the errata, chapter 5, rows of the cold lump."""
    hot, cold, current = corner.T
    parts = plain.law.modules.parts
    p = plain.law.modules.properties({name: value for part, row in zip(parts, corner, strict=True)
                                      for name, value in ((part.hot, row[0]), (part.cold, row[1]))})
    dS, dR, dK = (np.array([getattr(part, key).slope for part in parts])
                  for key in ("seebeck", "resistance", "conductance"))
    mean = 0.5 * dK * (hot - cold) + 0.25 * dR * current**2 - 0.5 * dS * cold * current  # by the mean temperature
    share = plain.gain * (p.S * cold - p.R * current)
    drive = plant.B[:, :len(parts)]
    A = plant.A + drive @ np.diag(mean - p.K - p.S * current) @ plant.C
    B = np.hstack([drive * share, drive * (mean + p.K)])
    return control.ss(A, B, plant.C, np.zeros((len(parts), 2 * len(parts))), states=list(plant.lumps),
                      inputs=[*(f"heat of {name}" for name in plain.law.names), *(part.hot for part in parts)],
                      outputs=[part.cold for part in parts])


def robust_gain(plant: ColdSide, plants: Sequence[Any], h: float, w: float, start: tuple[Array, Array]) -> RobustGain:
    """Least bound on the LQR cost that holds for every plant: guaranteed cost, W = P⁻¹, Z = F W.

    minimize tr T, [W, (AW - BZ)ᵀ, (CW)ᵀ, Zᵀ; AW - BZ, W, 0, 0; CW, 0, 1, 0; Z, 0, 0, 1] >= 0 for every plant,
    [T, 1; 1, W] >= 0. For one plant it is the LQR. The inequality is solved for a few plants, those that break it are
    added. Where nothing is found, the gains to start with are returned.
    """
    m, n = len(plant.law.names), len(plant.A)
    G = plant.C @ np.linalg.solve(1j * w * np.eye(n) - plant.A, plant.B[:, :m])
    unit = np.abs(np.diag(G))  # heats in units that move a face by one kelvin at the bandwidth
    pairs = [_augmented(plant, one, h, w, unit) for one in (plant, *plants)]
    weight = np.zeros((2 * m, n + m))
    weight[:m, :n], weight[m:, n:] = plant.C, np.eye(m)
    # in these coordinates the cost of the nominal LQR is |x|²: well scaled, and costs are relative to it
    root = np.linalg.cholesky(solve_discrete_are(*pairs[0], weight.T @ weight, np.eye(m))).T
    pairs = [(root @ A @ np.linalg.inv(root), root @ B) for A, B in pairs]
    F = _guaranteed_cost(pairs, weight @ np.linalg.inv(root))
    factor = np.inf if F is None else _common_decay([A - B @ F for A, B in pairs])
    if F is None or not factor < 1:
        return RobustGain(*start, DesignCode.NOT_FOUND.outcome(
            f"No state feedback was found with one quadratic norm that shrinks for all of the {len(plants)} plants; "
            "these are the gains for the nominal one."))
    F = F @ root
    K, Ki = F[:, :n] / unit[:, None], -F[:, n:] * w / unit[:, None]
    return RobustGain(K, Ki, DesignCode.DESIGNED.outcome(
        f"One quadratic norm shrinks by {factor:.6f} per sample or faster for each of the {len(plants)} plants, "
        "without limits: computed at these plants in floating point, not proven, and not claimed between them."))


def _augmented(plant: ColdSide, one: Any, h: float, w: float, unit: Array) -> tuple[Array, Array]:
    """Sampled plant with integrators of the error, times the bandwidth, and heats in units."""
    m, n = len(unit), len(plant.A)
    if isinstance(one, ColdSide):
        A, B = one.sampled(h)
    elif isinstance(one, control.StateSpace):
        A, B = _sampled(one, h)
    else:
        raise InputError(f"a {type(one).__name__} among the plants", where="argument plants",
                         expected="control.StateSpace or ColdSide", remedy="rt.design.corner_plants makes them.")
    if A.shape != (n, n) or B.shape[0] != n or B.shape[1] < m:
        raise InputError(f"a plant with {len(A)} states and {B.shape[1]} inputs", where="argument plants",
                         expected=f"{n} states, {', '.join(plant.lumps)}, and the {m} heats v first among its inputs")
    whole = np.block([[A, np.zeros((n, m))], [-h * w * plant.C, np.eye(m)]])
    return whole, np.vstack([B[:, :m] / unit, np.zeros((m, m))])


def _sampled(ss: control.StateSpace, h: float) -> tuple[Array, Array]:
    A, B = np.asarray(ss.A, float), np.asarray(ss.B, float)
    if ss.dt:
        if ss.dt is not True and abs(ss.dt - h) > 1e-9 * h:
            raise InputError(f"a plant sampled every {ss.dt:g} s", where="argument plants",
                             expected=f"{h:g} s, or continuous time")
        return A, B
    n, m = B.shape
    both = np.zeros((n + m, n + m))
    both[:n] = np.hstack([A, B]) * h
    exact = expm(both)[:n]
    return exact[:, :n], exact[:, n:]


def _guaranteed_cost(pairs: list[tuple[Array, Array]], weight: Array) -> Array | None:
    used = [0]
    for _ in range(_ROUNDS):
        found = _solve([pairs[i] for i in used], weight)
        if found is None:
            return None
        W, Z = found
        least = np.array([np.linalg.eigvalsh(_bounded(A @ W - B @ Z, W, Z, weight))[0] for A, B in pairs])
        broken = [int(i) for i in np.argsort(least) if least[i] < -_BROKEN and i not in used][:_ADDED]
        if not broken:
            break
        used += broken
    return np.linalg.solve(W, Z.T).T


def _solve(pairs: list[tuple[Array, Array]], weight: Array) -> tuple[Array, Array] | None:
    n, m = pairs[0][1].shape
    i, j = np.triu_indices(n)
    units = np.zeros((len(i), n, n))
    units[np.arange(len(i)), i, j] = units[np.arange(len(i)), j, i] = 1.0
    gains = np.eye(m * n).reshape(m * n, m, n)
    W = np.concatenate([units, np.zeros((m * n + len(i), n, n))])
    Z = np.concatenate([np.zeros((len(i), m, n)), gains, np.zeros((len(i), m, n))])
    T = np.concatenate([np.zeros((len(i) + m * n, n, n)), units])
    one, none = np.eye(n), np.zeros((n, n))
    still = np.diag(np.concatenate([np.zeros(2 * n), np.ones(len(weight) + m)]))
    inequalities = [Inequality(np.block([[none, one], [one, none]]), np.block([[T, 0 * T], [0 * T, W]]))]
    inequalities += [Inequality(still, _bounded(A @ W - B @ Z, W, Z, weight) - still) for A, B in pairs]
    cost = np.concatenate([np.zeros(len(i) + m * n), (i == j).astype(float)])
    point = inside(inequalities, cost)  # near its border the solver often gives up early: what counts is computed later
    found = np.tensordot(point.x, W, 1)
    return (found, np.tensordot(point.x, Z, 1)) if np.linalg.eigvalsh(found)[0] > 0 else None


def _bounded(moved: Array, W: Array, Z: Array, weight: Array) -> Array:
    """The large matrix, or a stack of them."""
    seen, p, m = weight @ W, len(weight), Z.shape[-2]
    n, size = W.shape[-1], 2 * W.shape[-1] + p + m
    out = np.zeros((*W.shape[:-2], size, size))
    out[..., :n, :n] = out[..., n:2 * n, n:2 * n] = W
    for first, block in ((n, moved), (2 * n, seen), (2 * n + p, Z)):
        rows = slice(first, first + block.shape[-2])
        out[..., rows, :n], out[..., :n, rows] = block, np.swapaxes(block, -1, -2)
    ends = np.arange(2 * n, size)
    out[..., ends, ends] = 1.0
    return out


def _common_decay(loops: list[Array]) -> float:
    """Least factor per sample of one quadratic norm found for all closed loops; infinite where none was found."""
    n = len(loops[0])
    eye = np.eye(n)
    found = largest_margin([Form(((0.5 * eye, eye), (-0.5 * M, M))) for M in loops], np.ones((n, n), bool))
    try:
        half = np.linalg.cholesky(found.matrix)
    except np.linalg.LinAlgError:
        return np.inf
    inverse = np.linalg.inv(half)
    return max(float(np.linalg.norm(half.T @ M @ inverse.T, 2)) for M in loops)
