"""The linearizing feedback law without an outer loop: heats in, temperatures out, for the best linear approximation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .._checks import positive_number
from ..errors import InputError
from ..signals import Record
from ..thermal import System
from ._controller import Controller, ControllerInput
from ._loop import Law, base_law, simulate_loop
from ._modules import Array
from ._regulated_points import Regulate


@dataclass(frozen=True)
class _Program(Controller):
    """A controller that asks for a list of heats, whatever the temperatures."""

    heats: Array  # (n, n_modules) [W]
    sample_time: float

    def start(self, given: ControllerInput, heat: Array) -> Array:
        return np.zeros(1)

    def heat(self, state: Array, given: ControllerInput) -> Array:
        return np.asarray(self.heats[int(state[0])], float)

    def advance(self, state: Array, given: ControllerInput, wanted: Array, achieved: Array) -> Array:
        return state + 1.0


def simulate_law(system: System, heat: ArrayLike | Mapping[str, ArrayLike], *, law: Law, sample_time: float,
                 initial: ArrayLike | Mapping[str, float] | None = None, inputs: Mapping[str, float] | None = None,
                 regulate: Regulate = None) -> Record:
    """Drive modules through a feedback law by a list of heats v: the system that an outer loop sees.

    With `identify.bla` it says how linear that system is, Evers 5.5.4: what the law leaves is nonlinear distortion.

    Parameters
    ----------
    system : System
        The plant; it may differ from the one the feedback law was built for in everything but names.
    heat : array_like or mapping
        Heats v into the cold lumps [W]: (n, n_modules), or module to (n,).
    law : FeedbackLinearization or ConstantGain
        Turns the heats into currents, with all temperatures known.
    sample_time : float
        For which a current is held [s].
    initial : array_like or mapping, optional
        Lump temperatures at the start [K].
    inputs : mapping, optional
        Heaters [unit], ambients [K] and currents of modules the feedback law does not drive [A].
    regulate : mapping of module to str, optional
        Sensor or lump whose temperature is the output of a module; default its cold face.

    Returns
    -------
    Record
        Inputs: the heats [W], named as the modules. Outputs: the temperatures [K], named as lumps or sensors.

    Raises
    ------
    InputError
        Heats of another shape, or beyond a limit of the law: a limited law is not linear. A runaway.

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> system = rt.systems.two_module()
    >>> law = rt.design.feedback_linearization(system)
    >>> run = rt.design.simulate_law(system, np.full((60, 2), -4.0), law=law, sample_time=1.0)
    >>> run.input_names, run.output_names, bool((run["x11"][1:] < 298.15).all())
    (('m1', 'm2'), ('x11', 'x12'), True)
    """
    base = base_law(law)
    h = positive_number(sample_time, "sample_time", "s")
    heats = base.modules.vector(heat, "heat", "W")
    if heats.ndim != 2 or len(heats) < 2:
        raise InputError(f"heat has shape {heats.shape}", where="argument heat",
                         expected=f"rows of {len(base.names)} heats, one row per sample")
    run = simulate_loop(system, _Program(heats, h), 298.15, law=law, duration=h * len(heats), initial=initial,
                        inputs=inputs, regulate=regulate)
    if len(run.time) < len(heats):
        raise InputError(run.outcome.text, where="argument heat", expected="heats that the machine bears")
    if (run.limit != "").any():
        k, i = np.argwhere(run.limit != "")[0]
        raise InputError(f"{heats[k, i]:g} W for module {base.names[i]!r} meets the limit {str(run.limit[k, i])!r} "
                         f"after {h * k:g} s", where="argument heat", expected="heats within the limits of the law",
                         remedy="Excite less, or closer to zero.")
    units = {**dict.fromkeys(base.names, "W"), **dict.fromkeys(run.points, "K")}
    return Record(sample_time=h, inputs=heats, outputs=run.regulated, input_names=base.names, output_names=run.points,
                  units=units)
