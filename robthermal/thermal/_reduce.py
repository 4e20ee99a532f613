"""Model reduction: balanced truncation and modal truncation, with the error computed after the fact."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import scipy

from .._control import control
from .._drawing import axes_for
from ..errors import InputError, Outcome
from ._outcomes import ThermalCode
from ._terms import Array

_MOST_STATES = 3000


@dataclass(frozen=True)
class Reduction:
    """A reduced model and what it costs.

    Parameters
    ----------
    model : control.StateSpace
        Reduced model; the full one when no order meets the tolerance.
    order : int
        Number of states of the reduced model.
    error : float
        Largest singular value of the error over frequency, computed from the error system (lower bound, exact to 1e-4).
    bound : float
        A-priori bound: twice the neglected Hankel singular values; infinite for the modal method.
    hankel : ndarray
        Hankel singular values of the full model (balanced) or modal contributions at DC (modal), sorted.
    outcome : Outcome
        Whether the tolerance is met.
    """

    model: control.StateSpace
    order: int
    error: float
    bound: float
    hankel: Array
    outcome: Outcome

    def plot(self, ax: Any = None) -> Any:
        """Plot the singular values and the chosen order; returns the matplotlib axes.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Axes to draw into; default new ones.
        """
        ax = axes_for(ax)
        ax.semilogy(range(1, len(self.hankel) + 1), np.maximum(self.hankel, 1e-300), "o")
        ax.axvline(self.order + 0.5, linestyle="--", label=f"order {self.order}")
        ax.set(xlabel="number of the state [-]", ylabel="contribution [output/input]", title="model reduction")
        ax.legend()
        return ax


def reduce(model: control.StateSpace, *, order: int | None = None, tolerance: float | None = None,
           method: Literal["balanced", "modal"] = "balanced") -> Reduction:
    """Reduce a stable continuous-time state space.

    Parameters
    ----------
    model : control.StateSpace
        For example from `linearize`.
    order : int, optional
        States to keep.
    tolerance : float, optional
        Accepted error, absolute, in the unit of the largest gain (K per unit of input). The smallest order whose
        *computed* error meets it is returned. Give one of `order` and `tolerance`.
    method : {"balanced", "modal"}
        Balanced truncation, or modal truncation with the static gain of the dropped modes kept.

    Returns
    -------
    Reduction
        If no order below the full one meets the tolerance, its outcome says so.

    Raises
    ------
    InputError
        Discrete time, an unstable model, both or none of order and tolerance.

    References
    ----------
    K. Glover, "All optimal Hankel-norm approximations of linear multivariable systems and their L∞-error bounds",
    Int. J. Control 39 (1984): the bound 2 Σ σ.

    Examples
    --------
    >>> import robthermal as rt
    >>> G = rt.thermal.linearize(rt.systems.two_module())
    >>> small = rt.thermal.reduce(G, tolerance=0.01)
    >>> small.error <= 0.01 and small.order < 18
    True
    """
    _check(model, order, tolerance, method)
    truncate, hankel, bounds = (_balanced if method == "balanced" else _modal)(model)
    n = model.nstates
    if order is not None:
        reduced = truncate(order)
        error = hinf_error(model, reduced)
        return Reduction(reduced, order, error, bounds[order], hankel,
                         ThermalCode.REDUCED.outcome(f"{n} states reduced to {order}; error {error:.3g}."))
    accepted = float(tolerance) if tolerance is not None else 0.0
    low, high = 0, n  # the error falls with the order for balanced truncation; verified below for what is returned
    while low < high:
        middle = (low + high) // 2
        if hinf_error(model, truncate(middle)) <= accepted:
            high = middle
        else:
            low = middle + 1
    if high >= n:
        return Reduction(model, n, 0.0, 0.0, hankel, ThermalCode.NOT_REDUCIBLE.outcome(
            f"No order below {n} meets {accepted:g}: every state matters at this tolerance."))
    reduced = truncate(high)
    error = hinf_error(model, reduced)
    return Reduction(reduced, high, error, bounds[high], hankel,
                     ThermalCode.REDUCED.outcome(
                         f"{n} states reduced to {high}; error {error:.3g} within {accepted:g}."))


def _check(model: Any, order: int | None, tolerance: float | None, method: str) -> None:
    if not isinstance(model, control.StateSpace) or not model.isctime():
        raise InputError("model is not a continuous-time control.StateSpace", where="argument model",
                         remedy="Use rt.thermal.linearize(system).")
    if model.nstates > _MOST_STATES:
        raise InputError(f"{model.nstates} states", where="argument model", expected=f"at most {_MOST_STATES}",
                         remedy="Coarsen the network first.")
    if np.linalg.eigvals(model.A).real.max(initial=-1.0) >= 0:
        raise InputError("the model is not stable", where="argument model", remedy="Linearize at a stable equilibrium.")
    if (order is None) == (tolerance is None):
        raise InputError("give order or tolerance, one of them", where="arguments order, tolerance")
    if order is not None and not (isinstance(order, int) and 0 <= order < model.nstates):
        raise InputError(f"order = {order}", where="argument order",
                         expected=f"a whole number from 0 to {model.nstates - 1}")
    if tolerance is not None and not tolerance > 0:
        raise InputError(f"tolerance = {tolerance}", where="argument tolerance", expected="a positive number")
    if method not in ("balanced", "modal"):
        raise InputError(f"method = {method!r}", where="argument method", expected='"balanced" or "modal"')


def _named(model: control.StateSpace, A: Array, B: Array, C: Array, D: Array) -> control.StateSpace:
    return control.ss(A, B, C, D, inputs=list(model.input_labels), outputs=list(model.output_labels),
                      name=f"{model.name} reduced")


def _balanced(model: control.StateSpace) -> tuple[Any, Array, Array]:
    """Square-root balanced truncation."""
    R = _factor(scipy.linalg.solve_continuous_lyapunov(model.A, -model.B @ model.B.T))
    L = _factor(scipy.linalg.solve_continuous_lyapunov(model.A.T, -model.C.T @ model.C))
    U, sigma, Vh = scipy.linalg.svd(L.T @ R)
    bounds = 2 * np.append(np.cumsum(sigma[::-1])[::-1], 0.0)

    def truncate(r: int) -> control.StateSpace:
        scale = 1 / np.sqrt(np.maximum(sigma[:r], 1e-300))
        left, right = (L @ U[:, :r]) * scale, (R @ Vh[:r].T) * scale
        return _named(model, left.T @ model.A @ right, left.T @ model.B, model.C @ right, model.D)

    return truncate, sigma, bounds


def _factor(gramian: Array) -> Array:
    values, vectors = np.linalg.eigh((gramian + gramian.T) / 2)
    return vectors * np.sqrt(np.maximum(values, 0.0))


def _modal(model: control.StateSpace) -> tuple[Any, Array, Array]:
    """Modal truncation in order of DC contribution; the dropped modes keep their static gain."""
    values, V = scipy.linalg.eig(model.A)
    if np.abs(values.imag).max(initial=0.0) > 1e-9 * np.abs(values).max(initial=1.0):
        raise InputError("the model oscillates", where="argument model", expected="real poles for the modal method",
                         remedy='Use method="balanced".')
    values, V = values.real, V.real
    b, c = np.linalg.solve(V, model.B), model.C @ V
    weight = np.linalg.norm(b, axis=1) * np.linalg.norm(c, axis=0) / np.abs(values)
    rank = np.argsort(-weight)

    def truncate(r: int) -> control.StateSpace:
        keep, drop = rank[:r], rank[r:]
        D = model.D - (c[:, drop] / values[drop]) @ b[drop]
        return _named(model, np.diag(values[keep]), b[keep], c[:, keep], D)

    return truncate, weight[rank], np.append(np.full(model.nstates, np.inf), 0.0)


def hinf_error(model: control.StateSpace, reduced: control.StateSpace) -> float:
    """Largest singular value over frequency of the difference of two stable models, by the Hamiltonian test.

    Parameters
    ----------
    model, reduced : control.StateSpace
        Stable, same inputs and outputs.

    Returns
    -------
    float
        Accurate to 1e-4 relative.

    References
    ----------
    N. Bruinsma and M. Steinbuch, "A fast algorithm to compute the H∞-norm", Systems & Control Letters 14 (1990).

    Examples
    --------
    >>> import control, robthermal as rt
    >>> round(rt.thermal.hinf_error(control.ss(-1, 1, 1, 0), control.ss([], [], [], 0)), 4)
    1.0
    """
    A = np.block([[model.A, np.zeros((model.nstates, reduced.nstates))],
                  [np.zeros((reduced.nstates, model.nstates)), reduced.A]])
    B, C = np.vstack([model.B, reduced.B]), np.hstack([model.C, -reduced.C])
    D = model.D - reduced.D
    poles = np.abs(np.linalg.eigvals(A)) if len(A) else np.zeros(0)
    frequencies = np.concatenate([[0.0], poles])
    best = max((_gain(A, B, C, D, w) for w in frequencies), default=0.0)
    best = max(best, float(np.linalg.norm(D, 2)) if D.size else 0.0)
    for _ in range(30):
        level = best * (1 + 1e-4) + 1e-300
        crossings = _crossings(A, B, C, D, level)
        if crossings.size < 2:
            return float(best)
        middles = 0.5 * (crossings[1:] + crossings[:-1])
        best = max(best, max(_gain(A, B, C, D, w) for w in middles))
        if best < level:
            return float(level)
    return float(best)


def _gain(A: Array, B: Array, C: Array, D: Array, w: float) -> float:
    return float(np.linalg.norm(C @ np.linalg.solve(1j * w * np.eye(len(A)) - A, B) + D, 2)) if len(A) else 0.0


def _crossings(A: Array, B: Array, C: Array, D: Array, level: float) -> Array:
    """Frequencies at which a singular value equals level: imaginary eigenvalues of the Hamiltonian."""
    R = level**2 * np.eye(D.shape[1]) - D.T @ D
    inner = A + B @ np.linalg.solve(R, D.T @ C)
    top = B @ np.linalg.solve(R, B.T)
    bottom = -C.T @ (np.eye(len(D)) + D @ np.linalg.solve(R, D.T)) @ C
    values = np.linalg.eigvals(np.block([[inner, top], [bottom, -inner.T]]))
    on_axis = np.abs(values.real) < 1e-8 * (1 + np.abs(values))
    return np.sort(values.imag[on_axis & (values.imag >= 0)])
