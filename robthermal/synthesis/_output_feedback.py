"""Output feedback of fixed structure: static, decentralized, of few states. Local search, proven result."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse.csgraph import connected_components

from .._arrays import Array
from .._checks import positive_number, quoted, whole_number
from .._control import control
from ..errors import InputError, Outcome
from ..linear import Plant
from ..verification import Certificate
from ._arguments import state_space
from ._descent import StaticLoop, descend
from ._design import Design, named, small_gain, zero_controller
from ._hinf import best_of, certified_norm
from ._outcomes import SynthesisCode
from ._plant import GeneralizedPlant, balanced, read_generalized, to_continuous, to_sampled
from ._reduce import shortened

_STARTS = 6  # gains from which the search sets out
_MARGIN = 1e-3  # of the plant's fastest mode: decay at which the loop counts as stable
_CLOSE = 1.002  # times the full-order optimum: no more starts


@dataclass(frozen=True)
class _Pattern:
    """Which entries of [A_K, B_K; C_K, D_K] are free, and the number of states."""

    free: Array
    order: int


def output_feedback(P: control.StateSpace, n_meas: int, n_ctrl: int, *, structure: ArrayLike | None = None,
                    order: int = 0, gamma: float | None = None) -> Design:
    """Search a controller of fixed structure with a small H-infinity norm from w to z, and prove what it reaches.

    The problem is not convex: the search is local, from several starts, first for stability and then for the norm.
    ``lower`` is the optimum over controllers of full order and structure, so that the gap is known. That nothing is
    found does not say that there is nothing. Conventions are those of `hinf`.

    Parameters
    ----------
    P : control.StateSpace
        Generalized plant, continuous or sampled.
    n_meas, n_ctrl : int
        Numbers of measurements y and of controls u.
    structure : array_like, shape (n_ctrl, n_meas), optional
        Nonzero where a control may use a measurement; by default everywhere. The identity is a decentralized
        controller.
    order : int
        Number of states; with a structure, of every group of controls and measurements that it connects.
    gamma : float, optional
        Norm that is enough [output unit per input unit].

    Returns
    -------
    Design
        ``value`` is proven for the controller returned; ``holds`` is False where no stabilizing one is found, or none
        that reaches gamma.

    Raises
    ------
    InputError
        As `hinf`; a structure of another shape or without a nonzero entry, a group with zeros inside and order > 0.

    References
    ----------
    Apkarian and Noll, Nonsmooth H-infinity synthesis, IEEE Transactions on Automatic Control 51 (2006); Burke, Henrion,
    Lewis and Overton, HIFOO, IFAC Symposium on Robust Control Design (2006).

    Examples
    --------
    >>> import control, robthermal as rt
    >>> P = control.ss([[1.0]], [[1.0, 1.0]], [[1.0], [0.0], [1.0]], [[0, 0], [0, 1.0], [0, 0]])  # x' = x + w + u
    >>> d = rt.design.output_feedback(P, 1, 1)  # u = -k x: the norm is √(1 + k²)/(k - 1), more than 1
    >>> d.holds, 1.0 < d.value < 1.004
    (True, True)
    """
    start = time.perf_counter()
    plant = read_generalized(P, n_meas, n_ctrl)
    asked = None if gamma is None else positive_number(gamma, "gamma")
    pattern = _read_pattern(structure, whole_number(order, "order", 0), plant)
    full, lower = best_of(plant, 0.005, None, {}, None)
    work, side = to_continuous(plant) if plant.dt else (plant, 1.0)
    loop = StaticLoop(_augmented(balanced(work), pattern.order), pattern.free)
    best: tuple[Plant, Certificate] | None = None
    count = 0
    enough = _CLOSE * lower if asked is None else asked * (1 - 1e-3)
    for begin in _starts(loop, pattern, None if full is None or plant.dt or structure is not None else full.K):
        x, steps = _searched(loop, begin, enough)
        count += steps
        made = None if x is None else _of_plant(pattern, loop.gain(x), plant, side)
        certificate = None if made is None else certified_norm(plant, made)
        if made is not None and certificate is not None and (
                best is None or certificate.region["bound"] < best[1].region["bound"]):
            best = made, certificate
        if best is not None and best[1].region["bound"] <= (_CLOSE * lower if asked is None else asked):
            break
    controller = zero_controller(plant) if best is None else best[0]
    value = np.inf if best is None else float(best[1].region["bound"])
    K, closed = named(state_space(P), plant, controller)
    return Design(K, value, lower, closed, [] if best is None else [best[1]], small_gain(value),
                  _judged(value, lower, asked), "local search (Apkarian and Noll)", "floats",
                  time.perf_counter() - start, count, plant)


def _judged(value: float, lower: float, asked: float | None) -> Outcome:
    if asked is not None and asked < lower * (1 - 1e-3):
        return SynthesisCode.INFEASIBLE.outcome(
            f"gamma = {asked:g}: even controllers of full order and structure reach about {lower:#.4g} at best.")
    if not np.isfinite(value):
        return SynthesisCode.NOT_FOUND.outcome(
            f"No stabilizing controller of this structure was found from {_STARTS} starts, which does not say that "
            "there is none.", remedy="Allow more states, or more entries of the structure.")
    if asked is not None and value > asked:
        return SynthesisCode.NOT_FOUND.outcome(
            f"gamma = {asked:g}: the best controller found is proven to reach {value:.6g}; the search is local.",
            remedy="Ask for less, allow more states, or more entries of the structure.")
    return SynthesisCode.CERTIFIED.outcome(
        f"Certified for the numbers of the controller as returned: H-infinity norm below {value:.6g}; controllers of "
        f"full order reach about {lower:.6g}, estimated; the optimum of this structure lies between.")


def _read_pattern(structure: ArrayLike | None, order: int, plant: GeneralizedPlant) -> _Pattern:
    shape = plant.B2.shape[1], len(plant.C2)
    try:
        D = np.ones(shape, bool) if structure is None else np.asarray(structure, float) != 0
    except (ValueError, TypeError):
        D = np.zeros((0, 0), bool)
    if D.shape != shape or not D.any():
        raise InputError(f"structure = {quoted(structure)}", where="argument structure",
                         expected=f"an array of shape {shape} with nonzero entries where a control may use a "
                                  "measurement")
    if order == 0:
        return _Pattern(D, 0)
    m, p = shape
    links = np.block([[np.zeros((m, m)), D], [D.T, np.zeros((p, p))]])
    count, label = connected_components(links, directed=False)
    groups = [k for k in range(count) if D[label[:m] == k].any()]
    for k in groups:
        if not D[np.ix_(label[:m] == k, label[m:] == k)].all():
            raise InputError(f"order = {order} with zeros inside a group of controls and measurements",
                             where="argument structure", expected="groups that are full, or order = 0")
    size = order * len(groups)
    owner = np.repeat(groups, order)
    A = owner[:, None] == owner
    B, C = owner[:, None] == label[m:], label[:m, None] == owner
    return _Pattern(np.block([[A, B], [C, D]]), size)


def _augmented(plant: GeneralizedPlant, order: int) -> GeneralizedPlant:
    """Plant with integrators whose inputs are controls and whose states are measurements, before its own."""
    if not order:
        return plant
    n, k, eye = len(plant.A), order, np.eye(order)

    def both(first: Array, second: Array) -> Array:
        rows, columns = first.shape
        return np.block([[first, np.zeros((rows, second.shape[1]))], [np.zeros((len(second), columns)), second]])

    swap = both(np.zeros((k, 0)), plant.A)
    A = np.hstack([np.zeros((n + k, k)), swap])
    return replace(plant, A=A, B1=np.vstack([np.zeros((k, plant.B1.shape[1])), plant.B1]), B2=both(eye, plant.B2),
                   C1=np.hstack([np.zeros((len(plant.C1), k)), plant.C1]), C2=both(eye, plant.C2),
                   D12=np.hstack([np.zeros((len(plant.D12), k)), plant.D12]),
                   D21=np.vstack([np.zeros((k, plant.D21.shape[1])), plant.D21]),
                   D22=both(np.zeros((k, k)), plant.D22))


def _starts(loop: StaticLoop, pattern: _Pattern, full: Plant | None) -> Iterator[Array]:
    """Zero gain, the reduced full-order controller, and gains at random, of several sizes."""
    size, k = int(pattern.free.sum()), pattern.order
    zero = np.zeros(pattern.free.shape)
    zero[:k, :k] = -np.eye(k) * _fastest(loop) / 3
    if full is not None:
        short = _short(full, k)
        if short is not None:
            yield short[pattern.free]
    yield zero[pattern.free]
    rng = np.random.default_rng(0)
    for factor in np.geomspace(0.1, 10, _STARTS - 2):
        yield zero[pattern.free] + factor * rng.standard_normal(size)


def _short(full: Plant, order: int) -> Array | None:
    """Gain of the full-order controller with fewer states, by balanced truncation; None where it has too few."""
    try:
        K = shortened(full, order)
    except (InputError, np.linalg.LinAlgError, ValueError):
        return None
    if len(K.A) != order:
        return None
    found: Array = np.block([[K.A, K.B], [K.C, K.D]])
    return found


def _fastest(loop: StaticLoop) -> float:
    return float(abs(np.linalg.eigvals(loop.plant.A)).max(initial=1e-3))


def _searched(loop: StaticLoop, x: Array, enough: float) -> tuple[Array | None, int]:
    """Free entries after both descents; None where the loop is not stable."""
    aim = -_MARGIN * _fastest(loop)
    try:
        value = loop.eigenvalues(x)
    except (ValueError, np.linalg.LinAlgError):
        return None, 0
    count = 0
    if value > aim:
        x, count = descend(loop, x, loop.eigenvalues, loop.tangents_of_eigenvalues, aim)
    if not np.isfinite(loop.norm(x)):
        return None, count
    x, more = descend(loop, x, loop.norm, loop.tangents_of_norm, enough)
    return x, count + more


def _of_plant(pattern: _Pattern, gain: Array, plant: GeneralizedPlant, side: float) -> Plant | None:
    k = pattern.order
    K = Plant(gain[:k, :k], gain[:k, k:], gain[k:, :k], gain[k:, k:], 0.0)
    if not plant.dt:
        return K
    try:
        return to_sampled(K, side, plant.dt)
    except np.linalg.LinAlgError:
        return None
