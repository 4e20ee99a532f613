"""Static anti-windup compensation: a gain from what saturation takes away to the states of the controller.

Mulder, Kothare and Morari (2001). Nothing new has to be checked for its proof: with the dead zone q = v - sat(v)
written as q = (v + p)/2, |p| <= |v|, the claim is a weighted H-infinity norm of a linear loop. Where that fails, a
region is looked for (`_attraction`).
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import block_diag, cholesky, solve_continuous_lyapunov, solve_discrete_lyapunov

from .._arrays import Array
from .._checks import quoted
from .._control import control
from ..conic import inside
from ..errors import InputError, Outcome
from ..export import Program
from ..linear import Plant, close, plant_norm, prove_closed_loop, read_plant
from ..verification import Certificate
from ._affine import Matrices, Unknowns, symmetric
from ._attraction import Attraction, attraction, prove_gain, prove_region
from ._design import Design, RobustAgainst, as_system
from ._export import program
from ._outcomes import SynthesisCode
from ._plant import GeneralizedPlant, chosen, split

_SLACKS = (1e-3, 1e-2, 5e-2, 0.2)  # of the gain above that of the inequalities, in turn
_MARGIN = 1e-7  # of the inequality, in coordinates whose states are excited alike


@dataclass(frozen=True)
class AntiWindupDesign(Design):
    """A controller with anti-windup gain, and where the limited loop is proven to come to rest.

    Parameters
    ----------
    controller : control.StateSpace
        Inputs y, then q = v - sat(v); a zero gain from q where nothing is proven.
    value : float
        Proven L2 gain from rest: for all disturbances, or for those up to `energy`; infinity where none is proven.
    lower : float
        H-infinity norm of the loop without limits, estimated, which small signals reach.
    closed_loop : control.StateSpace
        Loop without limits, from w to z in floats.
    certificates : list of Certificate
        Kind "closed_loop", or of a region two of kind "ellipsoid"; `rt.verify` checks each again.
    robust_against : RobustAgainst
        What set of plants the claim covers.
    outcome : Outcome
        How it ended; its text is the remedy.
    method : str
        Inequalities that gave the gain.
    solver : str
        What solved them.
    solve_time : float
        Time of the whole synthesis with its proofs [s].
    iterations : int
        Programs that were tried.
    plant : GeneralizedPlant or None
        None: margins of a limited loop say nothing.
    matrix : ndarray, shape (n, n)
        P of the region x'Px <= level over the states of plant and controller; zero where it is all of them, or nothing.
    level : float
        Level of the region; infinity where every start comes to rest, zero where nothing is proven.
    rate : float
        In the region x'Px falls at least as exp(-2 rate t) [1/s], sampled by (1 - rate)² per sample; 0 without one.
    energy : float
        Largest energy of disturbances (integral or sum of squares) that `value` is proven for, from rest.
    limits : tuple of float
        Largest absolute value of each control [control unit]; the C source keeps them.
    """

    matrix: Array = field(default_factory=lambda: np.zeros((0, 0)), repr=False)
    level: float = 0.0
    rate: float = 0.0
    energy: float = 0.0
    limits: tuple[float, ...] = ()

    def contains(self, x: ArrayLike) -> bool:
        """Whether a start is proven to come to rest.

        Parameters
        ----------
        x : array_like, shape (n,)
            States of the plant, then of the controller.

        Returns
        -------
        bool
        """
        state = np.asarray(x, float)
        return bool(self.level > 0 and state @ self.matrix @ state <= self.level)

    def _facts(self) -> dict[str, Any]:
        return super()._facts() | {"matrix": self.matrix, "level": self.level, "rate": self.rate, "energy": self.energy,
                                   "limits": list(self.limits)}

    def _source(self, name: str) -> Program:
        return program(self.controller, name, self._said, self.limits)


def anti_windup(plant: control.StateSpace, K: control.StateSpace, *, limits: ArrayLike,
                performance: tuple[Sequence[int], Sequence[int]] | None = None) -> AntiWindupDesign:
    """Design a static anti-windup gain for a given controller, and prove the L2 gain of the saturated loop.

    The plant sees sat(v), v = C_K x_K + D_K y. The controller returned has the further inputs q = v - sat(v), added to
    its states through the gain E: x_K' = A_K x_K + B_K y + E q. The smallest L2 gain from w to z that one quadratic
    function and the sector of the dead zone give is found by matrix inequalities. That claim is global: it holds for
    limits of any size, so that the plant has to be stable by itself. Where it fails, the gain with a large region of
    attraction is found instead: an ellipsoid of plant and controller states from which the loop comes to rest within
    these limits.

    Parameters
    ----------
    plant : control.StateSpace
        Generalized plant from (w, u) to (z, y), controls last among its inputs, measurements last among its outputs.
    K : control.StateSpace
        Controller from y to u with u = +K y, which stabilizes the plant without saturation.
    limits : array_like, shape (n_ctrl,) or ()
        Largest absolute value of each control [control unit].
    performance : tuple of (outputs, inputs), optional
        Which performance outputs and disturbances the gain is about, counted from 0; by default all.

    Returns
    -------
    AntiWindupDesign
        ``controller``: inputs y, then q. ``value``: proven L2 gain of the saturated loop from rest; ``lower``: the
        H-infinity norm of the loop without saturation, which small signals reach. ``level`` is infinite where every
        start comes to rest; else ``contains`` says which do. ``holds`` is False where neither is proven.

    Raises
    ------
    InputError
        Sizes that do not fit, a controller without states or that does not stabilize, limits that are not positive.

    References
    ----------
    Mulder, Kothare and Morari, Automatica 37 (2001); Tarbouriech, Garcia, Gomes da Silva and Queinnec, Stability and
    Stabilization of Linear Systems with Saturating Actuators (2011); Hu and Lin, Control Systems with Actuator
    Saturation (2001).

    Examples
    --------
    >>> import control, robthermal as rt
    >>> P = control.ss([[-0.1]], [[0.1, 1.0]], [[1.0], [-1.0]], [[0, 0], [0, 0]])  # z = x, y = -x
    >>> K = control.ss([[-1e-3]], [[1.0]], [[0.1]], [[0.5]])  # PI control with a leak
    >>> d = rt.design.anti_windup(P, K, limits=1.0)  # the open loop has a gain of 1
    >>> d.holds, d.controller.ninputs, d.lower < d.value < 1.1
    (True, 2, True)
    >>> P = control.ss([[0.2]], [[0.1, 1.0]], [[1.0], [-1.0]], [[0, 0], [0, 0]])  # not stable by itself
    >>> d = rt.design.anti_windup(P, K, limits=1.0)  # limits of 1 can hold the state up to 5
    >>> d.holds, d.contains([3.0, 0.0]), d.contains([6.0, 0.0])
    (True, True, False)
    """
    start = time.perf_counter()
    joined, own = read_plant(plant, "argument plant"), read_plant(K, "argument K")
    parts = _parts(joined, own, performance)
    largest = _limits(limits, len(own.C))
    loop = _loop(parts, own)
    nominal = close(parts.joined, own)
    if not nominal.stable:
        raise InputError("the controller does not stabilize the plant without saturation", where="argument K",
                         expected="a stable loop")
    lower = plant_norm(nominal)[0]
    found = _solved(loop, len(own.A), len(own.C))
    proven = None if found is None else _proven(parts, own, *found)
    names = [*K.input_labels, *(f"q[{name}]" for name in K.output_labels)]
    closed = as_system(nominal, [f"w[{k}]" for k in range(nominal.B.shape[1])],
                       [f"z[{k}]" for k in range(len(nominal.C))])
    def result(E: Array, value: float, certificates: list[Certificate], covers: str, outcome: Outcome, method: str,
               region: Attraction | None = None, energy: float = 0.0) -> AntiWindupDesign:
        made = Plant(own.A, np.hstack([own.B, E]), own.C, np.hstack([own.D, np.zeros((len(own.C),) * 2)]), own.dt)
        size = len(parts.A) + len(own.A)
        return AntiWindupDesign(
            as_system(made, names, list(K.output_labels)), value, lower, closed, certificates, RobustAgainst(covers),
            outcome, method, "Clarabel", time.perf_counter() - start, 1 if proven is not None else 2, None,
            np.zeros((size, size)) if region is None else region.P,
            region.level if region is not None else np.inf if outcome.ok else 0.0,
            0.0 if region is None else region.rate, energy, tuple(largest))

    if proven is not None and found is not None:
        value = float(proven.region["bound"])
        outcome = SynthesisCode.CERTIFIED.outcome(
            "Certified for the numbers of the controller as returned: L2 gain of the saturated loop below "
            f"{value:.6g}; without saturation it is about {lower:.6g}.")
        covers = (f"Proven for the plant as given and saturations at {', '.join(f'{one:g}' for one in largest)}, or at "
                  "any other limits: only |p| <= |v| is used of p = 2 q - v. The certificate's loop has p as a "
                  "disturbance, weighted.")
        return result(found[0], value, [proven], covers, outcome,
                      "matrix inequalities (Mulder, Kothare and Morari)", energy=np.inf)
    method = "matrix inequalities of a region (Gomes da Silva and Tarbouriech; Hu and Lin)"
    bounds = np.array(largest)
    region = None if parts.D22.any() else attraction(loop, bounds, len(parts.A), len(own.A))
    certificate = None if region is None else prove_region(parts, own, bounds, region)
    if region is None or certificate is None or not certificate.holds:
        return result(np.zeros((len(own.A), len(own.C))), np.inf, [],
                      "Nothing is proven, of this plant or of others.", _nothing(parts, own), method)
    more = prove_gain(parts, own, bounds, region, loop)
    reach = 1 / np.sqrt(np.linalg.eigvalsh(region.P[:len(parts.A), :len(parts.A)])[-1])
    words = "" if more is None else (
        f" From rest, disturbances of energy up to {more.region['level']:.4g} have an L2 gain below "
        f"{more.region['bound']:.6g}.")
    outcome = SynthesisCode.CERTIFIED_REGION.outcome(
        "Certified for the numbers of the controller as returned, in a region: within these limits the loop comes to "
        f"rest from every start in x'Px <= {region.level:g}, with the controller at rest from every state of the plant "
        f"of norm up to {reach:.4g}.{words} For every start, no gain was proven"
        + ("." if _stable(parts, own) else ": the plant is not stable by itself."))
    covers = (f"Proven for the plant as given and saturations at {', '.join(f'{one:g}' for one in largest)}, from the "
              "starts in the region only.")
    return result(region.E, np.inf if more is None else float(more.region["bound"]),
                  [certificate, *([] if more is None else [more])], covers, outcome, method, region,
                  0.0 if more is None else float(more.region["level"]))


def _nothing(parts: GeneralizedPlant, own: Plant) -> Outcome:
    return SynthesisCode.NOT_FOUND.outcome(
        "No gain was found with which the saturated loop is proven stable for every start and disturbance"
        + (", and no region." if _stable(parts, own) else ": the plant is not stable by itself; and no region.")
        + (" Regions are designed for without a direct path from controls to measurements only." if parts.D22.any()
           else ""), remedy="Allow larger limits, or scale the plant.")


def _stable(parts: GeneralizedPlant, own: Plant) -> bool:
    return close(parts.joined, _zero(own)).stable


def _parts(joined: Plant, K: Plant, performance: Any) -> GeneralizedPlant:
    """Parts of the plant, with the channels chosen."""
    n_u, n_y = K.D.shape
    if not len(K.A):
        raise InputError("a controller without states", where="argument K", expected="at least one state",
                         remedy="A static controller does not wind up.")
    if n_u >= joined.D.shape[1] or n_y >= len(joined.D) or joined.dt != K.dt:
        raise InputError(f"a controller with {n_y} inputs and {n_u} outputs, sample time {K.dt:g} s",
                         where="argument K", expected=f"fewer than the {joined.D.shape[0]} outputs and "
                         f"{joined.D.shape[1]} inputs of the plant, and its sample time {joined.dt:g} s")
    whole = split(joined, n_y, n_u)
    if performance is None:
        return whole
    counts = len(whole.C1), whole.B1.shape[1]
    good = isinstance(performance, Sequence) and len(performance) == 2 and all(
        isinstance(part, Sequence) and len(part) and all(isinstance(k, int) and 0 <= k < count for k in part)
        for part, count in zip(performance, counts, strict=True))
    if not good:
        raise InputError(f"performance = {quoted(performance)}", where="argument performance",
                         expected=f"(outputs, inputs): whole numbers below {counts[0]} and {counts[1]}")
    return chosen(whole, *performance)


def _limits(limits: ArrayLike, count: int) -> list[float]:
    try:
        found = np.asarray(limits, float)
    except (ValueError, TypeError):
        found = np.zeros(0)
    if found.shape not in ((), (1,), (count,)) or not np.isfinite(found).all() or not (found > 0).all():
        raise InputError(f"limits = {quoted(limits)}", where="argument limits",
                         expected=f"one or {count} numbers above zero")
    return [float(one) for one in np.broadcast_to(found, (count,))]


def _zero(K: Plant) -> Plant:
    return Plant(np.zeros((0, 0)), np.zeros((0, K.B.shape[1])), np.zeros((len(K.C), 0)), 0 * K.D, K.dt)


def _loop(p: GeneralizedPlant, K: Plant) -> Plant:
    """Loop from (w, q, e) to (z, v), e added to the controller's states."""
    n, k, (n_u, n_y) = len(p.A), len(K.A), K.D.shape
    m, q = p.B1.shape[1], len(p.C1)
    zero = np.zeros
    plant = Plant(p.A, np.hstack([p.B1, -p.B2, zero((n, k)), p.B2]),
                  np.vstack([p.C1, zero((n_u, n)), p.C2, zero((k, n))]),
                  np.block([[p.D11, -p.D12, zero((q, k)), p.D12], [zero((n_u, m + n_u + k)), np.eye(n_u)],
                            [p.D21, -p.D22, zero((n_y, k)), p.D22],
                            [zero((k, m + n_u)), np.eye(k), zero((k, n_u))]]), p.dt)
    return close(plant, Plant(K.A, np.hstack([K.B, np.eye(k)]), K.C, np.hstack([K.D, zero((n_u, k))]), K.dt))


