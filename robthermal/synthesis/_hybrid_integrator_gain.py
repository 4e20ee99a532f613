"""Hybrid integrator-gain control: an integrator kept in a sector, and the circle criterion for the sampled loop.

The proof needs no new kind: an element in the sector [0, k] is k/2 plus something of gain k/2 at most, and a
certificate of a closed loop bounds the rest.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import Array
from .._checks import positive_number
from .._control import control
from ..errors import InputError, Outcome
from ..linear import Plant, close, plant_norm, prove_closed_loop, read_plant
from ..verification import Certificate
from ._arguments import held
from ._design import as_system
from ._export import document, export_design, said
from ._hybrid_source import hybrid_program
from ._outcomes import SynthesisCode

_AT_ONE = 1e-9  # distance of an eigenvalue from 1 below which the linear part integrates
_GRID = 2000  # frequencies at which the largest sector is looked for


@dataclass(frozen=True)
class HybridIntegratorGain:
    """A loop with a hybrid integrator-gain element beside a linear controller, and what is proven of it.

    Parameters
    ----------
    plant : control.StateSpace
        Sampled plant from the control to the measured quantity.
    linear : control.StateSpace
        Sampled linear controller from the error to its share of the control.
    gain : float
        k: the element's output lies between 0 and k times the error [control unit / measured unit].
    rate : float
        Integrator rate [control unit / (measured unit s)], while the output is inside the sector.
    sample_time : float
        Time between two samples [s].
    largest_gain : float
        Gain up to which the circle criterion holds, estimated on a grid of frequencies; infinity where none limits it.
    offset_free : bool
        Whether the linear controller integrates: the error of constant set-points and loads then goes to zero.
    certificate : Certificate
        Kind "closed_loop": norm from w to the error below 2/k with k/2 in the place of the element.
    outcome : Outcome
        Whether it is proven; the text says what.
    """

    plant: control.StateSpace
    linear: control.StateSpace
    gain: float
    rate: float
    sample_time: float
    largest_gain: float
    offset_free: bool
    certificate: Certificate
    outcome: Outcome

    @property
    def holds(self) -> bool:
        """Whether the loop is proven stable."""
        return self.certificate.holds

    def __str__(self) -> str:
        return self.outcome.text

    def export(self, path: str | Path, name: str = "controller") -> None:
        """Write element and linear controller for other programs.

        Parameters
        ----------
        path : str or path
            A file ending in .c, .h, .mat or .json, or a folder, which gets design.json, the certificate, controller.c
            and controller.h.
        name : str
            Name of the controller; in C the prefix of every identifier.

        Raises
        ------
        InputError
            For another ending, or a file that cannot be written.
        """
        content = document(self.linear, name) | {
            "element": {"gain": self.gain, "rate": self.rate},
            "outcome": {"ok": self.outcome.ok, "code": self.outcome.code, "text": self.outcome.text}}
        export_design(content, [self.certificate] if self.holds else [], path, partial(
            hybrid_program, read_plant(self.linear), self.gain, self.rate * self.sample_time, name,
            said(self.outcome.text)), "")

    def element(self, output: float, error: float) -> float:
        """Next output of the element: it integrates, and is cut off at the sector.

        Parameters
        ----------
        output : float
            Its output at the sample before [control unit]; 0 at the start.
        error : float
            Error at this sample [measured unit].

        Returns
        -------
        float
            ``output + rate sample_time error``, moved to the nearest number between 0 and ``gain error``.
        """
        low, high = sorted((0.0, self.gain * error))
        return float(min(max(output + self.rate * self.sample_time * error, low), high))

    def describing_function(self, frequency: ArrayLike) -> Array:
        """First harmonic of the element's output for a sine, over that sine; of any amplitude, without sampling.

        It predicts, and proves nothing. Deenen et al. (2017); the integrator it replaces has ``rate / (j omega)``.

        Parameters
        ----------
        frequency : array_like
            Angular frequencies [rad/s], above zero.

        Returns
        -------
        numpy.ndarray of complex
            Of the shape of `frequency` [control unit / measured unit].
        """
        w = np.asarray(frequency, float)
        if not (np.isfinite(w) & (w > 0)).all():
            raise InputError("a frequency is zero, negative or not finite", where="argument frequency",
                             expected="angular frequencies above zero [rad/s]")
        g = 2 * np.arctan(self.gain * w / self.rate)  # phase at which the integrator meets the sector
        turned = 1j * np.expm1(-2j * g) / (2 * np.pi)
        integrating = g / np.pi + turned - 4j * np.expm1(-1j * g) / (2 * np.pi)
        found: Array = self.rate / (1j * w) * integrating + self.gain * ((np.pi - g) / np.pi + turned)
        return found

    def simulate(self, reference: ArrayLike, load: ArrayLike = 0.0, *, samples: int | None = None) -> dict[str, Array]:
        """Run the sampled loop from rest.

        Parameters
        ----------
        reference : array_like, shape (n,) or ()
            Set-point of the measured quantity, as a deviation from the start [measured unit].
        load : array_like, shape (n,) or ()
            Added to the control at the plant's input [control unit].
        samples : int, optional
            How many samples; needed where reference and load are numbers.

        Returns
        -------
        dict of ndarray, shape (n,)
            "time" [s], "reference", "measured", "error", "control", "element" (its share), and "gain_mode": whether
            the element was at its gain.
        """
        r, d = np.asarray(reference, float), np.asarray(load, float)
        sizes = {x.size for x in (r, d) if x.ndim} | ({int(samples)} if samples is not None else set())
        if len(sizes) != 1 or max(r.ndim, d.ndim) > 1 or not np.isfinite(r).all() or not np.isfinite(d).all():
            raise InputError(f"shapes {r.shape} and {d.shape}", where="arguments reference, load",
                             expected="finite numbers or (n,) of one length; samples where both are numbers")
        n = sizes.pop()
        r, d = np.broadcast_to(r, (n,)), np.broadcast_to(d, (n,))
        P, C = read_plant(self.plant), read_plant(self.linear)
        x, z, h = np.zeros(len(P.A)), np.zeros(len(C.A)), 0.0
        y, u, share = np.zeros(n), np.zeros(n), np.zeros(n)
        for k in range(n):
            y[k] = (P.C @ x)[0]
            e = r[k] - y[k]
            h = self.element(h, e)
            u[k], share[k] = (C.C @ z)[0] + C.D[0, 0] * e + h, h
            z = C.A @ z + C.B[:, 0] * e
            x = P.A @ x + P.B[:, 0] * (u[k] + d[k])
        return {"time": self.sample_time * np.arange(n), "reference": np.array(r), "measured": y, "error": r - y,
                "control": u, "element": share, "gain_mode": share == self.gain * (r - y)}


def hybrid_integrator_gain(plant: Any, linear: Any, *, gain: float, rate: float,
                           sample_time: float | None = None) -> HybridIntegratorGain:
    """A hybrid integrator-gain element beside a linear controller, with a proof of the loop by the circle criterion.

    The element integrates the error, but its output always has the sign of the error and is at most `gain` times as
    large: it does not wind up, and lags by 38 degrees at most in its first harmonic, an integrator by 90. The control
    is linear(error) + element(error), error = set-point - measured. What is proven holds for every element in the
    sector, whatever its rate.

    Parameters
    ----------
    plant : control.StateSpace or control.TransferFunction
        From one control to one measured quantity, strictly proper. A continuous one is sampled exactly with the control
        held.
    linear : float, control.StateSpace or control.TransferFunction
        Linear controller, from the error to the control: a proportional gain, or a PI. A continuous one is sampled with
        the error held.
    gain : float
        k of the sector [control unit / measured unit].
    rate : float
        Rate at which the element integrates inside the sector [control unit / (measured unit s)].
    sample_time : float, optional
        Time between two samples [s], of a continuous plant.

    Returns
    -------
    HybridIntegratorGain
        ``holds`` is False where the criterion fails: the loop may be stable all the same, but nothing is proven.

    Raises
    ------
    InputError
        More than one input or output, a direct path through the plant, sample times that do not fit, numbers that are
        not positive.

    References
    ----------
    Deenen, Heertjes, Heemels and Nijmeijer, Hybrid integrator design for enhanced tracking in motion control, American
    Control Conference (2017); van den Eijnden et al., IEEE Control Systems Letters 4 (2020); Khalil (2002), Nonlinear
    Systems, theorem 7.1.

    Examples
    --------
    >>> import control, robthermal as rt
    >>> stage = control.tf([2.0], [3000.0, 160.0, 1.0])  # K/W, time constants 139 s and 22 s
    >>> pi = control.tf([4.0, 0.01], [1, 0])
    >>> d = rt.design.hybrid_integrator_gain(stage, pi, gain=4.0, rate=0.1, sample_time=1.0)
    >>> d.holds, d.offset_free, rt.verify(d.certificate).valid
    (True, True, True)
    >>> rt.design.hybrid_integrator_gain(stage, 4.0, gain=400.0, rate=0.1, sample_time=1.0).holds
    False
    """
    k, rho = positive_number(gain, "gain"), positive_number(rate, "rate")
    P = held(_one_by_one(plant, "argument plant"), sample_time)
    given = control.ss([], [], [], [[float(linear)]], dt=P.dt) if isinstance(linear, (int, float)) else linear
    C = _one_by_one(given, "argument linear")
    C = C if C.dt or not len(C.A) else held(C, P.dt)
    C = Plant(C.A, C.B, C.C, C.D, P.dt) if not len(C.A) else C
    if P.D.any():
        raise InputError("a direct path from the control to the measured quantity", where="argument plant",
                         expected="a strictly proper plant, D = 0")
    if abs(C.dt - P.dt) > 1e-9 * P.dt:
        raise InputError(f"sample times {P.dt:g} s and {C.dt:g} s", where="argument linear", expected="the same")
    C = Plant(C.A, C.B, C.C, C.D, P.dt)
    loop, controller = _centered(P, C, k)
    bound = float(np.nextafter(2.0 / k, 0.0))  # not above 2/k, whatever the rounding
    certificate = prove_closed_loop(loop, controller, bound=bound)
    integrates = bool(len(C.A)) and bool((abs(np.linalg.eigvals(C.A) - 1.0) < _AT_ONE).any())
    largest, where = _largest_gain(P, C)
    outcome = _outcome(certificate, close(loop, controller), k, largest, where, integrates)
    return HybridIntegratorGain(as_system(P, ["control"], ["measured"]), as_system(C, ["error"], ["control"]), k, rho,
                                P.dt, largest, integrates, certificate, outcome)


def _one_by_one(system: Any, where: str) -> Plant:
    found = read_plant(system, where)
    if found.D.shape != (1, 1):
        raise InputError(f"{found.D.shape[1]} inputs and {found.D.shape[0]} outputs", where=where,
                         expected="one of each")
    return found


def _centered(P: Plant, C: Plant, k: float) -> tuple[Plant, Plant]:
    """Plant from (w, u) to (e, e, e) with w at the control, and the controller [C, k/2] of the last two."""
    plant = Plant(P.A, np.hstack([P.B, P.B]), np.vstack([-P.C] * 3), np.zeros((3, 2)), P.dt)
    return plant, Plant(C.A, np.hstack([C.B, np.zeros((len(C.A), 1))]), C.C, np.hstack([C.D, [[k / 2]]]), P.dt)


def _largest_gain(P: Plant, C: Plant) -> tuple[float, float]:
    """-1 / min Re H over a grid, H from the element's output to -error with the element left out; and where [rad/s]."""
    plant = Plant(P.A, np.hstack([P.B, P.B]), np.vstack([P.C, -P.C]), np.zeros((2, 2)), P.dt)
    H = close(plant, C)
    if not H.stable:
        return 0.0, np.nan
    w = np.geomspace(1e-7, 1.0, _GRID) * np.pi / P.dt
    z = np.exp(1j * w * P.dt)
    real = np.array([(H.C @ np.linalg.solve(one * np.eye(len(H.A)) - H.A, H.B) + H.D)[0, 0].real for one in z])
    least = int(np.argmin(real))
    return (float(-1 / real[least]) if real[least] < 0 else np.inf), float(w[least])


