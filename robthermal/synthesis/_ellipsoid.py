"""Where disturbances of limited size can drive a plant: the smallest ellipsoid that is never left, with its proof."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import Array
from .._checks import finite_number, quoted
from .._drawing import axes_for
from ..errors import InputError, Outcome
from ..linear import made_by
from ..verification import Certificate, establish
from ._ellipsoid_program import Driven, Kept, smallest
from ._outcomes import SynthesisCode

_MOST = 64  # vertices: all of them enter the program
_OUTLINE = 181  # points of a drawn ellipse


@dataclass(frozen=True)
class InvariantEllipsoid:
    """A set x'Px <= level that a plant never leaves.

    Parameters
    ----------
    matrix : ndarray, shape (n, n)
        P of x'Px, symmetric and positive definite; zero where nothing was found.
    level : float
        Level of the set, 1.
    extent : ndarray, shape (n,)
        Largest absolute value of each state in the set [state units]; infinity where nothing was found.
    decay : float
        Multiplier α of the proof: V - level falls at least as exp(-α t) [1/s], sampled by 1 - α per sample.
    certificates : list of Certificate
        One of kind "ellipsoid"; none where nothing is proven.
    outcome : Outcome
        How it ended; its text is the remedy.
    """

    matrix: Array
    level: float
    extent: Array
    decay: float
    certificates: list[Certificate]
    outcome: Outcome

    @property
    def holds(self) -> bool:
        """Whether the set is proven never to be left."""
        return self.outcome.ok

    @property
    def semi_axes(self) -> Array:
        """Semi-axes of the set, shortest first [state units]; empty where nothing was found."""
        if not self.matrix.any():
            return np.zeros(0)
        found: Array = np.sqrt(self.level / np.linalg.eigvalsh(self.matrix)[::-1])
        return found

    def contains(self, x: ArrayLike) -> bool:
        """Whether a state lies in the set, in floats.

        Parameters
        ----------
        x : array_like, shape (n,)
            State of the plant [state units].

        Returns
        -------
        bool
            False also where no set was found.
        """
        state = np.asarray(x, float)
        return bool(self.matrix.any() and state @ self.matrix @ state <= self.level)

    def __str__(self) -> str:
        lines = [self.outcome.text]
        if self.matrix.any():
            lines += [f"  state {k}  at most {one:.6g}" for k, one in enumerate(self.extent)]
            lines.append(f"  semi-axes  {', '.join(f'{one:.4g}' for one in self.semi_axes)}")
        return "\n".join(lines)

    def plot(self, ax: Any = None) -> Any:
        """Draw the shadow of the set on the first two states.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Axes to draw into; default new ones.

        Returns
        -------
        matplotlib.axes.Axes
        """
        ax = axes_for(ax)
        if self.matrix.any():
            shadow(ax, self.matrix, self.level, "never left")
        ax.set(xlabel="state 0 [its unit]", ylabel="state 1 [its unit]")
        return ax


def shadow(ax: Any, P: Array, level: float, label: str) -> None:
    """Draw the outline of what the first two states can be in x'Px <= level; one state alone is a line."""
    n = min(len(P), 2)
    both = np.zeros((2, 2))
    both[:n, :n] = np.linalg.inv(P)[:n, :n] * level
    root = np.linalg.cholesky(both) if n > 1 else np.sqrt(both)
    angle = np.linspace(0, 2 * np.pi, _OUTLINE)
    ax.plot(*(root @ np.vstack([np.cos(angle), np.sin(angle)])), label=label)
    ax.legend(loc="best")