def _solved(loop: Plant, k: int, n_u: int) -> tuple[Array, Array, float] | None:
    """E, the multipliers and the gain of the inequalities; None where there is no solution."""
    driven = loop.B @ loop.B.T
    driven += 1e-9 * np.trace(driven) / len(driven) * np.eye(len(driven))
    W = solve_discrete_lyapunov(loop.A, driven) if loop.dt else solve_continuous_lyapunov(loop.A, -driven)
    T = cholesky((W + W.T) / 2, lower=True)
    A, B, C, D = np.linalg.solve(T, loop.A @ T), np.linalg.solve(T, loop.B), loop.C @ T, loop.D
    m, q = B.shape[1] - n_u - k, len(C) - n_u
    unknowns = Unknowns({"Q=": A.shape, "M=": (n_u, n_u), "X": (k, n_u), "g": (1, 1)}, {"M": np.eye(n_u)})

    def form(v: Matrices) -> Array:
        Q, M, g = v["Q"], v["M"], v["g"][0, 0] * np.eye(q)
        Bq = B[:, m:m + n_u] @ M + B[:, m + n_u:] @ v["X"]
        Dq = D[:, m:m + n_u] @ M + D[:, m + n_u:] @ v["X"]
        Bw, Dw, Cz, Cv = B[:, :m], D[:, :m], C[:q], C[q:]
        dead = 2 * M - Dq[q:] - Dq[q:].T
        if loop.dt:
            return symmetric([[Q, -Q @ Cv.T, np.zeros((len(Q), m)), Q @ A.T, Q @ Cz.T],
                              [dead, -Dw[q:], Bq.T, Dq[:q].T], [np.eye(m), Bw.T, Dw[:q].T],
                              [Q, np.zeros((len(Q), q))], [g]])
        return symmetric([[-A @ Q - Q @ A.T, -Bq - Q @ Cv.T, -Bw, -Q @ Cz.T], [dead, -Dw[q:], -Dq[:q].T],
                          [np.eye(m), -Dw[:q].T], [g]])

    found = inside([unknowns.inequality(form, _MARGIN), unknowns.inequality(lambda v: v["Q"], _MARGIN),
                    unknowns.inequality(lambda v: v["M"], _MARGIN)], unknowns.gradient(lambda v: float(v["g"][0, 0])))
    if not found.solved:
        return None
    v = unknowns.matrices(found.x)
    M = np.diag(v["M"])
    if M.min() <= 0 or v["g"][0, 0] <= 0:
        return None
    return v["X"] / M, 1 / M, float(np.sqrt(v["g"][0, 0]))


