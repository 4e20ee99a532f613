"""The result of a coupling design."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._arrays import Array
from ..._control import control
from ...errors import Outcome
from ...verification import Certificate
from ..implementation import FixedPoint, export, fixed_point, save_filters, sections
from ..problem import NORMS, Performance, Problem, RunningLoops, running_loops
from ._reduce import reduce
from ._result import CouplingResult
from ._spectra import spectra


@dataclass(frozen=True, eq=False, repr=False)
class Filters(CouplingResult):
    """Coupling filters X, Y between two controlled subsystems, with verdict and certificates.

    e1+ = e1 + X e2+, e2+ = e2 + Y e1+, u1 = C1 e1+ + (P1⁻¹X) e2+, u2 = C2 e2+ + (P2⁻¹Y) e1+.

    Parameters
    ----------
    X, Y : StateSpace
        X = Z1 X_hat, Y = Z2 Y_hat.
    X_hat, Y_hat : StateSpace
        The free stable filters.
    Z1, Z2 : StateSpace
        All-pass factors of the plants.
    X_input, Y_input : StateSpace
        P1⁻¹X to u1 and P2⁻¹Y to u2.
    controller : StateSpace
        K_Delta, errors to inputs, Evers (6.12).
    improvement_1, improvement_2 : StateSpace
        1 + Y, which multiplies S1, and 1 + X, which multiplies S2.
    e12 : StateSpace
        (v1, v2) to e12: [-(1+Y) S1, (1+X) S2].
    norms : dict of float
        Upper bounds at every frequency: "X", "Y", "XY", "improvement_1", "improvement_2" (H-infinity); "hinf", "h2",
        "hinf_uncoupled", "h2_uncoupled" of weight [(1+Y) S1 W1, (1+X) S2 W2]; "robust", the largest
        rho(\\|Delta_k\\| R); "small_gain", the largest sigma_max(Delta_k) mu(Delta_p) of Evers (6.22). "h2" and
        "small_gain" are computed, the others proven; infinite where the proof failed.
    performance : Performance
        Moving average and moving standard deviation [m].
    nominally_stable : bool
        Internal stability of the coupled loop is proven.
    robustly_stable : bool
        Proven for every plant under the envelope; without uncertainty the same as nominally_stable.
    controller_stable : bool
        Proven that K_Delta has no unstable mode that C1, C2 have not.
    holds : bool
        All that was asked for.
    worst_frequency : float
        Where "robust" is attained [rad/s].
    requested : dict of float
        The solver's own values.
    proofs : dict of Certificate
        Stability, norms, and the robust number between grid points, by what they prove.
    outcome : Outcome
        What holds, or why not.
    basis : str
        Basis of the filters.
    order : int
        Order of the basis.
    solve_time : float
        Time of the solver [s].
    problem : Problem
        What was designed for.
    asked : dict of float
        Bounds the design had to keep.
    again : callable
        Makes the result of other free filters for the same problem: ``again(X_hat, Y_hat, ...)``.

    Examples
    --------
    >>> import control
    >>> import robthermal as rt
    >>> P, C = control.tf([0.01], [1, -0.99], 0.01), control.tf([20.0], [1], 0.01)
    >>> long = control.tf([0.1, -0.05 - 1e-7], [1, -0.8, 0.15], 0.01)      # a pole and a zero almost cancel
    >>> filters = rt.coupling.evaluate(P, P, C, C, X_hat=-long, Y_hat=0.3)
    >>> short = filters.reduce(order=1)
    >>> filters.X_hat.nstates, short.X_hat.nstates, round(short.norms["X"] / filters.norms["X"], 3)
    (2, 1, 1.0)
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
    improvement_1: control.StateSpace
    improvement_2: control.StateSpace
    e12: control.StateSpace
    norms: dict[str, float]
    performance: Performance
    nominally_stable: bool
    robustly_stable: bool
    controller_stable: bool
    holds: bool
    worst_frequency: float
    requested: dict[str, float]
    proofs: dict[str, Certificate]
    outcome: Outcome
    basis: str
    order: int
    solve_time: float
    problem: Problem
    asked: dict[str, float]
    again: Callable[..., Filters]

    def running_loops(self) -> RunningLoops:
        """Plants, disturbances and controllers as state spaces, for a simulation of the model.

        Returns
        -------
        RunningLoops
        """
        return running_loops(self.problem, self.X_hat, self.Y_hat)

    def reduce(self, order: int | None = None, tolerance: float = 0.01) -> Filters:
        """Shorter X_hat and Y_hat with nearly the same objective, verified again.

        Balanced truncation, weighted by what the filters multiply. The objective is the moving average with a window,
        else h2, or hinf where h2 is infinite. A robust design stays robust; other bounds may move by the tolerance.

        Parameters
        ----------
        order : int, optional
            States of each filter; None: the smallest number that keeps everything within the tolerance.
        tolerance : float
            Allowed relative loss of the objective [-].

        Returns
        -------
        Filters
            With outcome "not_reduced" and the filters of this design when no shorter ones keep what was asked.

        Raises
        ------
        InputError
            For a negative order or tolerance.
        """
        return reduce(self, order, tolerance)

    def sections(self) -> dict[str, Array]:
        """Second-order sections for implementation, discrete time only.

        Returns
        -------
        dict of ndarray, shape (n, 6)
            "X", "Y", "X_input", "Y_input" as scipy.signal's sos.

        Raises
        ------
        InputError
            In continuous time, or when a filter cannot be factored accurately enough: reduce it first.
        """
        return sections(self)

    def fixed_point(self, largest: float) -> FixedPoint:
        """Sections scaled by powers of two so that no state overflows, and the bits each needs; discrete time only.

        Parameters
        ----------
        largest : float
            Bound of e1+ and e2+ [m].

        Returns
        -------
        FixedPoint

        Raises
        ------
        InputError
            As :meth:`sections`, for a bound that is not positive, or filters that ring for more than two million
            samples.
        """
        return fixed_point(self, largest)

    def save(self, path: str | Path, name: str = "", remarks: Sequence[Outcome] = ()) -> None:
        """Write coupling.json: filters, sections, norms, performance, verdict and remarks.

        Parameters
        ----------
        path : str or path
            File to write, replaced in one step.
        name : str
            Name of the design.
        remarks : sequence of Outcome
            What the verdict leaves out, for example a measurement without covariance.

        Raises
        ------
        InputError
            If the file cannot be written.
        """
        save_filters(self, path, name, remarks)

    def export(self, path: str | Path, name: str = "coupling") -> None:
        """Write the filters for another program: MATLAB (.mat) or C99 (.c, .h).

        MATLAB gets what coupling.json holds: A, B, C, D of every filter, sections, sample time, norms. C gets the
        sections and a step function in double that makes e+ and what is added to the outputs of C1 and C2, with a
        test vector; see the page on coupling.

        Parameters
        ----------
        path : str or path
            File to write, replaced in one step; its ending says which.
        name : str
            Name of the design; in C the prefix of every identifier.

        Raises
        ------
        InputError
            For another ending, or when the file cannot be written. In C also in continuous time, or when a filter
            cannot be factored accurately enough: reduce it first.
        """
        export(self, path, name)

    def plot(self) -> NDArray[Any]:
        """Improvement factors, e12 before and after, and the robust number over frequency [Hz].

        Returns
        -------
        ndarray of matplotlib axes, shape (3,)
        """
        return spectra(self).plot(("improvement", "e12", "robust"))

    def __str__(self) -> str:
        rows = [f"coupling ({self.basis}, order {self.order}): {self.outcome.text}"]
        rows += [f"  {key:<18}{self.norms[key]:.5g}" for key in NORMS]
        if np.isfinite(self.performance.ma_before):
            rows.append(str(self.performance))
        return "\n".join(rows)

    def __repr__(self) -> str:
        return f"<Filters {self.basis} {self.order}, {self.verdict}, robust {self.norms['robust']:.3g}>"
