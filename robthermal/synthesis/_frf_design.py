"""The result of a design from frequency responses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from .._drawing import axes_for
from ._design import Design
from ._frf_data import Discs
from ._frf_plot import draw_sensitivity
from ._margins import Margins
from ._structure import Structure


@dataclass(frozen=True)
class FrfDesign(Design):
    """A controller of fixed structure from frequency responses; negative feedback: u = C (r - y).

    Parameters
    ----------
    controller : control.StateSpace
        C from error to control, u = C (r - y); its numbers are the gains.
    value : float
        Bound of the sensitivity: proven with a model, else evaluated over circles and bins; infinity where not kept.
    lower : float
        Always 1: no loop with integral action has a sensitivity that stays below it.
    closed_loop : control.StateSpace or control.FRD
        Sensitivity in floats; at the bins where there is no model.
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
    gains : mapping
        Gains by name: Kp [control unit per measurement unit], Ki [the same per second], Kd [the same times seconds].
    modulus_margin : mapping
        "stated": what was asked; "robust": smallest distance of -1 from GC over all circles and bins [-].
    discs : list
        Frequencies, centers and radii of the responses.
    structure : Structure
        Basis that the gains multiply.
    """

    gains: Mapping[str, float] = field(default_factory=dict)
    modulus_margin: Mapping[str, float] = field(default_factory=dict)
    discs: list[Discs] = field(default_factory=list, repr=False)
    structure: Structure | None = field(default=None, repr=False)

    @cached_property
    def margins(self) -> Margins:
        """Modulus, gain [-], phase [deg] and delay [s] margins at the bins, of the centers; "robust": modulus."""
        if self.structure is None:
            return {}
        found: Margins = {}
        x = np.array(list(self.gains.values()))
        for k, one in enumerate(self.discs):
            L = one.center * (self.structure.basis(one.omega) @ x)
            alpha = 2 / float(abs((1 - L) / (1 + L)).max())
            large = abs(L) > 1
            crossing = np.flatnonzero(large[:-1] & ~large[1:])
            phase = np.pi - abs(np.angle(L[crossing]))
            found[self.controller.output_labels[0] if len(self.discs) == 1 else f"response {k}"] = {
                "disk": alpha, "gain": (2 + alpha) / (2 - alpha) if alpha < 2 else np.inf,
                "phase": float(np.degrees(phase.min())) if len(phase) else np.inf,
                "delay": float((phase / one.omega[crossing]).min()) if len(phase) else np.inf,
                "modulus": float(abs(1 + L).min())}
        return found

    def plot(self, ax: Any = None) -> Any:
        """Draw the sensitivity over frequency, of the responses and of the worst plants in their circles.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Axes to draw into; default new ones.

        Returns
        -------
        matplotlib.axes.Axes
        """
        gains = np.array(list(self.gains.values()))
        C = [self.structure.basis(one.omega) @ gains if self.structure else 0 * one.center
             for one in self.discs]
        return draw_sensitivity(axes_for(ax), self.discs, C, self.modulus_margin.get("stated"))
