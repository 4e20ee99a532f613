"""A linear body that loses heat through films by h(ΔT), stepped through a record for several laws at once."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .._arrays import Floats
from ..errors import InputError
from ..signals import Record
from ..thermal import Equations, System
from ._convection_law import film_areas
from ._plateaus import Plateau, column

_STEPS = 1500  # at most, whatever the sampling
_GAMMA = 1.0 - math.sqrt(0.5)  # ROS2 of Verwer et al. (1999): L-stable, and of second order with any matrix, so that
_KEPT = 8  # one Jacobian serves for some steps


@dataclass(frozen=True)
class Body:
    """Network without its films, and the surface of every lump."""

    system: System
    rest: Equations
    surface: Floats  # (n,) [m²]
    ambient: str
    sensors: tuple[str, ...]

    @staticmethod
    def of(system: System, ambient: str, film: float, heater: str, record: Record) -> Body:
        """Body of a system whose links to an ambient are films of one coefficient."""
        areas = film_areas(system, ambient, film)
        if heater not in system.inputs:
            raise InputError(f"{heater!r} is no heater of the system", where="argument heater",
                             expected="one of " + (", ".join(system.inputs) or "(it has none)"))
        sensors = tuple(name for name in system.thermometers if name in record.output_names)
        if not sensors:
            raise InputError("no thermometer of the system is in the record", where="argument record",
                             expected="readings of " + (", ".join(system.thermometers) or "(the system has none)"))
        rest = Equations(system.with_parameters({f"links.{name}.conductance": 0.0 for name in areas}))
        if rest.terms:
            raise InputError("the system is not linear apart from its films", where="argument system",
                             expected="conduction and heaters; no modules, radiation or natural convection")
        surface = np.zeros(len(system.lumps))
        for link in system.links:
            if link.name in areas:
                lump, = (end for end in link.between if end != ambient)
                surface[rest.index[lump]] += areas[link.name]
        return Body(system, rest, surface, ambient, sensors)

    def seen(self, x: Floats) -> Floats:
        """What the thermometers show of temperatures (..., n): (..., n_sensors)."""
        reference = next(iter(self.system.ambients.values())).temperature
        sensors = [self.system.sensors[name] for name in self.sensors]
        gain, offset = np.array([[sensor.gain, sensor.offset] for sensor in sensors]).T
        at = [self.rest.index[sensor.lump] for sensor in sensors]
        return np.asarray(reference + gain * (x[..., at] - reference) + offset, np.float64)

    def run(self, laws: Floats, course: Course, start: int, stop: int, x: Floats) -> Floats:
        """Temperatures (stop - start + 1, P, n) under laws (P, 3) of a, b, c, from x (n,) at the step `start`."""
        a, b, c = laws.T[:, :, None]
        inverse, network = 1.0 / self.rest.capacity, self.rest.A.toarray()
        h, eye = course.step, np.eye(inverse.size)
        states = np.empty((stop - start + 1, len(laws), inverse.size))
        states[0] = x
        for k in range(start, stop):
            x, air, force = states[k - start], course.air[k], course.force[k]
            rise = b * np.abs(x - air) ** c
            if (k - start) % _KEPT == 0:
                jacobian = inverse[:, None] * (network - eye * (self.surface * (a + (1.0 + c) * rise))[:, None, :])
                solve = np.linalg.inv(eye - _GAMMA * h * jacobian)
            first = inverse * (x @ network.T + force - self.surface * (a + rise) * (x - air))
            k1 = (solve @ first[:, :, None])[:, :, 0]
            y = x + h * k1
            film = self.surface * (a + b * np.abs(y - air) ** c) * (y - air)
            k2 = (solve @ (inverse * (y @ network.T + force - film) - 2.0 * k1)[:, :, None])[:, :, 0]
            states[k - start + 1] = x + h * (1.5 * k1 + 0.5 * k2)
        return states


@dataclass(frozen=True)
class Course:
    """A record in steps: means over blocks of samples."""

    step: float  # [s]
    samples: int  # in a step
    force: Floats  # heat into every lump but through the films (N, n) [W]
    air: Floats  # (N,) [K]
    readings: Floats  # (N, n_sensors) [K]

    @staticmethod
    def of(body: Body, record: Record) -> Course:
        """The columns that the body needs."""
        samples = max(1, -(-len(record) // _STEPS))
        n = len(record) // samples

        def means(name: str) -> Floats:
            return column(record, name)[:n * samples].reshape(n, samples).mean(axis=1)

        nominal = dict(zip(body.system.exogenous_names, body.rest.nominal().tolist(), strict=True))
        u = np.column_stack([np.full(n, value) if name in body.system.ambients and name != body.ambient
                             and name not in record else means(name) for name, value in nominal.items()])
        force = np.asarray(body.rest.heat(np.zeros((n, body.surface.size)), u), np.float64)
        return Course(record.sample_time * samples, samples, force, means(body.ambient),
                      np.column_stack([means(name) for name in body.sensors]))

    def begin(self, plateau: Plateau) -> int:
        """First step of a plateau."""
        return round(plateau.start / self.samples)

    def end(self, plateau: Plateau) -> slice:
        """Steps of the last fifth of a plateau."""
        stop = min(plateau.stop // self.samples, len(self.air))
        length = 0.2 * (plateau.stop - plateau.start) / self.samples
        return slice(min(stop - 1, math.ceil(stop - length)), stop)

    def between(self, states: Floats) -> Floats:
        """States (N + 1, ...) at the beginning of the steps, as the means of their samples see them (N, ...)."""
        return states[:-1] + 0.5 * (1.0 - 1.0 / self.samples) * np.diff(states, axis=0)
