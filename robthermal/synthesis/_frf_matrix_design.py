"""The result of a design from frequency responses of several inputs and as many outputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from .._arrays import Array
from .._drawing import axes_for, line_of
from ..linear import Plant
from ._frf_design import FrfDesign
from ._margins import Margins
from ._structure import Structure


def entries(m: int) -> list[str]:
    """Names of the entries of a matrix, row by row: "11", "12", ...

    Parameters
    ----------
    m : int
        Rows and columns, at most 9.
    """
    return [f"{row}{column}" for row in range(1, m + 1) for column in range(1, m + 1)]


@dataclass(frozen=True)
class MatrixResponse:
    """Plants of which each entry differs from center by at most its radius; ``model``: the plant, where it is known.

    Parameters
    ----------
    omega : ndarray, shape (n_f,)
        Frequencies of the bins [rad/s].
    center : ndarray, shape (n_f, m, m)
        Measured values of the entries.
    spread : ndarray, shape (n_f,)
        Norm of the matrix of radii: no plant in the circles differs by more.
    model : Plant or None
        State space, where the response is that of a model.
    where : str
        Name of the argument, for messages.
    """

    omega: Array
    center: Array
    spread: Array
    model: Plant | None
    where: str


@dataclass(frozen=True)
class FrfMatrixDesign(FrfDesign):
    """PI or PID matrices for several inputs and as many outputs; negative feedback: u = K (r - y).

    As `FrfDesign`. ``gains``: by name and entry, "Kp11" (first control, first measurement) to "Kd22" or so; ``value``:
    bound of the largest singular value of the sensitivity (I + GK)⁻¹; ``modulus_margin``: smallest one of I + GK.

    Parameters
    ----------
    controller : control.StateSpace
        K from the errors to the controls, u = K (r - y); its numbers are the gains.
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
        Gains by name and entry: Kp11 [control unit per measurement unit], Ki12 [the same per second], Kd22 [the same
        times seconds].
    modulus_margin : mapping
        "stated": what was asked; "robust": smallest singular value of I + GK over all circles and bins [-].
    discs : list
        Always empty: ``responses`` take their place.
    structure : Structure
        Basis that the gains multiply.
    responses : list of MatrixResponse
        Frequencies, values and circles the gains were made for.

    Examples
    --------
    >>> import control, numpy as np, robthermal as rt
    >>> plant = control.ss(np.diag([-1.0, -0.5]), np.eye(2), [[1.0, 0.3], [-0.2, 1.0]], np.zeros((2, 2)))
    >>> d = rt.design.frf_pid(plant, modulus_margin=0.7, decentralized=True)
    >>> d.holds, d.gains["Ki12"], rt.verify(d.certificates[0]).valid
    (True, 0.0, True)
    """

    responses: Sequence[MatrixResponse] = ()

    @cached_property
    def margins(self) -> Margins:
        """Smallest singular value of I + GK over the bins, as "modulus" [-], and the disk margin it implies."""
        if self.structure is None:
            return {}
        found: Margins = {}
        X = gain_matrices(self.structure, self.gains)
        loops = "both loops" if X.shape[1] == 2 else "all loops"
        for k, one in enumerate(self.responses):
            K = np.einsum("fb,bij->fij", self.structure.basis(one.omega), X)
            L = one.center @ K
            eye = np.eye(L.shape[1])
            modulus = float(np.linalg.svd(eye + L, compute_uv=False)[:, -1].min())
            alpha = 2 / float(np.linalg.norm((eye - L) @ np.linalg.inv(eye + L), 2, axis=(1, 2)).max())
            found[loops if len(self.responses) == 1 else f"response {k}"] = {"disk": alpha, "modulus": modulus}
        return found

    def plot(self, ax: Any = None) -> Any:
        """Draw the largest singular value of the sensitivity, of responses and of the worst plants in their circles.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Axes to draw into; default new ones.

        Returns
        -------
        matplotlib.axes.Axes
        """
        ax = axes_for(ax)
        for k, one in enumerate(self.responses):
            name = "response" if len(self.responses) == 1 else f"response {k}"
            basis = self.structure.basis(one.omega) if self.structure else np.zeros((len(one.omega), 0))
            K = np.einsum("fb,bij->fij", basis, gain_matrices(self.structure, self.gains) if self.structure
                          else np.zeros((0, *one.center.shape[1:])))
            least = np.linalg.svd(np.eye(one.center.shape[1]) + one.center @ K, compute_uv=False)[:, -1]
            worst = least - one.spread * np.linalg.norm(K, 2, axis=(1, 2))
            ax.loglog(one.omega, 1 / least, **line_of(k), label=name)
            if one.spread.any():
                ax.loglog(one.omega, np.where(worst > 0, 1 / np.where(worst > 0, worst, 1), np.nan),
                          **line_of(k) | {"linestyle": ":"}, label=f"worst plant in the circles of {name}")
        ax.axhline(1 / self.modulus_margin["stated"], color="0.5", linestyle="--",
                   label=f"asked for: at most {1 / self.modulus_margin['stated']:.3g}")
        ax.set(xlabel="frequency [rad/s]", ylabel="largest singular value of the sensitivity [-]")
        ax.legend(loc="best")
        return ax


def gain_matrices(structure: Structure, gains: Mapping[str, float]) -> Array:
    """Gain matrices of the basis functions, (n_basis, m, m).

    Parameters
    ----------
    structure : Structure
        Basis that the gains multiply.
    gains : mapping
        Gains by name and entry.
    """
    m = round((len(gains) / len(structure.names)) ** 0.5)
    return np.array([[gains[f"{name}{entry}"] for entry in entries(m)] for name in structure.names]).reshape(-1, m, m)
