"""What a plain controller does instead of the feedback law: a constant gain from wanted heat to current."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ._linearization import Command, FeedbackLinearization, Temperatures
from ._modules import Array
from ._numbers import expect


@dataclass(frozen=True)
class ConstantGain:
    """The tangent of the linearizing feedback law at one operating point, with its limits.

    I = I0 - g (v - v0), g = abs(dI/dv).

    Parameters
    ----------
    law : FeedbackLinearization
        Whose limits and modules.
    current, heat, gain : ndarray, shape (n_modules,)
        I0 [A], v0 [W] and g [A/W].
    """

    law: FeedbackLinearization
    current: Array
    heat: Array
    gain: Array

    def command(self, v: ArrayLike | Mapping[str, ArrayLike], temperatures: Temperatures, *,
                previous: ArrayLike | None = None, sample_time: float | None = None) -> Command:
        """Current for a wanted heat, by the constant gain; `heat` is what it believes to achieve.

        Parameters
        ----------
        v : ndarray
            Heat wanted into the cold lumps [W].
        temperatures : ndarray or mapping
            Temperatures of all lumps [K].
        previous : ndarray, optional
            Currents of the sample before [A].
        sample_time : float
            Time between samples [s].
        """
        wanted = self.law.modules.vector(v, "v", "W")
        asked = self.current - self.gain * (wanted - self.heat)
        optimum = self.law.bounds(temperatures).current
        beyond = asked > optimum  # where the same heat has a smaller current too: the feedback law must not mirror it
        heat = self.law.heat(np.minimum(asked, optimum), temperatures)
        true = self.law.command(heat, temperatures, previous=previous, sample_time=sample_time)
        limit = np.where(beyond & (true.limit == ""), "optimum", true.limit)
        current = np.where(limit == "", asked, true.current)
        return Command(current, true.voltage, self.heat - (current - self.current) / self.gain, limit)


def constant_gain(law: FeedbackLinearization, temperatures: Temperatures,
                  current: ArrayLike | Mapping[str, ArrayLike] = 0.0) -> ConstantGain:
    """Plain alternative to a feedback law, for comparison: its tangent at one operating point.

    Parameters
    ----------
    law : FeedbackLinearization
        Linearizing feedback law whose tangent is taken.
    temperatures : array_like, shape (n_lumps,), or mapping of lump to temperature
        Lump temperatures of the operating point [K].
    current : array_like, mapping or float, optional
        Currents at the operating point [A].

    Returns
    -------
    ConstantGain

    Examples
    --------
    >>> import robthermal as rt
    >>> law = rt.design.feedback_linearization(rt.systems.two_module())
    >>> plain = rt.design.constant_gain(law, [298.15] * 18)
    >>> plain.gain.round(4).tolist()  # 1/(S x_c) [A/W]
    [0.0633, 0.0633]
    """
    expect(law, FeedbackLinearization, "law", "rt.design.feedback_linearization")
    at = law.modules.vector(current, "current", "A")
    return ConstantGain(law, at, law.heat(at, temperatures), law.gain(at, temperatures))
