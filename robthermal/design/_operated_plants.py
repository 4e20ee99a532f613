"""Plants at their own steady state at the set-points: the nominal one, and those at corners of parameter ranges."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ..thermal import System
from ._corner_values import Corner, Ranges, checked_ranges
from ._linearization import FeedbackLinearization, feedback_linearization
from ._modules import Array
from ._reachable import Reachable, held_near, reachable
from ._regulated_points import Regulate, regulated_points
from ._sampled_loop import LoopParts, SampledLoop


@dataclass(frozen=True)
class OperatedPlant:
    """A plant in steady state.

    Parameters
    ----------
    corner : dict
        Parameters that differ from the nominal plant.
    system : System
        With these parameters.
    temperatures : ndarray
        Of all lumps [K].
    inputs : dict
        Currents, heaters and ambients [A], [unit], [K].
    """

    corner: Corner
    system: System
    temperatures: Array
    inputs: dict[str, float]

    def loop(self, parts: LoopParts) -> SampledLoop:
        """The linearized loop of this plant.

        Parameters
        ----------
        parts : LoopParts
            Law, controller and observer.
        """
        return parts.loop(self.system, self.temperatures, self.inputs)


@dataclass(frozen=True)
class Operation:
    """Where plants are operated: nominal law with its limits, set-points, surroundings.

    Parameters
    ----------
    law : FeedbackLinearization
        Of the nominal model.
    setpoint : dict
        Module to set-point [K].
    regulate : mapping or None
        Sensor or lump that a module regulates.
    inputs : dict
        Heaters [unit] and ambients [K].
    nominal : OperatedPlant
        Plant with the parameters as they stand.
    """

    law: FeedbackLinearization
    setpoint: dict[str, float]
    regulate: Regulate
    inputs: dict[str, float]
    nominal: OperatedPlant
    _found: dict[tuple[tuple[str, float], ...], OperatedPlant | None] = field(
        default_factory=dict, repr=False, compare=False)

    @classmethod
    def of(cls, law: FeedbackLinearization, setpoint: Mapping[str, float] | float, regulate: Regulate,
           inputs: Mapping[str, float] | None) -> Operation:
        """Refuse set-points that the nominal plant cannot hold.

        Parameters
        ----------
        law : FeedbackLinearization
            Of the nominal model.
        setpoint : mapping or float
            What is held [K].
        regulate : mapping or None
            Sensor or lump that a module regulates.
        inputs : mapping or None
            Heaters [unit] and ambients [K].
        """
        held = reachable(law, setpoint, regulate=regulate, inputs=inputs)
        held.require()
        return cls.at_reached(law, held, regulate, inputs)

    @classmethod
    def at_reached(cls, law: FeedbackLinearization, held: Reachable, regulate: Regulate,
                   inputs: Mapping[str, float] | None) -> Operation:
        """Around set-points known to be held.

        Parameters
        ----------
        law : FeedbackLinearization
            Of the nominal model.
        held : Reachability
            Steady state of the nominal plant.
        regulate : mapping or None
            Sensor or lump that a module regulates.
        inputs : mapping or None
            Heaters [unit] and ambients [K].
        """
        around = dict(inputs or {})
        nominal = OperatedPlant({}, law.system, np.array(list(held.temperatures.values())), {**around, **held.current})
        return cls(law, held.setpoint, regulate, around, nominal)

    def at(self, corner: Corner) -> OperatedPlant | None:
        """Plant with other parameters at its own steady state; None where it cannot hold the set-points.

        Parameters
        ----------
        corner : dict
            Parameters that differ from the nominal plant.
        """
        if not corner:
            return self.nominal
        key = tuple(sorted(corner.items()))
        if key not in self._found:
            self._found[key] = self._operated(corner)
        return self._found[key]

    def _operated(self, corner: Corner) -> OperatedPlant | None:
        plant, names = self.law.system.with_parameters(corner), self.law.names
        limits = {name: (float(low), float(high)) for name, low, high in
                  zip(names, self.law.current_low, self.law.current_high, strict=True)
                  if np.isfinite([low, high]).all()}
        own = feedback_linearization(plant, names, current_limits=limits or None)
        near = self.nominal.temperatures, np.array([self.nominal.inputs[name] for name in names])
        found = held_near(own, regulated_points(own, self.regulate), np.array(list(self.setpoint.values())),
                          self.inputs, near)
        if found is None:  # another way to the same steady state, and the word on whether there is one
            held = reachable(own, self.setpoint, regulate=self.regulate, inputs=self.inputs)
            if not held.outcome:
                return None
            found = np.array(list(held.temperatures.values())), np.array(list(held.current.values()))
        currents = dict(zip(names, found[1].tolist(), strict=True))
        return OperatedPlant(corner, plant, found[0], {**self.inputs, **currents})

    def faces(self, corner: Corner) -> Array:
        """Temperatures of the cold faces with other parameters [K]; the furthest reached where they cannot be held.

        Parameters
        ----------
        corner : dict
            Parameters that differ from the nominal plant.
        """
        plant = self.at(corner)
        if plant is not None:
            return np.array(plant.temperatures[self.law.modules.cold])
        own = feedback_linearization(self.law.system.with_parameters(corner), self.law.names)
        return np.array(list(reachable(own, self.setpoint, regulate=self.regulate, inputs=self.inputs).faces.values()))

    def relevant(self, ranges: Ranges, parts: LoopParts) -> dict[str, tuple[float, float]]:
        """Ranges of the parameters that change the loop.

        Parameters
        ----------
        ranges : mapping
            {parameter name: (lower, upper)}.
        parts : LoopParts
            Law, controller and observer.
        """
        nominal = self.nominal.loop(parts)

        def differs(corner: Corner) -> bool:
            plant = self.at(corner)
            loop = plant.loop(parts) if plant else None
            return loop is None or any(getattr(loop, key).shape != getattr(nominal, key).shape or not np.allclose(
                getattr(loop, key), getattr(nominal, key), rtol=1e-9, atol=1e-12) for key in "ABC")

        return {name: pair for name, pair in ranges.items() if any(differs({name: end}) for end in pair)}


def face_ranges(law: FeedbackLinearization, setpoint: Mapping[str, float] | float, *, regulate: Regulate = None,
                inputs: Mapping[str, float] | None = None, parameters: Ranges | None = None
                ) -> dict[str, tuple[float, float]]:
    """Range of every cold face while set-points are held, changes of single parameters added up.

    Parameters
    ----------
    law : FeedbackLinearization
        Of the nominal model, with its current limits.
    setpoint : mapping of module to float, or one number for all
        What is held [K].
    regulate : mapping of module to str, optional
        Sensor or lump that a module regulates; default its cold face.
    inputs : mapping, optional
        Ambients [K] and heaters [unit]; default nominal and off.
    parameters : mapping, optional
        {parameter name: (lower, upper)} of the plant.

    Returns
    -------
    dict
        Module to the coldest and the warmest temperature of its cold face [K]; where a plant cannot hold the
        set-points, the furthest it reaches counts.

    Examples
    --------
    >>> import robthermal as rt
    >>> law = rt.design.feedback_linearization(rt.systems.two_module())
    >>> rt.design.face_ranges(law, 288.15)
    {'m1': (288.15, 288.15), 'm2': (288.15, 288.15)}
    """
    held = reachable(law, setpoint, regulate=regulate, inputs=inputs)
    ranges = checked_ranges(law.system, parameters)
    if not (held.outcome and regulate and ranges):
        return {name: (face, face) for name, face in held.faces.items()}
    operation = Operation.at_reached(law, held, regulate, inputs)
    faces = np.array(list(held.faces.values()))
    low = high = np.zeros(len(faces))
    for name, pair in ranges.items():
        changes = [operation.faces({name: end}) - faces for end in pair]
        low, high = low + np.minimum(np.minimum(*changes), 0.0), high + np.maximum(np.maximum(*changes), 0.0)
    return {name: (float(face + down), float(face + up))
            for name, face, down, up in zip(held.faces, faces, low, high, strict=True)}