def invariant_ellipsoid(A_vertices: ArrayLike, B_vertices: ArrayLike, *, disturbance: ArrayLike = 1.0,
                        limits: Any = None, sample_time: float = 0.0) -> InvariantEllipsoid:
    """Find a small ellipsoid that holds every state which limited disturbances reach from rest, and prove it.

    x' = A x + B w (or x+), (A, B) anywhere in the hull of the vertices at every moment. Once in the set, the state
    stays there, whatever w does within its size.

    Parameters
    ----------
    A_vertices : array_like, shape (n, n) or (vertices, n, n)
        Matrices A at the vertices of the hull.
    B_vertices : array_like, shape (n, m) or (vertices, n, m)
        Matrices B at the same vertices; one for all where it has two dimensions.
    disturbance : float or array_like, shape (m,)
        Largest Euclidean norm of w; or the largest absolute value of every w_k, each on its own.
    limits : array_like, shape (n,) or (), or tuple of (rows, bounds), optional
        Largest absolute values of the states that the set has to keep (infinity: none), or of rows times the state.
    sample_time : float
        Sample time of x+ = A x + B w [s]; 0 for x' = A x + B w.

    Returns
    -------
    InvariantEllipsoid
        ``holds`` is False where no ellipsoid was found or the limits are not kept; the text says which and by how much.

    Raises
    ------
    InputError
        Shapes that do not fit, numbers that are not finite, sizes that are not positive, more than 64 vertices.

    References
    ----------
    Boyd, El Ghaoui, Feron and Balakrishnan, Linear Matrix Inequalities in System and Control Theory (1994), 6.1.3.

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> slow, fast = np.array([[0, 1], [-1, -1]]), np.array([[0, 1], [-2, -1]])  # an oscillator whose stiffness varies
    >>> e = rt.design.invariant_ellipsoid([slow, fast], [[0], [1]], disturbance=0.5)
    >>> e.holds, e.contains([0.2, 0.2]), e.contains([5, 0]), rt.verify(e.certificates[0]).valid
    (True, True, False, True)
    """
    driven = _read(A_vertices, B_vertices, disturbance, limits, sample_time)
    n = driven.A.shape[1]
    if not driven.longest > 0:
        modes = np.abs(np.linalg.eigvals(driven.A)) if driven.dt else np.linalg.eigvals(driven.A).real
        worst = int(np.argmax(modes.max(axis=1)))
        return _nothing(n, f"The plant at vertex {worst + 1} is not stable by itself: disturbances drive it anywhere.",
                        "Close a loop first, for instance with polytopic_feedback.")
    kept = smallest(driven)
    if kept is None and len(driven.rows):
        return _beyond(driven)
    if kept is None:
        return _nothing(n, "No ellipsoid was found: no quadratic form falls for all plants of the hull.",
                        "Take a smaller hull.")
    cert = _proven(driven, kept)
    if not cert.holds:
        return _nothing(n, f"An ellipsoid was computed, but not proven: {cert.reason}.", "Scale the states.")
    extent = np.sqrt(np.diag(np.linalg.inv(kept.P)))
    words = ", ".join(f"{one:.4g}" for one in extent)
    outcome = SynthesisCode.CERTIFIED.outcome(f"Certified: the set is never left, absolute values of the states at "
                                              f"most {words}.")
    return InvariantEllipsoid(kept.P, 1.0, extent, kept.decay, [cert], outcome)


def _proven(driven: Driven, kept: Kept) -> Certificate:
    system = {"vertices": [{"A": A, "B": B} for A, B in zip(driven.A, driven.B, strict=True)],
              "sample_time": driven.dt}
    size = float(driven.size[0]) if driven.joint else driven.size.tolist()
    region: dict[str, Any] = {"level": 1.0, "disturbance": size}
    if len(driven.rows):
        region["limits"] = {"state": driven.rows, "bound": driven.bounds}
    evidence = {"matrix": kept.P, "decay": kept.decay}
    evidence |= {} if driven.joint else {"multipliers": kept.multipliers.tolist()}
    return establish("ellipsoid", system=system, region=region, evidence=evidence, margin={},
                     made_by=made_by("Clarabel semidefinite program", "candidate in floats"))


