"""What a coupling of several channels does, frequency by frequency."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..._arrays import Array
from ..evaluation import Spectra, cumulative
from ..systems import Response
from ._realization import youla_matrix

if TYPE_CHECKING:
    from ._filters import MatrixFilters


def matrix_spectra(filters: MatrixFilters, points: int) -> Spectra:
    """Largest singular values and the density of e12.

    Parameters
    ----------
    filters : MatrixFilters
        Coupling that is looked at.
    points : int
        Logarithmic frequencies; corners, resonances and the measured frequencies come on top.
    """
    problem = filters.problem
    omega = problem.grid(points)
    omega = omega[omega > 0]
    one = np.eye(problem.one.P.noutputs)
    factor = [one + at(filters.Y, omega), one + at(filters.X, omega)]
    loops = [at(loop.S, omega) for loop in problem.factors.loops]
    noise = [S @ at(W, omega) for S, W in zip(loops, problem.disturbances, strict=True)]
    density = np.sqrt(2 * (problem.dt or 1.0))  # one-sided; discrete noise of variance 1 has the two-sided density dt
    before = density * np.sqrt(sum(size(part) ** 2 for part in noise))
    after = density * np.sqrt(sum(size(F @ part) ** 2 for F, part in zip(factor, noise, strict=True)))
    hertz = omega / (2 * np.pi)
    coupled = np.array([gain(F @ S) for F, S in zip(factor, loops, strict=True)])
    alone, improvement = (np.array([gain(part) for part in parts]) for parts in (loops, factor))
    return Spectra(hertz, alone, coupled, improvement, before, after,
                   cumulative(hertz, before), cumulative(hertz, after), _robust(filters, omega), np.zeros(len(omega)),
                   filters.norms["robust"])


def at(system: object, omega: Array) -> Array:
    """Responses, frequency first.

    Parameters
    ----------
    system : StateSpace
        Any number of inputs and outputs.
    omega : ndarray, shape (n_f,)
        Frequencies of the responses [rad/s].
    """
    return np.moveaxis(Response(system)(omega), -1, 0)


def gain(matrices: Array) -> Array:
    """Largest singular values.

    Parameters
    ----------
    matrices : ndarray, shape (n_f, p, m)
        Responses, frequency first.
    """
    return np.asarray(np.linalg.norm(matrices, 2, axis=(1, 2)))


def size(matrices: Array) -> Array:
    """Frobenius norms.

    Parameters
    ----------
    matrices : ndarray, shape (n_f, p, m)
        Responses, frequency first.
    """
    return np.asarray(np.linalg.norm(matrices, axis=(1, 2)))


def _robust(filters: MatrixFilters, omega: Array) -> Array:
    problem = filters.problem
    if problem.uncertainty is None:
        return np.zeros(len(omega))
    envelope = np.moveaxis(problem.uncertainty.at(omega), -1, 0)
    delta = np.abs(at(youla_matrix(problem, filters.X_hat, filters.Y_hat), omega))
    return np.asarray(np.max(np.abs(np.linalg.eigvals(delta @ envelope)), axis=1))
