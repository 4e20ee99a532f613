"""Sections scaled for fixed-point arithmetic: no state overflows for any bounded input."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy

from ..._arrays import Array
from ...errors import InputError
from ._sections import paths, sections

if TYPE_CHECKING:
    from ..evaluation import Filters

_LONGEST = 2**21  # samples of an impulse response
_TAIL = 1e-6  # share of the second half of the impulse response below which it is long enough
_SPARE = 1 + 1e-4  # for that tail and for rounding


@dataclass(frozen=True, eq=False)
class ScaledPath:
    """Sections of one path from the input of a free filter, for an input within -1 and 1.

    Parameters
    ----------
    sections : ndarray, shape (n, 6)
        As scipy.signal's sos; the numerators multiplied by powers of two, which costs no digit.
    gain : float
        Power of two that the last output is multiplied by.
    peak : ndarray, shape (n, 3)
        Largest output and states of each section (transposed direct form II) for any input within -1 and 1:
        between 1/2 and 1 in every section that is not zero.
    integer_bits : ndarray of int, shape (n,)
        Bits before the point, without sign, that each section needs without the scaling; negative: bits to spare.
    coefficient_bits : ndarray of int, shape (n,)
        Bits before the point, without sign, of the scaled coefficients.

    Examples
    --------
    See :class:`FixedPoint`.
    """

    sections: Array
    gain: float
    peak: Array
    integer_bits: Array
    coefficient_bits: Array


@dataclass(frozen=True, eq=False)
class FixedPoint:
    """Scaled sections of X, Y and the paths to the inputs; the free filter comes first in each.

    Parameters
    ----------
    input_scale : float
        Power of two [m] that e1+ and e2+ are divided by, so that they are within -1 and 1.
    paths : dict of ScaledPath
        "X", "Y", "X_input", "Y_input". An output is input_scale times gain times that of the sections.

    Examples
    --------
    >>> import control
    >>> import robthermal as rt
    >>> P, C = control.tf([0.01], [1, -0.99], 0.01), control.tf([20.0], [1], 0.01)
    >>> filters = rt.coupling.evaluate(P, P, C, C, X_hat=control.tf([0.0008], [1, -0.999], 0.01))
    >>> ready = filters.fixed_point(largest=1e-6)
    >>> ready.input_scale == 2.0**-19, ready.paths["X_input"].integer_bits
    (True, array([0, 7]))
    """

    input_scale: float
    paths: dict[str, ScaledPath]

    def __str__(self) -> str:
        lines = [f"{'path':<9}{'section':>8}{'bits unscaled':>15}{'coefficient bits':>18}{'peak':>8}"]
        for name, path in self.paths.items():
            rows = zip(path.integer_bits, path.coefficient_bits, path.peak.max(axis=1), strict=True)
            lines += [f"{name:<9}{k:>8}{bits:>15}{coefficients:>18}{peak:>8.3f}"
                      for k, (bits, coefficients, peak) in enumerate(rows, 1)]
        return "\n".join(lines)


def fixed_point(filters: Filters, largest: float) -> FixedPoint:
    """Scale the sections of every path.

    Parameters
    ----------
    filters : Filters
        Discrete time, short enough for sections.
    largest : float
        Bound of e1+ and e2+ [m].
    """
    if not (np.isfinite(largest) and largest > 0):
        raise InputError(f"largest = {largest!r}", where="fixed_point", expected="a positive bound of e1+ and e2+ [m]")
    sections(filters)  # refuses filters whose sections would not be accurate
    scaled = {name: _scaled(np.vstack(tables), name) for name, tables in paths(filters).items()}
    return FixedPoint(float(2.0 ** np.ceil(np.log2(largest))), scaled)


def _scaled(rows: Array, name: str) -> ScaledPath:
    peak = _peaks(rows, name) * _SPARE
    bits = _bits(peak.max(axis=1))
    scale = 2.0 ** -bits  # of the signals of each section
    table = rows.copy()
    table[:, :3] *= (scale / np.concatenate([[1.0], scale[:-1]]))[:, None]
    return ScaledPath(table, float(1 / scale[-1]), peak * scale[:, None], bits, _bits(np.abs(table).max(axis=1)))


def _bits(sizes: Array) -> Array:
    """Bits before the point of numbers of these sizes; 0 for zero."""
    return np.ceil(np.log2(np.where(sizes > 0, sizes, 1.0))).astype(int)


def _peaks(rows: Array, name: str) -> Array:
    """Sum of the magnitudes of the impulse response from the input to output and states of every section, (n, 3)."""
    radius = max(float(np.max(np.abs(np.roots(row[3:])))) for row in rows)
    length = 256
    if radius:
        length = max(length, int(min(2 * np.log(_TAIL) / np.log(radius), _LONGEST)))
    while length <= _LONGEST:
        nodes = np.abs(_nodes(rows, length))
        whole, late = nodes.sum(axis=2), nodes[:, :, length // 2 :].sum(axis=2)
        if np.all(late <= _TAIL * whole):
            return np.asarray(whole)
        length *= 2
    raise InputError(f"the impulse response of {name} is longer than {_LONGEST} samples", where="fixed_point",
                     expected="filters that forget", remedy="Use faster poles.")


def _nodes(rows: Array, length: int) -> Array:
    """Impulse response to output and next states of every section, shape (n, 3, length)."""
    x = np.zeros(length)
    x[0] = 1.0
    found = []
    for row in rows:
        y = scipy.signal.sosfilt(row[None], x)
        first = y - row[0] * x  # the state that is added to b0 x
        second = np.zeros(length)
        second[1:] = row[2] * x[:-1] - row[5] * y[:-1]
        found.append([y, first, second])
        x = y
    return np.array(found)
