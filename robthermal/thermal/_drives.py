"""From the columns of a record to what really drives the network: w = [heaters, currents, ambients, 1, ...].

Static part of a `Drive` (gain, offset, saturation); delay and lag are the simulation's. The column of ones carries
constant heats, a sign column the polarity that a hysteresis remembers, a step column is 0 before and 1 after its time,
a ripple column holds what a current is off its mean within a sample (rms).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ._parameters import locate
from ._parts import Drive, Input, Module
from ._terms import Array

if TYPE_CHECKING:
    from ._system import System

_STATIC = ("drive.gain", "drive.offset", "drive.gain_slope", "drive.cubic", "drive.clip")


class Drives:
    """Columns of w of one system, and how they follow from those of u (`System.exogenous_names`).

    Parameters
    ----------
    system : System
        System whose heaters and modules are driven.
    ripple : sequence of str
        Modules whose currents have a ripple.
    """

    def __init__(self, system: System, ripple: Sequence[str] = ()):
        self.system = system
        self.n_u = len(system.exogenous_names)
        self.column = {name: i for i, name in enumerate(system.exogenous_names)}
        parts: dict[str, Input | Module] = {**system.inputs, **system.modules}
        self.of = {self.column[name]: part.drive for name, part in parts.items()}
        self.ambients = slice(len(parts), self.n_u)
        self.one = self.n_u
        remembering = [name for name, module in system.modules.items() if module.hysteresis is not None]
        self.signs = {name: self.one + 1 + i for i, name in enumerate(remembering)}
        stepping = [link.name for link in system.links if link.step is not None]
        self.steps = {name: self.one + 1 + len(remembering) + i for i, name in enumerate(stepping)}
        before = self.one + 1 + len(remembering) + len(stepping)
        self.ripples = {name: before + i for i, name in enumerate(ripple)}
        self.width = before + len(self.ripples)
        self._shaped = {column: drive for column, drive in self.of.items() if _is_shaped(drive)}

    def __call__(self, u: Array) -> Array:
        """Columns w (..., width) of u (..., n_u), before any step and without ripple."""
        w = np.zeros((*u.shape[:-1], self.width), u.dtype if np.iscomplexobj(u) else float)
        w[..., :self.n_u] = u
        for column, drive in self._shaped.items():
            w[..., column] = _shape(drive, u[..., column])
        w[..., self.one] = 1.0
        for name, column in self.signs.items():
            w[..., column] = np.sign(w[..., self.column[name]].real)
        return w

    def slopes(self, u: Array) -> Array:
        """Derivative of the first n_u columns of w with respect to the same columns of u (..., n_u)."""
        out = np.ones(u.shape)
        for column, drive in self._shaped.items():
            linear = (1 + drive.gain) * u[..., column] + drive.offset
            out[..., column] = (1 + drive.gain) * _bend(drive, linear) * ~_clipped(drive, linear)
        return out

    def parameter(self, name: str, u: Array) -> Array | None:
        """Derivative (..., width) of w with respect to a parameter of a drive; None for any other parameter."""
        table, part, field = locate(self.system, name)
        if field not in _STATIC:
            return None
        column = self.column[part]
        drive, linear = self.of[column], (1 + self.of[column].gain) * u[..., column] + self.of[column].offset
        clipped, bend = _clipped(drive, linear), _bend(drive, linear)
        out = np.zeros((*u.shape[:-1], self.width))
        out[..., column] = {"drive.gain": bend * u[..., column] * ~clipped, "drive.offset": bend * ~clipped,
                            "drive.gain_slope": np.abs(linear) * linear * ~clipped,
                            "drive.cubic": -linear**3 * ~clipped,
                            "drive.clip": np.sign(_unclipped(drive, linear)) * clipped}[field]
        return out


def _is_shaped(drive: Drive) -> bool:
    return bool(drive.gain or drive.offset or drive.gain_slope or drive.cubic or drive.clip)


def _shape(drive: Drive, u: Array) -> Array:
    linear = (1 + drive.gain) * u + drive.offset
    value = _unclipped(drive, linear)
    return value if drive.clip is None else np.where(np.abs(value.real) > drive.clip, np.sign(value.real) * drive.clip,
                                                     value)


def _unclipped(drive: Drive, linear: Array) -> Array:
    """Value before it is held within ±clip; analytic, as a complex step needs it."""
    modulus = np.where(linear.real < 0, -linear, linear)
    return (1 + drive.gain_slope * modulus) * linear - drive.cubic * linear**3


def _bend(drive: Drive, linear: Array) -> Array:
    """Derivative of `_unclipped` with respect to its argument."""
    return 1 + 2 * drive.gain_slope * np.abs(linear) - 3 * drive.cubic * linear**2


def _clipped(drive: Drive, linear: Array) -> NDArray[np.bool_]:
    """Where the value is held at ±clip."""
    value = _unclipped(drive, linear).real
    outside: NDArray[np.bool_] = np.abs(value) > (np.inf if drive.clip is None else drive.clip)
    return outside