def _beyond(driven: Driven) -> InvariantEllipsoid:
    """What is reached without the limits, to say which of them is in the way."""
    n = driven.A.shape[1]
    free = smallest(Driven(driven.A, driven.B, driven.dt, driven.size, driven.joint, np.zeros((0, n)), np.zeros(0)))
    if free is None:
        return _nothing(n, "No ellipsoid was found, with limits or without.", "Take a smaller hull.")
    W = np.linalg.inv(free.P)
    shares = np.sqrt(np.einsum("ij,jk,ik->i", driven.rows, W, driven.rows)) / driven.bounds
    worst = int(np.argmax(shares))
    return _nothing(n, f"No ellipsoid within the limits was found; without them the smallest has {shares[worst]:.3g} "
                       f"times limit {worst}.", "Allow more, or disturbances that are smaller by that factor.")


def _nothing(n: int, text: str, remedy: str) -> InvariantEllipsoid:
    return InvariantEllipsoid(np.zeros((n, n)), 1.0, np.full(n, np.inf), 0.0, [],
                              SynthesisCode.INFEASIBLE.outcome(text, remedy=remedy))


def _read(A_vertices: ArrayLike, B_vertices: ArrayLike, disturbance: ArrayLike, limits: Any,
          sample_time: object) -> Driven:
    A, B = _numbers(A_vertices, "A_vertices"), _numbers(B_vertices, "B_vertices")
    A = A[None] if A.ndim == 2 else A
    B = np.repeat(B[None], len(A), axis=0) if B.ndim == 2 else B
    if A.ndim != 3 or A.shape[1] != A.shape[2] or 0 in A.shape or len(A) > _MOST:
        raise InputError(f"shape {A.shape}", where="argument A_vertices",
                         expected=f"(n, n) or (vertices, n, n), at most {_MOST} vertices")
    n = A.shape[1]
    if B.ndim != 3 or B.shape[:2] != (len(A), n) or not B.shape[2]:
        raise InputError(f"shape {B.shape}", where="argument B_vertices", expected=f"({len(A)}, {n}, m), m at least 1")
    m = B.shape[2]
    size = _numbers(disturbance, "disturbance")
    if size.shape not in ((), (m,)) or not (size > 0).all():
        raise InputError(f"disturbance = {quoted(disturbance)}", where="argument disturbance",
                         expected=f"one number above zero, or {m} of them")
    T = finite_number(sample_time, "sample_time", "s")
    if T < 0:
        raise InputError(f"sample_time = {T:g} s", where="argument sample_time", expected="zero or above")
    rows, bounds = read_rows(limits, n)
    return Driven(A, B, T, np.atleast_1d(size), size.ndim == 0, rows, bounds)


def _numbers(value: ArrayLike, name: str) -> Array:
    try:
        found = np.asarray(value, float)
    except (TypeError, ValueError):
        found = np.full(0, np.nan)
    if not found.size or not np.isfinite(found).all():
        raise InputError(f"{name} = {quoted(value)}", where=f"argument {name}", expected="finite numbers")
    return found


def read_rows(limits: Any, n: int) -> tuple[Array, Array]:
    """Rows and bounds of |rows x| <= bounds: largest values of the states, or both as given."""
    if limits is None:
        return np.zeros((0, n)), np.zeros(0)
    pair = isinstance(limits, Sequence) and len(limits) == 2 and np.ndim(limits[0]) == 2
    try:
        rows = np.asarray(limits[0], float) if pair else np.eye(n)
        bounds = np.asarray(limits[1] if pair else np.broadcast_to(limits, (n,)), float)
    except (TypeError, ValueError):
        rows, bounds = np.zeros((0, 0)), np.zeros(0)
    good = rows.ndim == 2 and rows.shape[1] == n and bounds.shape == rows.shape[:1] and len(bounds)
    if not good or not np.isfinite(rows).all() or not (bounds > 0).all() or (pair and math.isinf(bounds.max())):
        raise InputError(f"limits = {quoted(limits)}", where="argument limits",
                         expected=f"one or {n} numbers above zero, or (rows of {n} numbers, bounds above zero)")
    kept = np.isfinite(bounds)
    return rows[kept], bounds[kept]