def _outcome(certificate: Certificate, loop: Plant, k: float, largest: float, where: float, integrates: bool
             ) -> Outcome:
    if certificate.holds:
        more = ("The linear part integrates, so that the error of constant set-points and loads goes to zero."
                if integrates else "The linear part does not integrate: constant loads and set-points leave an error, "
                "which is only proven to be bounded in proportion to them.")
        return SynthesisCode.CERTIFIED.outcome(
            f"Circle criterion proven: the sampled loop is stable with every element in the sector [0, {k:g}], "
            f"whatever its memory, from every start. {more} Limits of the control and what happens between the samples "
            "are not covered.")
    if not loop.stable:
        text = f"The loop with {k / 2:g}, the middle of the sector, in the place of the element is unstable."
    else:
        norm, at = plant_norm(loop)
        text = f"The circle criterion fails: k/2 times the norm is {k / 2 * norm:.4g} at {at:.3g} rad/s, not below 1."
    if largest == 0.0:
        advice = "The loop must be stable without the element too: change the linear controller."
    else:
        advice = f"Gains below about {largest:.4g} pass; what limits them is at {where:.3g} rad/s."
    return SynthesisCode.NOT_CERTIFIED.outcome(
        f"{text} Nothing is proven of this loop, which may be stable all the same.", remedy=advice)
