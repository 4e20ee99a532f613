"""What a synthesis returns: a controller, what it is proven to reach, and where it stops being sure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np

from .._control import control
from .._drawing import axes_for
from ..errors import Outcome
from ..export import Program
from ..linear import Plant, close, read_plant, responder
from ..verification import Certificate
from ._export import document, export_design, program, said
from ._margins import Margins, margins
from ._plant import GeneralizedPlant


@dataclass(frozen=True)
class RobustAgainst:
    """Which plants a claim covers.

    Parameters
    ----------
    text : str
        What may differ from the plant as given, in one sentence.
    data : mapping
        The numbers of that sentence by name.
    """

    text: str
    data: Mapping[str, float] = field(default_factory=dict)

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True)
class Design:
    """A controller and what is proven of it.

    Parameters
    ----------
    controller : control.StateSpace
        K from y to u with u = +K y; a zero gain where none was found.
    value : float
        Proven bound of the norm, for the controller as returned; infinity where nothing is proven.
    lower : float
        Best known bound on what any controller reaches, estimated in floats or balls, not proven.
    closed_loop : control.StateSpace
        Loop from w to z in floats.
    certificates : list of Certificate
        Proofs, about the numbers of plant and controller; `rt.verify` checks each again.
    robust_against : RobustAgainst
        What set of plants the claim covers.
    outcome : Outcome
        How it ended; its text is the remedy.
    method : str
        Equations or program that gave the controller.
    solver : str
        What solved them, and in which precision.
    solve_time : float
        Time of the whole synthesis with its proofs [s].
    iterations : int
        Levels or steps that were tried.
    plant : GeneralizedPlant or None
        Parts of the plant the controller was made for; None where there is only a response.
    """

    controller: control.StateSpace
    value: float
    lower: float
    closed_loop: control.StateSpace
    certificates: list[Certificate]
    robust_against: RobustAgainst
    outcome: Outcome
    method: str
    solver: str
    solve_time: float
    iterations: int
    plant: GeneralizedPlant | None = field(repr=False)

    @property
    def holds(self) -> bool:
        """Whether the controller is proven to do what was asked."""
        return self.outcome.ok

    @property
    def _judged(self) -> str:
        """What `value` is: a design that holds without a certificate was evaluated only."""
        return "evaluated" if self.holds and not self.certificates else "proven"

    @cached_property
    def margins(self) -> Margins:
        """Disk, gain [-], phase [deg], delay [s] and modulus margin of every control and of all at once, in floats.

        Empty where the loop is not stable.
        """
        if self.plant is None:
            return {}
        return margins(self.plant, read_plant(self.controller), self.controller.output_labels)

    def __str__(self) -> str:
        K = self.controller
        sizes = f"{K.nstates} states, {K.ninputs} measurements, {K.noutputs} controls"
        lines = [f"{self.method}, {self.solver}", self.outcome.text,
                 f"  controller      {sizes}, {f'sampled at {K.dt:g} s' if K.dt else 'continuous'}",
                 f"  {self._judged:<15} {self.value:.6g}", f"  estimated best  {self.lower:.6g}",
                 f"  time            {self.solve_time:.3g} s, {self.iterations} iterations"]
        lines += [f"  {name:<15} disk margin {one['disk']:.3g}, gain {one['gain']:.3g}, phase {one['phase']:.3g} deg, "
                  f"delay {one['delay']:.3g} s" for name, one in self.margins.items()]
        return "\n".join([*lines, f"  {self.robust_against}"])

    def plot(self, ax: Any = None) -> Any:
        """Draw the largest singular value of the closed loop over frequency, with the bound where one of it is proven.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Axes to draw into; default new ones.

        Returns
        -------
        matplotlib.axes.Axes
        """
        loop = read_plant(self.closed_loop)
        poles = abs(np.log(loop.poles.astype(complex)) / loop.dt) if loop.dt else abs(loop.poles)
        poles = poles[(poles > 0) & np.isfinite(poles)]
        low, high = (poles.min() / 100, poles.max() * 100) if len(poles) else (1e-2, 1e2)
        omega = np.geomspace(low, min(high, loop.end), 600)
        ax = axes_for(ax)
        ax.loglog(omega, [np.linalg.norm(value, 2) for value in responder(loop)(omega)], label="closed loop")
        for bound in self._gain_bounds():
            ax.axhline(bound, color="0.5", linestyle="--", label="proven bound")
        ax.set_xlabel("frequency [rad/s]")
        ax.set_ylabel("largest singular value of w to z [z/w]")
        ax.legend(loc="best")
        return ax

    def _gain_bounds(self) -> list[float]:
        """Proven bounds of the H-infinity norm from all of w to all of z: an H2 norm is no bound of singular values."""
        every = (self.closed_loop.noutputs, self.closed_loop.ninputs)
        regions = [one.region for one in self.certificates if one.region.get("measure") == "hinf"]
        return [one["bound"] for one in regions if "channels" not in one or
                tuple(len(one["channels"][side]) for side in ("outputs", "inputs")) == every]

    def export(self, path: str | Path, name: str = "controller") -> None:
        """Write the controller for other programs.

        Parameters
        ----------
        path : str or path
            A file ending in .c, .h, .mat or .json, or a folder, which gets design.json, the certificates and, of a
            sampled controller, controller.c and controller.h. C and the certificates hold the same doubles.
        name : str
            Name of the design; in C the prefix of every identifier.

        Raises
        ------
        InputError
            For another ending, C source of a continuous controller, or a file that cannot be written.
        """
        export_design(document(self.controller, name) | self._facts(), self.certificates, path,
                      partial(self._source, name) if self.has_source else None, self._no_source)

    @property
    def has_source(self) -> bool:
        """Whether `export` writes C source: of a controller that is sampled."""
        return bool(self.controller.dt)

    @property
    def _no_source(self) -> str:
        """How to get a design that has C source."""
        return "C source needs a sampled controller: design it with sample_time=."

    @property
    def _said(self) -> str:
        """What is proven, as lines of the comment at the top of C source."""
        return said(self.outcome.text)

    def _source(self, name: str) -> Program:
        return program(self.controller, name, self._said)

    def _facts(self) -> dict[str, Any]:
        """What design.json says beside the controller."""
        return {"method": self.method, "solver": self.solver, "value": self.value, "lower": self.lower,
                 "margins": self.margins, "robust_against": {"text": str(self.robust_against),
                                                             **self.robust_against.data},
                 "outcome": {"ok": self.outcome.ok, "code": self.outcome.code, "text": self.outcome.text}}


def zero_controller(plant: GeneralizedPlant) -> Plant:
    """What stands for a controller where none was found."""
    return Plant(np.zeros((0, 0)), np.zeros((0, len(plant.C2))), np.zeros((plant.B2.shape[1], 0)),
                 np.zeros((plant.B2.shape[1], len(plant.C2))), plant.dt)


def as_system(plant: Plant, inputs: list[str], outputs: list[str]) -> control.StateSpace:
    """The same as a python-control system with names."""
    return control.ss(plant.A, plant.B, plant.C, plant.D, plant.dt, inputs=inputs, outputs=outputs)


def named(P: control.StateSpace, plant: GeneralizedPlant, K: Plant) -> tuple[control.StateSpace, control.StateSpace]:
    """Controller and closed loop, with the names of the plant."""
    n_y, n_u = len(plant.C2), plant.B2.shape[1]
    w, u, z, y = P.input_labels[:-n_u], P.input_labels[-n_u:], P.output_labels[:-n_y], P.output_labels[-n_y:]
    return as_system(K, y, u), as_system(close(plant.joined, K), w, z)


def small_gain(value: float) -> RobustAgainst:
    """What a bound of the H-infinity norm says of other plants."""
    if not np.isfinite(value):
        return RobustAgainst("Nothing is proven, of this plant or of others.")
    return RobustAgainst("Proven for the plant as given, and for every stable perturbation w = Delta z of H-infinity "
                         f"norm up to {1 / value:.6g}.", {"delta_norm": 1 / value})


