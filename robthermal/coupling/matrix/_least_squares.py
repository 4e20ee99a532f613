"""Filters of least variance of e12, a quadratic penalty at every frequency added: least squares in the coefficients."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..._arrays import Array
from ..._control import control
from ..synthesis import Basis
from ..systems import Response
from ._problem import MatrixProblem
from ._spectra import at

_POINTS = 1200
_REGULAR = 1e-12  # share of the largest curvature that directions without effect get


@dataclass(frozen=True, eq=False)
class Halves:
    """Everything the search needs at its frequencies; half 0 is X (on S2 W2), half 1 is Y (on S1 W1).

    Parameters
    ----------
    problem : MatrixProblem
        What is designed for.
    basis : Basis
        Of every entry of X_hat and Y_hat.
    """

    problem: MatrixProblem
    basis: Basis

    @cached_property
    def omega(self) -> Array:
        """Frequencies of the search [rad/s]."""
        return self.problem.grid(_POINTS)

    @cached_property
    def quadrature(self) -> Array:
        """Weights of the frequencies in the variance: trapezoids, the first flat down to zero."""
        steps = np.diff(self.omega)
        weights = np.concatenate([[self.omega[0]], np.zeros(len(steps))])
        weights[:-1] += steps / 2
        weights[1:] += steps / 2
        return weights * (self.problem.dt or 1.0) / np.pi

    @cached_property
    def functions(self) -> Array:
        """Basis functions, (n_f, n)."""
        return np.asarray(Response(self.basis.all())(self.omega)[:, 0].T)

    @cached_property
    def signals(self) -> list[Array]:
        """S2 W2 and S1 W1, (n_f, p, q)."""
        return [at(noise, self.omega) for noise in reversed(self.problem.disturbed)]

    @cached_property
    def maps(self) -> tuple[Array, list[Array]]:
        """Weight, (n_f, ., p), and weight Z1, weight Z2, (n_f, ., m)."""
        weight = at(self.problem.weight, self.omega)
        return weight, [weight @ at(loop.Z, self.omega) for loop in self.problem.factors.loops]

    @cached_property
    def denominators(self) -> list[Array]:
        """Dk2 and Dk1, (n_f, p, p)."""
        return [at(loop.Dk, self.omega) for loop in reversed(self.problem.factors.loops)]

    def filter(self, coefficients: Array) -> control.StateSpace:
        """X_hat or Y_hat of coefficients (n, m, p) as a state space: one chain of basis functions per input."""
        n, m, p = coefficients.shape
        eye = np.eye(p)
        C = np.concatenate([coefficients[1:, :, j].T for j in range(p)], axis=1)  # (m, p (n - 1)), chain by chain
        if not np.any(C):
            return control.ss([], [], [], coefficients[0], self.problem.dt)
        return control.StateSpace(np.kron(eye, self.basis.A), np.kron(eye, self.basis.B), C, coefficients[0],
                                  self.problem.dt, remove_useless_states=False)

    def response(self, coefficients: Array) -> Array:
        """X_hat or Y_hat at the frequencies, (n_f, m, p)."""
        return np.einsum("fk,kij->fij", self.functions, coefficients)

    def solve(self, half: int, penalty: Array | None = None) -> Array:
        """Coefficients (n, m, p) of the least ∫ |weight (I + Z F) S W|² + Σ penalty_ij |(F Dk)_ij|².

        Parameters
        ----------
        half : int
            0: X_hat, 1: Y_hat.
        penalty : ndarray, shape (n_f, m, p), optional
            Weights of the squared entries of F Dk; quadrature weights come on top.
        """
        weight, maps = self.maps
        left, right = maps[half], self.signals[half]
        n, m, p = self.functions.shape[1], left.shape[2], right.shape[1]
        inner = np.einsum("fki,fkj,f->fij", left.conj(), left, self.quadrature)  # (n_f, m, m)
        outer = np.einsum("fik,fjk->fij", right, right.conj())  # (n_f, p, p)
        hessian = self._gram("fac,fdb->fabcd", inner, outer)
        wanted = np.einsum("fki,fkl,flq,fjq,f->fij", left.conj(), weight, right, right.conj(), self.quadrature)
        if penalty is not None:
            D = self.denominators[half]
            hessian += self._penalty(penalty * self.quadrature[:, None, None], D, m)
        gradient = np.einsum("fk,fij->kij", self.functions.conj(), wanted).real.reshape(-1)
        size = float(np.max(np.abs(np.diag(hessian)))) or 1.0
        found = np.linalg.solve(hessian + _REGULAR * size * np.eye(len(hessian)), -gradient)
        return np.asarray(found.reshape(n, m, p))

    def variance(self, half: int, coefficients: Array) -> float:
        """∫ |weight (I + Z F) S W|², on the grid."""
        weight, maps = self.maps
        error = (weight + maps[half] @ self.response(coefficients)) @ self.signals[half]
        return float(np.sum(np.abs(error) ** 2, axis=(1, 2)) @ self.quadrature)

    def _gram(self, how: str, inner: Array, outer: Array) -> Array:
        """Σ_f conj(f_k) f_l inner_ac outer_db, coefficients ordered (k, a, b): real part."""
        n, (m, p) = self.functions.shape[1], (inner.shape[1], outer.shape[1])
        entries = np.einsum(how, inner, outer).reshape(len(self.omega), -1)  # (n_f, m p m p)
        pairs = (self.functions[:, :, None].conj() * self.functions[:, None, :]).reshape(len(self.omega), -1)
        gram = (pairs.T @ entries).real.reshape(n, n, m, p, m, p)
        return gram.transpose(0, 2, 3, 1, 4, 5).reshape(n * m * p, n * m * p)

    def _penalty(self, weights: Array, D: Array, m: int) -> Array:
        """Gram matrix of Σ_ij weights_ij |(F D)_ij|²: row i of F by itself."""
        outer = np.einsum("fbj,fij,fdj->fibd", D.conj(), weights, D)  # of conj(F_ib) F_id
        n, p = self.functions.shape[1], D.shape[1]
        pairs = (self.functions[:, :, None].conj() * self.functions[:, None, :]).reshape(len(self.omega), -1)
        gram = (pairs.T @ outer.reshape(len(self.omega), -1)).real.reshape(n, n, m, p, p)
        full = np.einsum("klibd,ij->kibljd", gram, np.eye(m))
        return np.asarray(full.reshape(n * m * p, n * m * p))
