"""Normalized responses to small and large steps, with the linearizing feedback law and without it: are they alike?"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, Outcome
from ..thermal import System, steady_state
from ._constant_gain import constant_gain
from ._controller import Controller
from ._linearization import FeedbackLinearization
from ._loop import ClosedLoop, Law, simulate_loop
from ._modules import Array
from ._numbers import expect, numbers
from ._outcomes import DesignCode
from ._reachable import reachable
from ._regulated_points import Regulate


@dataclass(frozen=True)
class StepResponseLinearity:
    """Normalized step responses (y - y0)/step with the feedback law and with its constant-gain tangent.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Times of the samples after the step [s].
    steps : tuple of float
        Sizes of the set-point steps [K].
    linearized, plain : ndarray, shape (n_steps, n, n_modules)
        Normalized responses of the linearized loop and of the constant-gain loop [-].
    after, before : float
        Largest spread between the steps at one time, with the feedback law and without: 0 is a linear loop.
    outcome : Outcome
        "collapsed", or "limited" when a limit of the feedback law was active in a step: a saturated loop cannot scale.
    """

    time: Array
    steps: tuple[float, ...]
    linearized: Array
    plain: Array
    after: float
    before: float
    outcome: Outcome

    @property
    def linearised(self) -> Array:
        """Former name of `linearized`, kept for one version."""
        return self.linearized

    @property
    def ratio(self) -> float:
        """Spread before / after."""
        return self.before / self.after if self.after > 0 else np.inf

    def __str__(self) -> str:
        return f"spread {self.before:.4f} without the feedback law, {self.after:.4f} with it. {self.outcome}"

    def plot(self) -> NDArray[Any]:
        """Plot both families of normalized responses, like Evers figures 5.14-5.15; returns the matplotlib axes."""
        from matplotlib import pyplot as plt  # heavy, only when a picture is wanted

        _, axes = plt.subplots(1, 2, sharey=True, layout="constrained")
        for ax, family, title in zip(axes, (self.plain, self.linearized), ("constant gain", "linearized"), strict=True):
            for step, response in zip(self.steps, family, strict=True):
                ax.plot(self.time, response[:, 0], label=f"{step:+.3g} K")
            ax.set(xlabel="time [s]", title=title)
            ax.legend(title="step")
        axes[0].set_ylabel("normalized response [-]")
        return axes


def step_response_linearity(
    system: System, controller: Controller, *, law: FeedbackLinearization, base: float,
    steps: Sequence[float] = (-30.0, -20.0, -10.0, 10.0, 20.0, 30.0), duration: float = 600.0,
    inputs: Mapping[str, float] | None = None, regulate: Regulate = None,
) -> StepResponseLinearity:
    """Compare normalized set-point steps of the linearized loop with those of the same controller on a constant gain.

    Parameters
    ----------
    system : System
        System that is the plant of both loops.
    controller : Controller
        Used for both; the constant gain is the tangent of the feedback law at the base, so that small steps agree.
    law : FeedbackLinearization
        Linearizing feedback law of the first loop.
    base : float
        Temperature of all cold faces, or of what is regulated instead, before the steps, in steady state [K].
    steps : sequence of float, optional
        Sizes of the set-point steps [K].
    duration : float, optional
        Simulated time after the step [s].
    inputs : mapping, optional
        Ambients [K] and heaters [unit].
    regulate : mapping of module to str, optional
        Sensor or lump that a module regulates; default its cold face.

    Returns
    -------
    StepResponseLinearity

    Raises
    ------
    InputError
        A base that cannot be held; a step of zero.

    Examples
    --------
    >>> import robthermal as rt
    >>> system = rt.systems.two_module()
    >>> law = rt.design.feedback_linearization(system)
    >>> pi = rt.design.pid(rt.design.cold_side(law), bandwidth=0.02, sample_time=1.0)
    >>> found = rt.design.step_response_linearity(system, pi, law=law, base=298.15, steps=(-15.0, 15.0),
    ...                                           duration=200.0)
    >>> found.ratio > 10
    True
    """
    expect(law, FeedbackLinearization, "law", "rt.design.feedback_linearization")
    sizes = numbers(steps, "steps")
    if sizes.ndim != 1 or len(sizes) < 2 or not sizes.all():
        raise InputError(f"steps = {tuple(steps)!r}", where="argument steps", expected="at least two steps, none zero")
    at, current = _hold(system, law, base, inputs, regulate)

    def family(way: Law) -> list[ClosedLoop]:
        return [simulate_loop(system, controller, base + step, law=way, duration=duration, inputs=inputs, initial=at,
                              current=current, regulate=regulate) for step in steps]

    linearized, plain = family(law), family(constant_gain(law, at, current))
    limited = [f"{step:+g} K" for step, loop in zip(steps, linearized, strict=True) if (loop.limit != "").any()]
    n = min(len(loop.time) for loop in (*linearized, *plain))
    after, before = (np.array([(loop.regulated[:n] - base) / step for step, loop in zip(steps, loops, strict=True)])
                     for loops in (linearized, plain))
    outcome = DesignCode.COLLAPSED.outcome() if not limited else DesignCode.LIMITED.outcome(
        f"A limit was active in the steps {', '.join(limited)}:", remedy="lower the bandwidth or the steps.")
    return StepResponseLinearity(linearized[0].time[:n], tuple(steps), after, before,
                                 float(np.ptp(after, axis=0).max()), float(np.ptp(before, axis=0).max()), outcome)


def _hold(system: System, law: FeedbackLinearization, base: float, inputs: Mapping[str, float] | None,
          regulate: Regulate) -> tuple[Array, Array]:
    """Lumps and currents of the steady state with everything at the base."""
    if regulate:
        held = reachable(law, base, inputs=inputs, regulate=regulate)
        held.require()
        return np.array(list(held.temperatures.values())), np.array(list(held.current.values()))
    found = steady_state(system, dict(inputs or {}), setpoint=dict.fromkeys(law.names, base))
    stable = [e for e in found.equilibria if e.stable]
    if not stable:
        raise InputError(f"cold faces at {base:g} K cannot be held", where="argument base", expected="a temperature in "
                         "the range that rt.design.reachable gives", remedy=found.outcome.text)
    return np.array(list(stable[0].temperatures.values())), np.array([stable[0].currents[name] for name in law.names])
