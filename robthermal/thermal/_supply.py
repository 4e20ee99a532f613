"""The supply and the bridge of a module, as a system file states them."""

from __future__ import annotations

from pydantic import model_validator

from ._part import NonNegative, Part, Positive


class Supply(Part):
    """The supply and the bridge that drive a module.

    Parameters
    ----------
    voltage : float, optional
        Of the supply at the bridge [V].
    current : float, optional
        Largest current of the bridge or supply [A].
    duty : float
        Largest duty cycle of the bridge [-].
    resistance : float
        Bridge, filter and cable in series with the module [Ω].
    reversible : bool
        Whether the bridge can reverse the current.
    """

    voltage: Positive | None = None
    current: Positive | None = None
    duty: Positive = 1.0
    resistance: NonNegative = 0.0
    reversible: bool = True

    @model_validator(mode="after")
    def _complete(self) -> Supply:
        if self.voltage is None and self.current is None and self.reversible:
            raise ValueError("give voltage [V], current [A], or reversible = false")
        if self.duty > 1.0:
            raise ValueError("duty is a share of the period, at most 1")
        return self
