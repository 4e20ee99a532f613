"""What a scheduled design returns: controllers at the vertices, and the controller at any point between them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from .._arrays import Array
from .._control import control
from ..export import Program
from ..linear import Plant, close, read_plant, responder
from ._design import Design, as_system
from ._lpv_source import scheduled_program
from ._margins import Margins, margins
from ._plant import read_generalized
from ._schedule import Schedule, read_schedule


@dataclass(frozen=True)
class LpvDesign(Design):
    """A controller scheduled by measured quantities, for every plant in the convex hull of some vertices.

    Parameters
    ----------
    controller : control.StateSpace
        Controller of the mean plant; `gain` gives those of other points.
    value : float
        Proven bound for all plants of the hull: of the H-infinity norm, while they vary of the L2 gain; infinity where
        nothing is proven.
    lower : float
        Largest H-infinity optimum of the vertices one by one, estimated: no scheduled controller does better.
    closed_loop : control.StateSpace
        Loop of the mean plant with its controller, in floats.
    certificates : list of Certificate
        Kind "polytope", about the numbers of plants and controllers at the vertices; `rt.verify` checks it again.
    robust_against : RobustAgainst
        What set of plants the claim covers.
    outcome : Outcome
        How it ended; its text is the remedy.
    method : str
        Program that gave the controllers.
    solver : str
        What solved it.
    solve_time : float
        Time of the whole synthesis with its proof [s].
    iterations : int
        Sets of controllers that were tried.
    plant : GeneralizedPlant or None
        Mean plant of the hull.
    controllers : tuple of control.StateSpace
        Controllers at the vertices, in one set of states: their matrices are averaged.
    plants : tuple of control.StateSpace
        Plants at the vertices.
    scheduling : mapping
        Values of the scheduling quantities at the vertices, by name [their units].
    """

    controllers: tuple[control.StateSpace, ...] = field(default=(), repr=False)
    plants: tuple[control.StateSpace, ...] = field(default=(), repr=False)
    scheduling: Mapping[str, Array] = field(default_factory=dict, repr=False)

    def gain(self, scheduling: Mapping[str, float]) -> control.StateSpace:
        """Controller at a point of the scheduling quantities: the vertices' average, with the weights of the point.

        Parameters
        ----------
        scheduling : mapping
            Value of every scheduling quantity by name [its unit], inside the range of the vertices.

        Returns
        -------
        control.StateSpace
            Controller from y to u, u = +K y; its states mean the same at every point.

        Raises
        ------
        InputError
            For other names, or a point outside of the hull of the vertices.
        """
        weights = self._schedule.weights(scheduling)
        K = average([read_plant(one) for one in self.controllers], weights)
        return as_system(K, list(self.controller.input_labels), list(self.controller.output_labels))

    @cached_property
    def margins(self) -> Margins:
        """Smallest margins over the vertices, as of `Design`, in floats; empty where a loop is not stable."""
        if self.plant is None:
            return {}
        n_y, n_u = len(self.plant.C2), self.plant.B2.shape[1]
        every = [margins(read_generalized(P, n_y, n_u), read_plant(K), self.controller.output_labels)
                 for P, K in zip(self.plants, self.controllers, strict=True)]
        if not all(every):
            return {}
        return {name: {key: min(one[name][key] for one in every) for key in every[0][name]} for name in every[0]}

    def plot(self, ax: Any = None) -> Any:
        """Draw the largest singular value of the loops at the vertices over frequency, with the proven bound.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Axes to draw into; default new ones.

        Returns
        -------
        matplotlib.axes.Axes
        """
        ax = super().plot(ax)
        omega = ax.get_lines()[0].get_xdata()
        for k, (P, K) in enumerate(zip(self.plants, self.controllers, strict=True)):
            respond = responder(close(read_plant(P), read_plant(K)))
            ax.loglog(omega, [np.linalg.norm(value, 2) for value in respond(omega)], color="0.6", zorder=0,
                      label="" if k else "loops at the vertices")
        ax.legend(loc="best")
        return ax

    @property
    def has_source(self) -> bool:
        """Whether `export` writes C source: of sampled plants, on a grid or in simplices."""
        return bool(self.controller.dt) and (bool(self._schedule.axes) or len(self._schedule.simplices[0]) > 0)

    @property
    def _no_source(self) -> str:
        if not self.controller.dt:
            return "C source needs sampled plants: control.c2d, then design again."
        return "The points of the plants lie on a line or a plane: leave out quantities that depend on the others."

    @cached_property
    def _schedule(self) -> Schedule:
        return read_schedule(self.scheduling, len(self.controllers))

    def _source(self, name: str) -> Program:
        return scheduled_program(self.controllers, self._schedule, name, self._said)

    def _facts(self) -> dict[str, Any]:
        matrices = [{key: getattr(K, key) for key in "ABCD"} for K in self.controllers]
        return super()._facts() | {"scheduling": dict(self.scheduling), "controllers": matrices}


def average(systems: Sequence[Plant], weights: Array) -> Plant:
    """Systems averaged matrix by matrix."""
    A, B, C, D = (np.tensordot(weights, np.array([getattr(one, key) for one in systems]), 1) for key in "ABCD")
    return Plant(A, B, C, D, systems[0].dt)
