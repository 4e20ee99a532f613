"""What every result of a coupling says of itself, whether its filters have one channel or several."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Self

from ..._control import control
from ...errors import Outcome
from ...verification import Certificate

if TYPE_CHECKING:
    from ..problem import RunningLoops


class CouplingResult(ABC):
    """Verdict, certificates and outcome of filters; base of `Filters` and `MatrixFilters`, which are dataclasses."""

    X_hat: control.StateSpace
    Y_hat: control.StateSpace
    norms: dict[str, float]
    performance: Any  # of both a Performance; a field of one, a property of the other
    nominally_stable: bool
    robustly_stable: bool
    holds: bool
    proofs: dict[str, Certificate]
    outcome: Outcome
    problem: Any
    basis: str
    solve_time: float
    asked: dict[str, float]
    requested: dict[str, float]
    again: Callable[..., Any]

    @property
    def certificates(self) -> tuple[Certificate, ...]:
        """Everything that is proven."""
        return tuple(self.proofs.values())

    @property
    def verdict(self) -> str:
        """ "robust", "nominal" or "none"; robust only where an uncertainty was given, none for a refused design."""
        if not self.holds and self.norms["X"] == self.norms["Y"] == 0.0:  # refused: there is no coupling
            return "none"
        if self.problem.uncertainty is not None and self.robustly_stable:
            return "robust"
        return "nominal" if self.nominally_stable else "none"

    def with_outcome(self, outcome: Outcome) -> Self:
        """The same filters with another outcome.

        Parameters
        ----------
        outcome : Outcome
            What is said of them.

        Returns
        -------
        Filters or MatrixFilters
        """
        return replace(self, outcome=outcome, holds=outcome.ok)  # type: ignore[type-var]  # dataclasses only

    @abstractmethod
    def running_loops(self) -> RunningLoops:
        """Plants, disturbances and controllers as state spaces, for a simulation of the model.

        Returns
        -------
        RunningLoops
        """
