"""The result of a coupling of several channels."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._control import control
from ...errors import Outcome
from ...verification import Certificate
from ..evaluation import CouplingResult, Spectra, reduce
from ..implementation import export, save_filters
from ..problem import NORMS, Performance, RunningLoops
from ._problem import MatrixProblem
from ._realization import running_matrix_loops
from ._spectra import matrix_spectra


@dataclass(frozen=True, eq=False, repr=False)
class MatrixFilters(CouplingResult):
    """Coupling filters X, Y between two subsystems of several inputs and outputs, with verdict and certificates.

    e1+ = e1 + X e2+, e2+ = e2 + Y e1+, u1 = C1 e1+ + X_input e2+, u2 = C2 e2+ + Y_input e1+, with P1 X_input = X and
    P2 Y_input = Y.

    Parameters
    ----------
    X, Y : StateSpace
        X = Z1 X_hat, Y = Z2 Y_hat, (p, p).
    X_hat, Y_hat : StateSpace
        The free stable filters, (m1, p) and (m2, p).
    Z1, Z2 : StateSpace
        Inner factors of the plants, (p, m1) and (p, m2).
    X_input, Y_input : StateSpace
        Q1 X_hat to u1 and Q2 Y_hat to u2.
    controller : StateSpace
        K_Delta, errors to inputs, Evers (6.12).
    norms : dict of float
        Upper bounds at every frequency, keys and meanings as in `Filters`: largest singular values. "h2" is computed,
        the others proven; infinite where the proof failed.
    nominally_stable, robustly_stable, controller_stable : bool
        Proven internal stability for the model; for every plant under the envelope; of K_Delta itself.
    holds : bool
        All that was asked for.
    worst_frequency : float
        Where "robust" is attained [rad/s].
    proofs : dict of Certificate
        Stability, norms, and the robust number between grid points, by what they prove.
    outcome : Outcome
        What holds, or why not.
    basis : str
        Basis of the filters.
    order : int
        Order of the basis.
    solve_time : float
        Time of the search [s].
    problem : MatrixProblem
        What was designed for.
    asked, requested : dict of float
        Bounds the design had to keep, and the values of the search.
    again : callable
        Makes the result of other free filters for the same problem: ``again(X_hat, Y_hat, ...)``.

    Examples
    --------
    >>> import control, numpy as np
    >>> import robthermal as rt
    >>> P = control.ss([[0.9, 0.1], [0.0, 0.8]], np.eye(2), np.eye(2), np.zeros((2, 2)), 0.01)
    >>> C = control.ss([], [], [], 0.3 * np.eye(2), 0.01)
    >>> filters = rt.coupling.evaluate_matrix(P, P, C, C, X_hat=-0.5)
    >>> filters.holds, filters.verdict, round(filters.norms["X"], 2)
    (True, 'nominal', 0.5)
    """

    X: control.StateSpace
    Y: control.StateSpace
    X_hat: control.StateSpace
    Y_hat: control.StateSpace
    Z1: control.StateSpace
    Z2: control.StateSpace
    X_input: control.StateSpace
    Y_input: control.StateSpace
    controller: control.StateSpace
    norms: dict[str, float]
    nominally_stable: bool
    robustly_stable: bool
    controller_stable: bool
    holds: bool
    worst_frequency: float
    proofs: dict[str, Certificate]
    outcome: Outcome
    basis: str
    order: int
    solve_time: float
    problem: MatrixProblem
    asked: dict[str, float]
    requested: dict[str, float]
    again: Callable[..., MatrixFilters]

    @property
    def performance(self) -> Performance:
        """Moving average and moving standard deviation: nan, a window is for one channel each."""
        return Performance(*[float("nan")] * 4)

    def running_loops(self) -> RunningLoops:
        """Plants, disturbances and controllers as state spaces, for a simulation of the model.

        Returns
        -------
        RunningLoops
        """
        return running_matrix_loops(self.problem, self.X_hat, self.Y_hat)

    def reduce(self, order: int | None = None, tolerance: float = 0.01) -> MatrixFilters:
        """Shorter X_hat and Y_hat with nearly the same objective, verified again.

        Balanced truncation, weighted by what the filters multiply. The objective is h2, or hinf where h2 is infinite.
        A robust design stays robust; other bounds may move by the tolerance.

        Parameters
        ----------
        order : int, optional
            States of each filter; None: the smallest number that keeps everything within the tolerance.
        tolerance : float
            Allowed relative loss of the objective [-].

        Returns
        -------
        MatrixFilters
            With outcome "not_reduced" and the filters of this design when no shorter ones keep what was asked.

        Raises
        ------
        InputError
            For a negative order or tolerance.
        """
        return reduce(self, order, tolerance)

    def spectra(self, points: int = 400) -> Spectra:
        """Largest singular values of sensitivities and improvement, density of e12, robust number over frequency.

        Parameters
        ----------
        points : int
            Logarithmic frequencies; corners, resonances and the measured frequencies come on top.

        Returns
        -------
        Spectra
        """
        return matrix_spectra(self, points)

    def save(self, path: str | Path, name: str = "", remarks: Sequence[Outcome] = ()) -> None:
        """Write coupling.json: filters, norms, verdict and remarks; no sections.

        Parameters
        ----------
        path : str or path
            File to write, replaced in one step.
        name : str
            Name of the design.
        remarks : sequence of Outcome
            What the verdict leaves out.

        Raises
        ------
        InputError
            If the file cannot be written.
        """
        save_filters(self, path, name, remarks)

    def export(self, path: str | Path, name: str = "coupling") -> None:
        """Write the filters for another program: MATLAB (.mat) or C99 (.c, .h).

        MATLAB gets what coupling.json holds. C gets state spaces and a step function in double that makes e+ and what
        is added to the outputs of C1 and C2, with a test vector; see the page on coupling.

        Parameters
        ----------
        path : str or path
            File to write, replaced in one step; its ending says which.
        name : str
            Name of the design; in C the prefix of every identifier.

        Raises
        ------
        InputError
            For another ending, or when the file cannot be written. In C also in continuous time.
        """
        export(self, path, name)

    def plot(self) -> NDArray[Any]:
        """Improvement factors, e12 before and after, and the robust number over frequency [Hz].

        Returns
        -------
        ndarray of matplotlib axes, shape (3,)
        """
        return self.spectra().plot(("improvement", "e12", "robust"))

    def __str__(self) -> str:
        rows = [f"coupling ({self.basis}, order {self.order}): {self.outcome.text}"]
        rows += [f"  {key:<18}{self.norms[key]:.5g}" for key in NORMS if key in self.norms]
        return "\n".join(rows)

    def __repr__(self) -> str:
        size = np.shape(self.X.D)
        return f"<MatrixFilters {size[0]}x{size[1]} {self.basis} {self.order}, {self.verdict}>"
