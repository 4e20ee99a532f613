"""Robust performance: D-K iteration, and a proven bound of the structured singular value at every frequency."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from .._arrays import Array
from .._checks import quoted, whole_number
from .._control import control
from ..coupling import mu, mu_bound
from ..errors import InputError, Outcome
from ..linear import Plant, close, prove_closed_loop, responder
from ..verification import Certificate
from ._arguments import state_space
from ._design import Design, RobustAgainst, as_system, named, zero_controller
from ._hinf import best_of
from ._outcomes import SynthesisCode
from ._plant import GeneralizedPlant, chosen, read_generalized, split, to_continuous, to_sampled
from ._reduce import shortened
from ._scalings import Sizes, diagonal, fitted, inverse, magnitudes, series

_POINTS = 100  # frequencies of the scalings
_TOLERANCE = 0.005  # of the H-infinity steps
_ENOUGH = 0.001  # relative decrease of mu below which the iteration ends
_LOST = 1.01  # of mu, which a controller of lower order may cost


def mu_synthesis(P: control.StateSpace, n_meas: int, n_ctrl: int, blocks: Sequence[Sequence[Any]], *,
                 iterations: int = 10, order: int = 4) -> Design:
    """Design a controller for robust performance by D-K iteration, and prove the structured singular value it reaches.

    With u = K y, mu of the loop from w to z for the blocks is made small: below 1, every stable perturbation of the
    first blocks with H-infinity norm up to 1 leaves the loop stable and the norm of the last block's channels below 1.
    The two steps are each convex, together they are not: the result is local. Conventions are those of `hinf`.

    Parameters
    ----------
    P : control.StateSpace
        Generalized plant, continuous or sampled.
    n_meas, n_ctrl : int
        Numbers of measurements y and of controls u.
    blocks : sequence of tuple
        Blocks of the perturbation w = Delta z in order, as `rt.coupling.mu`: ("full", rows, columns) or
        ("repeated", n); the last one stands for performance.
    iterations : int
        Largest number of D-K iterations.
    order : int
        Order of each scaling [-].

    Returns
    -------
    Design
        ``value``: proven bound of mu at every frequency, by a certificate of kind "frequency" about the loop in
        floating-point numbers; a certificate of kind "closed_loop" proves the stability of the exact loop. ``lower``:
        the smallest H-infinity norm of the last block's channels alone, estimated.

    Raises
    ------
    InputError
        As `hinf`; blocks that do not fit w and z.

    References
    ----------
    Doyle, Proc. Conference on Decision and Control (1985); Packard and Doyle, Automatica 29 (1993).

    Examples
    --------
    >>> import control, robthermal as rt
    >>> P = control.ss([[-1.0]], [[0, 1.0, 0, 1.0]], [[0], [1.0], [0], [1.0]],  # x' = -x + w2 + u, w1 = Delta (u/5)
    ...                [[0, 0, 0, 0.2], [0, 0, 0, 0], [0, 0, 0, 0.5], [0.0, 0, 0.1, 0]])
    >>> d = rt.design.mu_synthesis(P, 1, 1, [("full", 1, 1), ("full", 2, 2)], order=1)
    >>> d.holds, d.value < 1, [c.kind for c in d.certificates]
    (True, True, ['frequency', 'closed_loop'])
    """
    start = time.perf_counter()
    plant = read_generalized(P, n_meas, n_ctrl)
    most, degree = whole_number(iterations, "iterations", 1), whole_number(order, "order", 0)
    sizes = _read(blocks, plant)
    work, side = to_continuous(plant) if plant.dt else (plant, 1.0)
    r, c = sizes[-1]
    q, m = len(plant.C1), plant.B1.shape[1]
    lower = best_of(chosen(plant, range(q - c, q), range(m - r, m)), 0.005, None, {}, None)[1]
    best, count = _iterated(work, sizes, most, degree)
    K = None if best is None else _reduced(work, sizes, best)
    if K is not None and plant.dt:
        K = to_sampled(K, side, plant.dt)
    if K is None:
        controller, loop = named(state_space(P), plant, zero_controller(plant))
        return Design(controller, np.inf, lower, loop, [], RobustAgainst("Nothing is proven, of this plant or of "
                      "others."), SynthesisCode.NOT_FOUND.outcome(), "D-K iteration", "none",
                      time.perf_counter() - start, count, plant)
    value, certificates, outcome = _proven(plant, K, blocks)
    controller, loop = named(state_space(P), plant, K)
    return Design(controller, value, lower, loop, certificates, _covers(value), outcome, "D-K iteration", "floats",
                  time.perf_counter() - start, count, plant)


def _read(blocks: Any, plant: GeneralizedPlant) -> Sizes:
    """Rows and columns of the blocks; `mu` says what is wrong with them."""
    mu(np.zeros((len(plant.C1), plant.B1.shape[1])), blocks)
    if blocks is None or len(blocks) < 2:
        raise InputError(f"blocks = {quoted(blocks)}", where="argument blocks",
                         expected="an uncertainty and, last, the performance", remedy="For one block use hinf.")
    return [(int(block[1]), int(block[-1])) for block in blocks]


def _iterated(plant: GeneralizedPlant, sizes: Sizes, most: int, degree: int) -> tuple[Plant | None, int]:
    """Controller with the smallest bound of mu in floats, and the number of iterations."""
    best: tuple[float, Plant] | None = None
    scaled, count, idle = plant, 0, 0
    for _ in range(most):
        found = best_of(scaled, _TOLERANCE, None, {}, None)[0]
        count += 1
        if found is None:
            break
        omega, bound, d = _scalings(plant, found.K, sizes)
        gained = best is None or bound.max() < best[0] * (1 - _ENOUGH)
        if best is None or bound.max() < best[0]:
            best = float(bound.max()), found.K
        idle = 0 if gained else idle + 1
        if idle == 2:
            break
        scaled = _with_scalings(plant, sizes, omega, d, degree)
    return None if best is None else best[1], count


def _scalings(plant: GeneralizedPlant, K: Plant, sizes: Sizes) -> tuple[Array, Array, Array]:
    """Frequencies, bounds of mu and magnitudes of the scalings of the loop."""
    loop = close(plant.joined, K)
    modes: Array = abs(np.linalg.eigvals(plant.A))
    modes = modes[modes > 1e-9 * modes.max(initial=1e-300)]
    low, high = (float(modes.min()), float(modes.max())) if len(modes) else (1.0, 1.0)
    seen: Array = abs(loop.poles)
    high = max(high, float(np.median(seen)) if len(seen) else 1.0)
    omega = np.geomspace(max(low / 100, 1e-6 * high), high * 300, _POINTS)
    bound, d = magnitudes(responder(loop)(omega), sizes)
    return omega, bound, d


def _with_scalings(plant: GeneralizedPlant, sizes: Sizes, omega: Array, d: Array, degree: int) -> GeneralizedPlant:
    """D_L P D_R⁻¹ with fitted scalings; u and y as they are."""
    fits = [fitted(omega, d[:, k], degree) for k in range(len(sizes) - 1)]
    one = Plant(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), np.eye(1), 0.0)
    fits.append(one)
    n_u, n_y = plant.B2.shape[1], len(plant.C2)
    left = diagonal([f for f, (_, columns) in zip(fits, sizes, strict=True) for _ in range(columns)] + [one] * n_y)
    right = diagonal([inverse(f) for f, (rows, _) in zip(fits, sizes, strict=True) for _ in range(rows)] + [one] * n_u)
    return split(series(series(right, plant.joined), left), n_y, n_u)


def _reduced(plant: GeneralizedPlant, sizes: Sizes, K: Plant) -> Plant:
    """Controller of the smallest order that costs at most 1 % of mu, in floats."""
    limit = _LOST * _scalings(plant, K, sizes)[1].max()
    for order in range(len(K.A)):
        try:
            short = shortened(K, order)
            good = close(plant.joined, short).stable and _scalings(plant, short, sizes)[1].max() <= limit
        except (InputError, np.linalg.LinAlgError, ValueError):  # unstable modes, or nothing left
            continue
        if good:
            return short
    return K


def _proven(plant: GeneralizedPlant, K: Plant, blocks: Sequence[Sequence[Any]]
            ) -> tuple[float, list[Certificate], Outcome]:
    """Bound, certificates and outcome."""
    loop = close(plant.joined, K)
    inputs, outputs = ([f"{name}{k}" for k in range(count)] for name, count in
                       (("w", loop.B.shape[1]), ("z", len(loop.C))))
    stable = prove_closed_loop(plant.joined, K, measure="stability")
    found = mu_bound(as_system(loop, inputs, outputs), blocks)
    if found.certificate is None or not found.certificate.holds or not stable.holds:
        reason = stable.reason if not stable.holds or found.certificate is None else found.certificate.reason
        return np.inf, [], SynthesisCode.NOT_CERTIFIED.outcome(
            f"The bound of the structured singular value is not proven: {reason}. The lower bound is "
            f"{float(np.max(found.lower)):.5g}.")
    value = float(found.upper)
    return value, [found.certificate, stable], SynthesisCode.CERTIFIED.outcome(
        f"Certified at every frequency: structured singular value below {value:.6g}, and not below "
        f"{float(np.max(found.lower)):.6g}, for the loop in floating-point numbers; the exact loop is proven stable.")


def _covers(value: float) -> RobustAgainst:
    if not np.isfinite(value):
        return RobustAgainst("Nothing is proven, of this plant or of others.")
    return RobustAgainst("Proven for the loop's matrices as they stand in the certificate, rounded to floating-point "
                         "numbers: every stable Delta of the first blocks with H-infinity norm up to "
                         f"{1 / value:.6g} leaves it stable, and the norm of the last block's channels below "
                         f"{value:.6g}.", {"delta_norm": 1 / value})
