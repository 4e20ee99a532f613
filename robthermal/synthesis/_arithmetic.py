"""Two arithmetics for the same formulas: floats, and midpoints of balls with as many bits as a stiff problem needs.

Neither proves anything. Matrices are numpy arrays, of floats or of `flint.arb`; what differs is inversion, orthogonal
completion and the stabilizing solution of a Riccati equation.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from flint import arb, arb_mat, ctx
from scipy.linalg import schur

from .._arrays import Array

_LARGE = 80  # states above which the sign function replaces the Schur form, in floats
_STEPS = 80  # of the sign function, which converges quadratically
_ROUNDING = 1e-14  # of a column: what is left where two products cancel
_ZERO = 1e-11  # of a solution in floats, in balanced coordinates: nothing but rounding
_ASYMMETRY = 1e-5  # of a solution, relative: above it the invariant subspace was not the right one


class Arithmetic(Protocol):
    """What the formulas need of an arithmetic."""

    def array(self, matrix: Array) -> Array:
        """The numbers of this arithmetic."""

    def inv(self, matrix: Array) -> Array:
        """Inverse; LinAlgError where there is none."""

    def difference(self, left: Array, right: Array) -> Array:
        """left - right, what is only rounding set to zero: its sign would decide whether a solution is definite."""

    def orthogonal(self, matrix: Array) -> tuple[Array, Array]:
        """Q, R with matrix = Q [R; 0], Q orthogonal and square."""

    def riccati(self, H: Array) -> Array | None:
        """X with [1; X] a basis of the stable subspace of a Hamiltonian matrix; None where there is none."""


class Floats:
    """Double precision."""

    def array(self, matrix: Array) -> Array:
        return np.asarray(matrix, float)

    def inv(self, matrix: Array) -> Array:
        return np.linalg.inv(matrix)

    def difference(self, left: Array, right: Array) -> Array:
        found = left - right
        return np.where(abs(found) <= _ROUNDING * np.linalg.norm(right, axis=0), 0.0, found)

    def orthogonal(self, matrix: Array) -> tuple[Array, Array]:
        Q, R = np.linalg.qr(matrix, mode="complete")
        return Q, R[:matrix.shape[1]]

    def riccati(self, H: Array) -> Array | None:
        n = len(H) // 2
        if n == 0:
            return np.zeros((0, 0))
        scale = _balance(H)
        balanced = H.copy()
        balanced[:n, n:] *= scale
        balanced[n:, :n] /= scale
        if not np.isfinite(balanced).all():
            return None
        try:
            X = _from_schur(balanced) if n <= _LARGE else _from_sign(balanced)
        except (np.linalg.LinAlgError, ValueError):
            return None
        X = None if X is None else _symmetric(X, _ZERO)
        return None if X is None else X * scale


@dataclass(frozen=True)
class Balls:
    """Midpoints of balls.

    Parameters
    ----------
    bits : int
        Precision of every number [bit].
    """

    bits: int

    @contextmanager
    def working(self) -> Iterator[None]:
        """Set the precision for a block of statements, and restore the caller's."""
        before = ctx.prec
        ctx.prec = self.bits
        try:
            yield
        finally:
            ctx.prec = before

    def array(self, matrix: Array) -> Array:
        found = np.empty(matrix.shape, object)
        for place, value in np.ndenumerate(matrix):
            found[place] = value if isinstance(value, arb) else arb(float(value))
        return found

    def inv(self, matrix: Array) -> Array:
        if not matrix.size:
            return matrix
        try:
            return _from_balls(_to_balls(matrix).inv())
        except ZeroDivisionError:
            raise np.linalg.LinAlgError("singular to the working precision") from None

    def difference(self, left: Array, right: Array) -> Array:
        return left - right  # its rounding is far below `zero` of the solution

    def orthogonal(self, matrix: Array) -> tuple[Array, Array]:
        """Gram-Schmidt, twice, with unit vectors where the columns end."""
        rows, columns = matrix.shape
        start = np.linalg.qr(floats(matrix), mode="complete")[0]
        Q = self.array(start)
        Q[:, :columns] = matrix
        for k in range(rows):
            for _ in range(2):
                Q[:, k] = Q[:, k] - Q[:, :k] @ (Q[:, :k].T @ Q[:, k]) if k else Q[:, k]
                length: Any = Q[:, k] @ Q[:, k]
                Q[:, k] = Q[:, k] / length.sqrt()
            Q[:, k] = _middles(Q[:, k])
        return Q, Q[:, :columns].T @ matrix

    def riccati(self, H: Array) -> Array | None:
        n = len(H) // 2
        if n == 0:
            return H
        try:
            sign = _sign(_to_balls(H), self.bits)
        except ZeroDivisionError:
            return None
        if sign is None:
            return None
        W = _from_balls(sign)
        one = self.array(np.eye(n))
        left, right = np.vstack([W[:n, n:], W[n:, n:] + one]), -np.vstack([W[:n, :n] + one, W[n:, :n]])
        try:
            return _symmetric(self.inv(left.T @ left) @ (left.T @ right), 2.0 ** (-self.bits // 2))
        except np.linalg.LinAlgError:
            return None


def floats(matrix: Array) -> Array:
    """Nearest doubles of a matrix of either arithmetic."""
    if matrix.dtype != object:
        return matrix
    return np.array([float(value) for value in matrix.ravel()]).reshape(matrix.shape)


def _sign(matrix: arb_mat, bits: int) -> arb_mat | None:
    """Matrix sign function by Newton's iteration with determinantal scaling (Byers 1987); None where it stalls."""
    size = matrix.nrows()
    Z, tiny = matrix, 2.0 ** (-bits // 2)
    for step in range(_STEPS):
        inverse = Z.inv().mid()
        factor = arb(1)
        if step < 12:
            determinant = abs(Z.det().mid())
            if not determinant > 0:
                return None
            factor = ((-determinant.log() / size).exp()).mid()
        moved = ((Z * factor + inverse * (1 / factor)) * arb(0.5)).mid()
        change, length = _largest(moved - Z), _largest(moved)
        Z = moved
        if change <= tiny * length:
            return Z
    return None


def _largest(matrix: arb_mat) -> float:
    return max(abs(float(value.mid())) for value in matrix.entries())


def _balance(H: Array) -> float:
    """Power of two that makes the off-diagonal blocks of a Hamiltonian alike in size."""
    n = len(H) // 2
    upper, lower = np.linalg.norm(H[:n, n:]), np.linalg.norm(H[n:, :n])
    return float(2.0 ** np.round(np.log2(lower / upper) / 2)) if upper > 0 and lower > 0 else 1.0


def _from_schur(H: Array) -> Array | None:
    """X by the ordered Schur form (Laub 1979)."""
    n = len(H) // 2
    _, U, count = schur(H, sort="lhp")
    return np.linalg.solve(U[:n, :n].T, U[n:, :n].T).T if count == n else None


def _from_sign(H: Array) -> Array | None:
    """X by the matrix sign function: some times faster than the Schur form of a large matrix, a little less exact."""
    n, Z = len(H) // 2, H
    for step in range(_STEPS):
        inverse = np.linalg.inv(Z)
        factor = float(np.exp(-np.linalg.slogdet(Z)[1] / (2 * n))) if step < 12 else 1.0
        moved = (factor * Z + inverse / factor) / 2
        done = np.linalg.norm(moved - Z, 1) <= 1e-12 * np.linalg.norm(moved, 1)
        Z = moved
        if done:
            break
    else:
        return None
    one = np.eye(n)
    left, right = np.vstack([Z[:n, n:], Z[n:, n:] + one]), -np.vstack([Z[:n, :n] + one, Z[n:, :n]])
    found: Array = np.linalg.lstsq(left, right, rcond=None)[0]
    return found


def _symmetric(X: Array, zero: float) -> Array | None:
    """X without its rounding; None where it is not symmetric, nothing but zero where it is below `zero`."""
    plain = floats(X)
    size = float(np.linalg.norm(plain))
    if size <= zero:
        return X * 0
    if not np.isfinite(size) or np.linalg.norm(plain - plain.T) > _ASYMMETRY * size:
        return None
    half: Array = (X + X.T) / 2
    return half if X.dtype != object else _middles(half)


def _to_balls(matrix: Array) -> arb_mat:
    return arb_mat(matrix.shape[0], matrix.shape[1], [arb(value) for value in matrix.ravel()])


def _from_balls(matrix: arb_mat) -> Array:
    found = np.empty((matrix.nrows(), matrix.ncols()), object)
    for i, row in enumerate(matrix.mid().tolist()):
        found[i] = row
    return found


def _middles(matrix: Array) -> Array:
    found = np.empty(matrix.shape, object)
    for place, value in np.ndenumerate(matrix):
        found[place] = arb(value).mid()
    return found
