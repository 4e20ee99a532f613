"""Second-order sections of the filters: what a real-time controller implements."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import scipy

from ..._arrays import Array
from ..._control import control
from ...errors import InputError
from ..systems import Zpk, grouped, siso, zpk_of

if TYPE_CHECKING:
    from ..evaluation import Filters

_ACCURACY = 1e-3
_QUIET = 1e-3  # of the largest magnitude: below, errors count against this


def sections(filters: Filters) -> dict[str, Array]:
    """Sections of X, Y and their inputs: those of Z or Q, then those of the free filter.

    Parameters
    ----------
    filters : Filters
        Filters in discrete time.
    """
    if not filters.problem.dt:
        raise InputError("continuous-time filters have no sections", where="sections", expected="discrete time",
                         remedy="Discretize plants and controllers first.")
    result = {}
    for name, (free, fixed) in paths(filters).items():
        rows = np.vstack([fixed, free]) if np.any(free[0, :3]) else free
        _expect_accurate(rows, getattr(filters, name), name)
        result[name] = rows
    return result


def paths(filters: Filters) -> dict[str, tuple[Array, Array]]:
    """Sections of the free filter, and those of the Z or Q that follows it, of X, Y, X_input and Y_input.

    Parameters
    ----------
    filters : Filters
        Filters in discrete time.
    """
    one, two = filters.problem.one, filters.problem.two
    free = {hat: _rows(zpk_of(getattr(filters, hat), hat, filters.problem.dt)) for hat in ("X_hat", "Y_hat")}
    fixed = {"X": ("X_hat", one.Z), "Y": ("Y_hat", two.Z), "X_input": ("X_hat", one.Q), "Y_input": ("Y_hat", two.Q)}
    return {name: (free[hat], _rows(factor)) for name, (hat, factor) in fixed.items()}


def _rows(system: Zpk) -> Array:
    """(n, 6) rows b0 b1 b2 1 a1 a2 in powers of 1/z; the gain in the first."""
    rows = [[*_padded(zeros, len(poles)), *_padded(poles, len(poles))] for poles, zeros in grouped(system)]
    table = np.array(rows or [[1.0, 0.0, 0.0, 1.0, 0.0, 0.0]])
    table[0, :3] *= system.gain
    return table


def _padded(roots: list[complex], degree: int) -> list[float]:
    """Coefficients in 1/z of prod(z - root)/z^degree."""
    polynomial = np.real(np.poly(roots)) if roots else np.ones(1)
    return [*np.zeros(degree - len(roots)), *polynomial, *np.zeros(2 - degree)]


def _expect_accurate(rows: Array, system: control.StateSpace, name: str) -> None:
    top = np.pi / float(system.dt)
    omega = np.geomspace(1e-5 * top, 0.9999 * top, 500)
    exact = siso(system, omega)
    error = np.abs(scipy.signal.sosfreqz(rows, omega * float(system.dt))[1] - exact)
    size = np.maximum(np.abs(exact), _QUIET * float(np.max(np.abs(exact))))
    worst = float(np.max(np.divide(error, size, out=np.zeros_like(error), where=size > 0)))
    if not worst <= _ACCURACY:
        raise InputError(f"second-order sections of {name} are accurate to {worst:.2g} only", where="sections",
                         expected=f"{_ACCURACY:g}", remedy="Reduce the filters first: filters.reduce().")
