"""Coprime factors of two subsystems with several inputs and outputs: matrices, of which the order counts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..._arrays import Array
from ..._control import control
from ...errors import InputError
from ..systems import Response, apart, expect_stable, matrix_of, sample_time_of, stable
from ._coprime import check_cutoff
from ._inner_matrix import inner_pair
from ._loop import feedback_matrix
from ._normalized import normalized


@dataclass(frozen=True, eq=False)
class MatrixLoop:
    """One subsystem: P Q = Z, C = Nk Dk⁻¹, S = (I + P C)⁻¹.

    Parameters
    ----------
    P, C : StateSpace
        Plant (p outputs, m inputs) and controller (m outputs, p inputs), negative feedback.
    Z, Q : StateSpace
        Inner factor (p, m) and the stable filter (m, m) that makes it of the plant.
    Nk, Dk : StateSpace
        Right factors of the controller.
    S : StateSpace
        Sensitivity at the output of the plant.
    """

    P: control.StateSpace
    C: control.StateSpace
    Z: control.StateSpace
    Q: control.StateSpace
    Nk: control.StateSpace
    Dk: control.StateSpace
    S: control.StateSpace


@dataclass(frozen=True, eq=False)
class MatrixFactors:
    """Right coprime factors of two subsystems, block diagonal: P0 = Np Dp⁻¹, K0 = Nk Dk⁻¹.

    Parameters
    ----------
    loops : tuple of MatrixLoop
        The two subsystems.
    """

    loops: tuple[MatrixLoop, MatrixLoop]

    @property
    def dt(self) -> float:
        """Sample time [s]; 0 in continuous time."""
        return float(self.loops[0].P.dt)

    def at(self, omega: ArrayLike) -> dict[str, Array]:
        """Factors at frequencies, whole matrices.

        Parameters
        ----------
        omega : array_like, shape (n_f,)
            Frequencies of the responses [rad/s].

        Returns
        -------
        dict of ndarray, shape (n_f, rows, columns)
            "Np", "Dp", "Nk", "Dk" and "P0".
        """
        names = {"Np": "Z", "Dp": "Q", "Nk": "Nk", "Dk": "Dk", "P0": "P"}
        return {name: np.moveaxis(Response(apart(*(getattr(loop, field) for loop in self.loops)))(omega), -1, 0)
                for name, field in names.items()}


def matrix_factors(P1: Any, P2: Any, C1: Any, C2: Any, cutoff: float | None = None) -> MatrixFactors:
    """Read two subsystems, check their loops and build their factors.

    Parameters
    ----------
    P1, P2, C1, C2 : StateSpace or TransferFunction
        Plants and stabilizing controllers; transfer functions of one input and one output only.
    cutoff : float, optional
        Continuous time: frequency beyond which Z rolls off [rad/s].
    """
    dt = sample_time_of({"P1": P1, "P2": P2, "C1": C1, "C2": C2})
    check_cutoff(cutoff)
    plants, controllers = ([matrix_of(system, f"{name}{k}", dt) for k, system in enumerate(pair, 1)]
                           for name, pair in (("P", (P1, P2)), ("C", (C1, C2))))
    if plants[0].noutputs != plants[1].noutputs:
        raise InputError(f"P1 has {plants[0].noutputs} outputs, P2 has {plants[1].noutputs}", where="P1, P2",
                         expected="as many outputs: e12 = y2 - y1", remedy="Choose the outputs that shall agree.")
    first, second = (_closed(P, C, k, cutoff) for k, (P, C) in enumerate(zip(plants, controllers, strict=True), 1))
    return MatrixFactors((first, second))


def _closed(P: control.StateSpace, C: control.StateSpace, number: int, cutoff: float | None) -> MatrixLoop:
    names, dt = f"P{number}, C{number}", float(P.dt)
    if (C.ninputs, C.noutputs) != (P.noutputs, P.ninputs):
        raise InputError(f"C{number} has {C.noutputs} outputs and {C.ninputs} inputs", where=names,
                         expected=f"{P.ninputs} outputs and {P.noutputs} inputs, the plant's the other way round")
    well = np.eye(P.noutputs) + P.D @ C.D
    if abs(np.linalg.det(well)) < 1e-12:
        raise InputError("I + P(∞) C(∞) is singular: the loop is not well posed", where=names,
                         expected="a well-posed loop", remedy="Add a delay or a low-pass filter to the controller.")
    loop = feedback_matrix(P, C)
    poles = np.linalg.eigvals(loop)
    expect_stable(poles, names, dt, "the loop of plant and controller is unstable",
                  "The controllers must stabilize their own plants (negative feedback, e = r - y).")
    Z, Q = inner_pair(P, f"P{number}", cutoff, poles)
    Nk, Dk = _controller_factors(C, f"C{number}")
    return MatrixLoop(P, C, Z, Q, Nk, Dk, _sensitivity(P, C, loop, np.linalg.inv(well)))


def _sensitivity(P: control.StateSpace, C: control.StateSpace, loop: Array, well: Array) -> control.StateSpace:
    """v to y = v + P u, u = -C y; states of the plant, then of the controller with its sign (driven by e = -y)."""
    B = np.vstack([-P.B @ C.D @ well, -C.B @ well])
    return control.StateSpace(loop, B, np.hstack([well @ P.C, well @ P.D @ C.C]), well, P.dt,
                              remove_useless_states=False)


def _controller_factors(C: control.StateSpace, where: str) -> tuple[control.StateSpace, control.StateSpace]:
    """C = Nk Dk⁻¹: Dk = I for a stable controller, else the normalized factors."""
    if not C.nstates or bool(np.all(stable(np.linalg.eigvals(C.A), float(C.dt)))):
        return C, control.ss([], [], [], np.eye(C.ninputs), C.dt)
    try:
        found = normalized(C, "right")
    except InputError as error:
        raise InputError(error.what, where=where, expected=error.expected, remedy=error.remedy) from None
    return found.N, found.M