def _proven(p: GeneralizedPlant, K: Plant, E: Array, W: Array, gain: float) -> Certificate | None:
    """Certificate that the loop from (p^, w) to (a v, z) has a norm below γ, p = c p^, with a c >= γ."""
    c = np.sqrt(2 / W)
    for slack in _SLACKS:
        bound = gain * (1 + slack)
        plant, controller = weighted(p, K, E, c, np.array([_above(bound, one) for one in c]))
        certificate = prove_closed_loop(plant, controller, bound=bound)
        if certificate.holds:
            return certificate
    return None


def _above(bound: float, c: float) -> float:
    """A float a with a c >= bound exactly."""
    return float(np.nextafter(bound / c, np.inf) * (1 + 1e-14))


def weighted(p: GeneralizedPlant, K: Plant, E: Array, c: Array, a: Array) -> tuple[Plant, Plant]:
    """Plant and controller of the proof: all entries are numbers of plant and controller, halves of them, c and a.

    Disturbances (w, p^), controls (v, p); outputs (z, a v), measurements (y, q, p^) with q = (v + p)/2.
    """
    n, (n_u, n_y), m, q = len(p.A), K.D.shape, p.B1.shape[1], len(p.C1)
    one, zero = np.eye(n_u), np.zeros
    plant = Plant(p.A, np.hstack([p.B1, zero((n, n_u)), p.B2 / 2, -p.B2 / 2]),
                  np.vstack([p.C1, zero((n_u, n)), p.C2, zero((2 * n_u, n))]),
                  np.block([[p.D11, zero((q, n_u)), p.D12 / 2, -p.D12 / 2],
                            [zero((n_u, m + n_u)), np.diag(a), zero((n_u, n_u))],
                            [p.D21, zero((n_y, n_u)), p.D22 / 2, -p.D22 / 2],
                            [zero((n_u, m + n_u)), one / 2, one / 2],
                            [zero((n_u, m)), one, zero((n_u, 2 * n_u))]]), p.dt)
    controller = Plant(K.A, np.hstack([K.B, E, zero((len(K.A), n_u))]), np.vstack([K.C, zero((n_u, len(K.A)))]),
                       block_diag(np.hstack([K.D, zero((n_u, n_u))]), np.diag(c)), K.dt)
    return plant, controller
