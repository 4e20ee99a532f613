"""Records and frequency responses as one least-squares problem."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .._arrays import Floats
from ..errors import Diverged
from ..fitting import Loss, Problem, Ranges
from ..thermal import System
from ._covariance import Information, Share, combined, record_share
from ._response_model import ResponseProblem


@dataclass(frozen=True, eq=False)
class JointProblem:
    """Sum of the squares of all whitened residuals and priors; records and responses share the parameters.

    Parameters
    ----------
    records : Problem
        Records, perhaps none, with the priors of parameters and initial temperatures.
    responses : tuple of ResponseProblem
        Frequency responses, perhaps none.
    """

    records: Problem
    responses: tuple[ResponseProblem, ...]

    @property
    def ranges(self) -> Ranges:
        """Parameters to estimate."""
        return self.records.ranges

    @property
    def system(self) -> System:
        """System whose parameters are estimated."""
        return self.records.system

    @property
    def n_numbers(self) -> int:
        """Readings and real numbers of the responses."""
        return self.records.n_readings + sum(one.size for one in self.responses)

    @property
    def several(self) -> bool:
        """Whether responses have to be weighed against something else: records, each other, a prior."""
        others = len(self.records.data) + len(self.responses) + int(np.isfinite(self.ranges.sigma).sum())
        return bool(self.responses) and others > 1

    def weighed(self, v: Floats, *, combined: bool) -> JointProblem:
        """The same with every response weighed by the covariance of all its bins together, at some unknowns."""
        q = v[:len(self.ranges.names)]
        return replace(self, responses=tuple(one.weighed(q, combined=combined) for one in self.responses))

    def vector(self, v: Floats) -> Floats:
        """Weighted residuals of readings, priors, then of responses; infinite where there is no steady state."""
        q = v[:len(self.ranges.names)]
        try:
            parts = [one.vector(q) for one in self.responses]
        except Diverged:
            parts = [np.full(one.size, np.inf) for one in self.responses]
        return np.concatenate([self.records.vector(v), *parts])

    def jacobian(self, v: Floats) -> Floats:
        """Derivative of `vector`."""
        p = len(self.ranges.names)
        own = [np.hstack([one.jacobian(v[:p]), np.zeros((one.size, v.size - p))]) for one in self.responses]
        return np.concatenate([self.records.jacobian(v), *own])

    def information(self, v: Floats, loss: Loss) -> Information:
        """Covariance of the parameters: what every data set says is added up."""
        shares: list[Share] = [record_share(self.records, v, loss)] if self.records.data else []
        shares += [one.share(v[:len(self.ranges.names)]) for one in self.responses]
        return combined(self.ranges, self.records.parameters(v), shares)
