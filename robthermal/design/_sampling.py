"""The sampled linear loop: its poles, and the refusal of a sample time that is too slow."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ._controller import Controller, ControllerInput, expect_controller
from ._modules import Array
from ._numbers import expect
from ._plant import ColdSide

_FASTEST = 1e-3  # of the sample time asked for: no slower loop is searched below it


def loop_poles(plant: ColdSide, controller: Controller) -> NDArray[np.complex128]:
    """Poles of the sampled loop of the linear cold side, its sensors, and a controller; no limit active.

    Parameters
    ----------
    plant : ColdSide
        Sampled exactly at the controller's sample time.
    controller : Controller
        Any that is affine in its state and what it sees.

    Returns
    -------
    ndarray of complex
        The sampled loop is stable when all are inside the unit circle.

    Examples
    --------
    >>> import robthermal as rt
    >>> plant = rt.design.cold_side(rt.design.feedback_linearization(rt.systems.two_module()))
    >>> loop = rt.design.pid(plant, bandwidth=0.02, sample_time=1.0)
    >>> bool(abs(rt.design.loop_poles(plant, loop)).max() < 1)
    True
    """
    expect(plant, ColdSide, "plant", "rt.design.cold_side")
    expect_controller(controller)
    A, B, C = plant.regulated(controller.sample_time)
    n, m = len(A), len(plant.law.names)
    rest = np.full(len(plant.law.system.lumps), 300.0)
    around = np.zeros(len(plant.around))

    def inputs(x: Array) -> ControllerInput:
        temperatures = rest.copy()
        temperatures[plant.indices] += x[:len(plant.lumps)]
        return ControllerInput(np.full(m, 300.0), 300.0 + C @ x, temperatures, around)

    memory = controller.start(inputs(np.zeros(n)), np.zeros(m))

    def step(s: Array) -> Array:
        now = inputs(s[:n])
        heat = controller.heat(memory + s[n:], now)
        return np.concatenate([A @ s[:n] + B @ heat, controller.advance(memory + s[n:], now, heat, heat)])

    # the map is affine: differences from one point are its matrix, exactly
    zero = np.zeros(n + len(memory))
    origin = step(zero)
    matrix = np.column_stack([step(unit) - origin for unit in np.eye(len(zero))])
    moving = (matrix != np.eye(len(zero))).any(axis=1)  # a memory that never changes is a constant, not a pole
    return np.linalg.eigvals(matrix[np.ix_(moving, moving)]).astype(complex)


def check_sampling(plant: ColdSide, controller: Controller, at: Callable[[float], Controller] | None = None) -> None:
    """Refuse a controller whose sampled loop is unstable; `at` builds it at another sample time to find one that is."""
    radius = float(np.abs(loop_poles(plant, controller)).max())
    if radius < 1:
        return
    h = controller.sample_time
    slower = h
    while at is not None and slower > _FASTEST * h:
        slower /= 1.25
        if np.abs(loop_poles(plant, at(slower))).max() < 1:
            raise InputError(f"the loop sampled every {h:g} s is unstable: spectral radius {radius:.4g}",
                             where="argument sample_time", expected=f"at most about {slower:.2g} s for this controller",
                             remedy="Sample faster, or ask for less bandwidth.")
    raise InputError(f"the sampled loop is unstable: spectral radius {radius:.4g}", where="argument controller",
                     expected="a controller that is stable with this plant",
                     remedy="Lower its gains, check its sign: more heat v makes the cold lump warmer.")
