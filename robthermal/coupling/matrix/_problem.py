"""Two subsystems of several inputs and outputs, what disturbs them, what is uncertain, and what counts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..._arrays import Array
from ..._control import control
from ...errors import InputError
from ..factors import (
    MatrixFactors,
    MatrixLoop,
    Uncertainty,
    corner_grid,
    matched_matrix,
    matrix_factors,
    matrix_uncertainty,
)
from ..systems import Zpk, expect_stable, matrix_of, series


@dataclass(frozen=True, eq=False)
class MatrixProblem:
    """What a coupling of several channels is designed for.

    Parameters
    ----------
    factors : MatrixFactors
        The two subsystems with their factors.
    disturbances : tuple of StateSpace
        Shaping filters W1, W2 of v1, v2.
    weight : StateSpace
        Performance filter on e12.
    uncertainty : Uncertainty or None
        In these factors.
    """

    factors: MatrixFactors
    disturbances: tuple[control.StateSpace, control.StateSpace]
    weight: control.StateSpace
    uncertainty: Uncertainty | None

    @property
    def dt(self) -> float:
        """Sample time [s]; 0 in continuous time."""
        return self.factors.dt

    @property
    def samples(self) -> int:
        """Samples in the window: none, a window is for one channel each."""
        return 0

    @property
    def window(self) -> float | None:
        """Length of the exposure [s]: None."""
        return None

    @property
    def one(self) -> MatrixLoop:
        """Subsystem 1."""
        return self.factors.loops[0]

    @property
    def two(self) -> MatrixLoop:
        """Subsystem 2."""
        return self.factors.loops[1]

    @cached_property
    def disturbed(self) -> tuple[control.StateSpace, control.StateSpace]:
        """S1 W1 and S2 W2."""
        first, second = (series(loop.S, W) for loop, W in zip(self.factors.loops, self.disturbances, strict=True))
        return first, second

    @property
    def signals(self) -> tuple[control.StateSpace, control.StateSpace]:
        """What I + Y and I + X multiply in e12: S1 W1 and S2 W2."""
        return self.disturbed

    def grid(self, points: int = 400) -> Array:
        """Frequencies [rad/s] that see every corner and resonance, and those of the measured plants.

        Parameters
        ----------
        points : int
            Number of logarithmic points; the others come on top.
        """
        systems = [part for loop in self.factors.loops for part in (loop.P, loop.C, loop.S, loop.Q)]
        none = np.zeros(0, dtype=complex)
        roots = [Zpk(none, np.linalg.eigvals(part.A), 1.0, self.dt)
                 for part in (*systems, *self.disturbances, self.weight) if part.nstates]
        grid = corner_grid(roots or [Zpk(none, none, 1.0, self.dt)], points, lowest=0.1)
        if self.uncertainty is None:
            return grid
        return np.unique(np.concatenate([grid, self.uncertainty.omega[self.uncertainty.omega > 0]]))


def prepare_matrix(P1: Any, P2: Any, C1: Any, C2: Any, *, uncertainty: Any = None, disturbances: Any = (1, 1),
                   weight: Any = 1, cutoff: float | None = None) -> MatrixProblem:
    """Read and check the arguments that synthesis and evaluation share.

    Parameters
    ----------
    P1, P2, C1, C2 : LTI
        Plants and controllers.
    uncertainty : Uncertainty, frequency response or list of them, optional
        Measured plants, or their envelope.
    disturbances : pair of LTI
        Shaping filters of v1, v2; a number stands for that multiple of the identity.
    weight : LTI
        Performance filter on e12.
    cutoff : float, optional
        As :func:`inner_factor` [rad/s].
    """
    factors = matrix_factors(P1, P2, C1, C2, cutoff)
    if not isinstance(disturbances, (tuple, list)) or len(disturbances) != 2:
        raise InputError(f"{type(disturbances).__name__} is not a pair", where="disturbances",
                         expected="two shaping filters (systems or numbers), of v1 and v2")
    p = factors.loops[0].P.noutputs
    W1, W2 = (sized(W, f"disturbances[{k}]", factors.dt, (p, None)) for k, W in enumerate(disturbances))
    performance = sized(weight, "weight", factors.dt, (None, p))
    for name, part in (("disturbances[0]", W1), ("disturbances[1]", W2), ("weight", performance)):
        expect_stable(np.linalg.eigvals(part.A), name, factors.dt,
                      remedy="Move the pole inside: replace an integrator by a slow low-pass.")
    return MatrixProblem(factors, (W1, W2), performance, _matched(uncertainty, factors))


def sized(system: Any, where: str, dt: float, shape: tuple[int | None, int | None]) -> control.StateSpace:
    """A system of the given outputs and inputs; a number or one channel is repeated on the diagonal.

    Parameters
    ----------
    system : LTI or float
        What the user gave.
    where : str
        Name of the argument.
    dt : float
        Sample time of the loop [s].
    shape : tuple of int or None
        Outputs and inputs it must have; None: any number.
    """
    size = next(number for number in shape if number is not None)
    square = shape[0] is None or shape[1] is None or shape[0] == shape[1]
    if isinstance(system, (int, float, np.ndarray)) and not isinstance(system, bool):
        gain = np.asarray(system, dtype=float)
        if gain.ndim == 0 and (square or not gain.any()):
            gain = gain * np.eye(shape[0] or size, shape[1] or size)
        if gain.ndim != 2 or not np.all(np.isfinite(gain)):
            raise InputError(f"{system!r}", where=where, expected="a finite number, matrix or linear system")
        system = control.ss([], [], [], gain, dt)
    part = matrix_of(system, where, dt)
    if (part.noutputs, part.ninputs) == (1, 1) and square and size > 1:
        eye = np.eye(size)
        part = control.StateSpace(*(np.kron(eye, np.asarray(getattr(part, key))) for key in "ABCD"), dt,
                                  remove_useless_states=False)
    found = part.noutputs, part.ninputs
    if any(wanted is not None and wanted != has for wanted, has in zip(shape, found, strict=True)):
        expected = " and ".join(f"{number} {side}" for number, side in zip(shape, ("outputs", "inputs"), strict=True)
                                if number is not None)
        raise InputError(f"{found[0]} outputs and {found[1]} inputs", where=where, expected=expected)
    return part


def _matched(uncertainty: Any, factors: MatrixFactors) -> Uncertainty | None:
    if uncertainty is None:
        return None
    if isinstance(uncertainty, Uncertainty):
        return matched_matrix(uncertainty, factors)
    return matrix_uncertainty(list(uncertainty) if isinstance(uncertainty, Sequence) else uncertainty, factors,
                              "uncertainty")
