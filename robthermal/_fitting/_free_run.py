"""Free run of a system on a record that its fit has not seen."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ..thermal import System
from ._data import Data
from ._problem import Problem, scaled
from ._ranges import NONE
from ._start import Start, initial_of

Array = NDArray[np.float64]
_HEAD = 0.1  # part of a validation record that may be used for its initial temperatures


def validate(system: System, one: Data, start: Start, noise: dict[str, float]) -> tuple[Array, Array]:
    """Free run on a record the fit has not seen: initial temperatures (n_lumps,) and residuals (n, n_sensors) [K].

    A free start is estimated on the first tenth of the record (with its prior), never on the rest.
    """
    initial = initial_of(system, one, start)
    whole = Problem(system, [one], NONE, [initial])
    if not initial.n_free:
        return whole.temperatures(whole.v0)[0], whole.residuals(whole.v0)[0]
    n_head = max(2, round(_HEAD * len(one.readings)))
    head = Data(one.record[:n_head], one.sensors, one.columns, one.readings[:n_head])
    weights = scaled(np.array([noise.get(name, 1.0) for name in one.sensors]))
    problem = Problem(system, [head], NONE, [initial], [weights])
    v = least_squares(problem.vector, problem.v0, problem.jacobian, bounds=problem.bounds, x_scale="jac").x
    return whole.temperatures(v)[0], whole.residuals(v)[0]
