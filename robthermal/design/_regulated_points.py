"""What every module regulates: its cold face, another lump, or what a sensor reads."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from ._linearization import FeedbackLinearization
from ._modules import Array

Regulate = Mapping[str, str] | None


@dataclass(frozen=True)
class RegulatedPoint:
    """A quantity that a module regulates: y = reference + gain (x - reference) + offset, lagged and delayed.

    Parameters
    ----------
    module : str
        Name of the module.
    name : str
        Name of the sensor or of the lump.
    kind : {"sensor", "lump"}
        Whether a reading or a temperature is regulated.
    lump : str
        Lump whose temperature it is.
    gain, offset, reference : float
        Of the sensor [-], [K], [K].
    time_constant, delay : float
        Lag of first order, and pure delay, of the sensor [s].
    """

    module: str
    name: str
    kind: Literal["sensor", "lump"]
    lump: str
    gain: float = 1.0
    offset: float = 0.0
    reference: float = 0.0
    time_constant: float = 0.0
    delay: float = 0.0

    @property
    def plain(self) -> bool:
        """Whether it is the temperature of its lump, now."""
        return (self.gain, self.offset, self.time_constant, self.delay) == (1.0, 0.0, 0.0, 0.0)

    def reading(self, temperature: ArrayLike) -> Array:
        """Reading in steady state at a temperature of the lump [K].

        Parameters
        ----------
        temperature : array_like
            Temperature of the lump [K].
        """
        return self.reference + self.gain * (np.asarray(temperature, float) - self.reference) + self.offset

    def temperature(self, reading: ArrayLike) -> Array:
        """Temperature of the lump in steady state at a reading [K].

        Parameters
        ----------
        reading : array_like
            Reading, or set-point of it [K].
        """
        return self.reference + (np.asarray(reading, float) - self.offset - self.reference) / self.gain

    def response(self, s: ArrayLike) -> np.ndarray:
        """Transfer function from the lump to the reading, continuous.

        Parameters
        ----------
        s : array_like
            Complex frequencies of the response [rad/s].
        """
        s = np.asarray(s, complex)
        return self.gain * np.exp(-s * self.delay) / (1.0 + s * self.time_constant)


def regulated_points(law: FeedbackLinearization, regulate: Regulate = None) -> tuple[RegulatedPoint, ...]:
    """Points that the modules of a feedback law regulate, in their order.

    Parameters
    ----------
    law : FeedbackLinearization
        Whose modules regulate.
    regulate : mapping of module to str, optional
        Name of the sensor or lump that a module regulates; default its cold face. Where a sensor has the name of its
        own lump, the sensor is meant.

    Returns
    -------
    tuple of RegulatedPoint

    Raises
    ------
    InputError
        Unknown modules, sensors or lumps; a name that is a lump, and a sensor on another one; a sensor of
        a voltage.

    Examples
    --------
    >>> import robthermal as rt
    >>> law = rt.design.feedback_linearization(rt.systems.two_module())
    >>> [point.lump for point in rt.design.regulated_points(law, {"m1": "T15"})]
    ['x15', 'x12']
    """
    given = dict(regulate or {})
    for module in given:
        if module not in law.names:
            raise InputError(f"there is no module {module!r} that the law drives", where="regulate",
                             expected="some of " + ", ".join(law.names))
    return tuple(_point(law, module, given.get(module, part.cold), module in given)
                 for module, part in zip(law.names, law.modules.parts, strict=True))


def _point(law: FeedbackLinearization, module: str, name: str, named: bool) -> RegulatedPoint:
    system = law.system
    sensor = system.thermometer(name, f"regulate {module}") if named and name in system.sensors else None
    if sensor is None:
        if name not in system.lumps:
            raise InputError(f"there is no sensor or lump {name!r}", where=f"regulate {module}", expected="one of "
                             + ", ".join((*system.thermometers, *system.lumps)))
        return RegulatedPoint(module, name, "lump", name)
    system.thermometer(name, f"regulate {module}")
    if name in system.lumps and sensor.lump != name:
        raise InputError(f"{name!r} is a lump, and a sensor on another lump, {sensor.lump!r}",
                         where=f"regulate {module}", expected="a name that means one thing",
                         remedy="Rename the sensor.")
    reference = next(iter(system.ambients.values())).temperature
    return RegulatedPoint(module, name, "sensor", sensor.lump, sensor.gain, sensor.offset, reference,
                          sensor.time_constant, sensor.delay)
