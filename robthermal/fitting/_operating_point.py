"""The steady state at which a frequency response was measured, followed while the parameters move."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from .._arrays import Floats
from ..errors import Diverged, InputError
from ..thermal import Equations, System, steady_state

_NEWTON = 20
_AT_REST = 1e-9  # K


@dataclass
class OperatingPoint:
    """Steady state at given inputs.

    Parameters
    ----------
    inputs : mapping
        Heaters [unit], module currents [A] and ambients [K]; the others off and nominal.
    last : ndarray, optional
        Where the steady state was for the previous parameters [K]: the next one is near, so Newton's method finds it,
        and finds the one on the same branch.
    """

    inputs: Mapping[str, float]
    last: Floats | None = None

    def temperatures(self, system: System) -> Floats | None:
        """Of all lumps [K]; None for a linear network, whose linearization is the same everywhere."""
        eq = Equations(system)
        if not eq.terms:
            return None
        if self.last is not None:
            here = self._near(eq, self.last)
        else:
            found = steady_state(system, self.inputs)
            if not found.equilibria:
                raise InputError(f"no steady state to linearize at: {found.outcome}", where="argument operating_point",
                                 remedy="Give the mean inputs of the experiment.")
            here = np.array([found.equilibria[0].temperatures[name] for name in system.lump_names])
        self.last = here
        return here

    def _near(self, eq: Equations, x: Floats) -> Floats:
        u = eq.nominal()
        for name, value in self.inputs.items():
            u[eq.system.exogenous_names.index(name)] = value
        for _ in range(_NEWTON):
            step = np.linalg.solve(eq.jacobian(x, u).toarray(), -eq.heat(x, u))
            x = x + step
            if np.abs(step).max() < _AT_REST:
                return x
        raise Diverged("no steady state near the previous one", time=float("inf"))
