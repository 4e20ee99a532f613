"""The structured singular value of matrices."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robthermal.errors import InputError, Outcome

from .._outcomes import CouplingCode
from ._blocks import Complex, Real, Structure, read_blocks
from ._cycles import cyclic_part
from ._lower import worst_perturbation
from ._result import MET, MuBound
from ._upper import best_scaling


def mu(M: ArrayLike, blocks: Sequence[Sequence[Any]] | None = None) -> MuBound:
    """Bound the structured singular value of one matrix, or of a frequency response at every frequency at once.

    mu(M) = 1 / min { sigma_max(Delta) : det(I − M Delta) = 0 } over complex Delta of the given block structure (Doyle,
    1982). For three or fewer full blocks both bounds are mu; for more, or repeated ones, they may differ.

    Parameters
    ----------
    M : array_like, shape (p, m) or (p, m, n_f)
        Complex matrix, or one per frequency (frequency last).
    blocks : sequence of tuple, optional
        Blocks of Delta (m, p) in order: ("full", rows, columns), sizes of the block of Delta, or ("repeated", n), a
        complex number times the identity. Omitted: one full block, mu = sigma_max.

    Returns
    -------
    MuBound
        Every lower bound comes with its `delta`. Bounds hold at these frequencies only; `mu_bound` covers all.

    Raises
    ------
    InputError
        Block sizes that do not match M, numbers that are not finite, unknown blocks.

    Notes
    -----
    The upper bound is within 1e-5 of the best that scalings can give, except where no best scaling exists.
    See "Structured singular value" in the explanations. Reference: Packard and Doyle, Automatica 29 (1993).

    Examples
    --------
    >>> import robthermal as rt
    >>> M = [[2.0, 2.0], [-1.0, -1.0]]  # Skogestad and Postlethwaite, example 8.5
    >>> round(rt.coupling.mu(M).upper, 5)
    3.16228
    >>> b = rt.coupling.mu(M, [("full", 1, 1), ("full", 1, 1)])
    >>> round(b.lower, 5), round(b.upper, 5)
    (3.0, 3.0)
    """
    given = _read_matrix(M)
    single = given.ndim == 2
    stack = np.ascontiguousarray(np.moveaxis(given.reshape(*given.shape[:2], -1), 2, 0))
    structure = read_blocks(blocks, (stack.shape[2], stack.shape[1]))
    lower, upper, delta = bounds(stack, structure)
    outcome = _outcome(lower, upper)
    if single:
        return MuBound(float(lower[0]), float(upper[0]), delta[0], outcome)
    return MuBound(lower, upper, np.moveaxis(delta, 0, 2), outcome)


def bounds(M: Complex, structure: Structure) -> tuple[Real, Real, Complex]:
    """Lower and upper bounds (n_f,) and Delta (n_f, m, p), frequency first."""
    largest = np.abs(M).max((1, 2))
    size = np.where(largest > 0, largest, 1.0)  # squares of M would overflow beyond 1e154
    part = cyclic_part(M / size[:, None, None], structure)
    scaling = best_scaling(part, structure)
    lower, delta = worst_perturbation(part, structure, scaling.upper, scaling.dual)
    # Where both meet, rounding may put the lower bound above the upper one: the upper one is what must hold.
    return lower * size, np.maximum(scaling.upper, lower) * size, delta / size[:, None, None]


def _outcome(lower: Real, upper: Real) -> Outcome:
    gap = upper - lower
    if (gap <= MET * upper).all():
        return CouplingCode.MET.outcome()
    worst = int(np.argmax(gap / np.maximum(upper, np.finfo(float).tiny)))
    text = (f"mu is between the bounds: the largest gap is {lower[worst]:.5g} to {upper[worst]:.5g}. "
            "With more than three blocks, or repeated ones, scalings need not reach mu:")
    return CouplingCode.GAP.outcome(text)


def _read_matrix(M: ArrayLike) -> Complex:
    try:
        given = np.asarray(M, dtype=complex)
    except (TypeError, ValueError) as error:
        raise InputError(f"M is not an array of numbers ({error})", where="M") from None
    if given.ndim not in (2, 3) or not given.size:
        raise InputError(f"M has shape {given.shape}", where="M", expected="(p, m) or (p, m, n_f), none of them 0",
                         remedy="Frequency is the last axis, as in python-control.")
    bad = np.argwhere(~np.isfinite(given))
    if len(bad):
        raise InputError(f"M is {given[tuple(bad[0])]} at index {tuple(int(k) for k in bad[0])}", where="M",
                         expected="finite numbers", remedy="Leave out that frequency.")
    return given
