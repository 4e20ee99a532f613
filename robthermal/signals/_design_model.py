"""What the design check knows of the machine: its poles, and with a state space its response."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import scipy
from numpy.typing import NDArray

from ..errors import InputError
from ._checks import Array
from ._excitation_settings import exactly_one

Complex = NDArray[np.complex128]

_EXPECTED = "continuous-time poles [rad/s] with negative real part"
_ENTRIES = 2**21  # of resolvent matrices held at a time
_ALIKE = 0.01  # poles closer than this, relative to their size, are one


class Truth(Protocol):
    """Something whose response and noise-free output, from rest and with the inputs off before, are known."""

    def response(self, z: Complex) -> Complex:
        """G at the points z (L,) of the unit circle, (n_y, n_u, L)."""

    def outputs(self, z: Complex, U: Complex, u: Array) -> Complex:
        """Output lines (experiments, n_y, L) for the input lines U (experiments, n_u, L) of u (experiments, n, n_u)."""


@dataclass(frozen=True)
class Machine:
    """x(n+1) = A x(n) + B u(n), y = C x + D u at the sample time of the experiment."""

    A: Array
    B: Array
    C: Array
    D: Array

    def _states(self, z: Complex, right: Array) -> Complex:
        """(z I - A)^-1 right, (L, n, columns)."""
        parts = np.array_split(z, max(1, z.size * self.A.size // _ENTRIES))
        resolvents = (one[:, None, None] * np.eye(len(self.A)) - self.A for one in parts)
        return np.concatenate([np.linalg.solve(one, right[None]) for one in resolvents])

    def response(self, z: Complex) -> Complex:
        """As in `Truth`."""
        found = self.C @ self._states(z, self.B) + self.D
        return np.asarray(np.moveaxis(found, 0, -1))

    def last_states(self, u: Array) -> Array:
        """x(N) of every experiment, from zero, (experiments, n)."""
        x = np.zeros((len(u), len(self.A)))
        for held in u.transpose(1, 0, 2) @ self.B.T:
            x = x @ self.A.T + held
        return x

    def outputs(self, z: Complex, U: Complex, u: Array) -> Complex:
        """As in `Truth`."""
        decay = self._states(z, self.last_states(u).T)  # (L, n, experiments)
        transient = np.einsum("yn,lne->eyl", self.C, decay) * z / np.sqrt(u.shape[1])
        return np.asarray(np.einsum("yil,eil->eyl", self.response(z), U) - transient)


@dataclass(frozen=True)
class Modes:
    """One output for every pole: x(n+1) = gamma x(n) + sum_i gain_i u_i(n), gamma = exp(p T_s)."""

    poles: Complex  # p T_s
    gain: Array

    def _quotients(self, z: Complex) -> Complex:
        # z - gamma = gamma expm1(j theta - p T_s): no cancellation for slow poles at low bins
        return np.asarray(np.exp(-self.poles)[:, None] / np.expm1(1j * np.angle(z) - self.poles[:, None]))

    def response(self, z: Complex) -> Complex:
        """As in `Truth`."""
        return np.asarray(self._quotients(z)[:, None] * self.gain[:, None])

    def outputs(self, z: Complex, U: Complex, u: Array) -> Complex:
        """As in `Truth`."""
        ages = np.arange(u.shape[1] - 1, -1, -1)
        heat = u @ self.gain  # (experiments, n)
        last = np.stack([heat @ np.exp(pole * ages) for pole in self.poles], axis=1)
        driven = np.einsum("i,eil->el", self.gain, U)[:, None] - last[..., None] * z / np.sqrt(u.shape[1])
        return np.asarray(driven * self._quotients(z))


def machine_of(model: Any, h: float, n_u: int) -> Machine | None:
    """The state space of a python-control model, sampled with zero-order hold; None for a model without matrices."""
    if not all(hasattr(model, name) for name in "ABCD"):
        return None
    A, B, C, D = (np.asarray(getattr(model, name), dtype=float) for name in "ABCD")
    if B.shape[1] != n_u:
        raise InputError(
            f"the model has {B.shape[1]} inputs, u has {n_u}",
            where="argument model",
            expected="one column of u for every input of the model",
            remedy="Select the excited inputs, for example model[:, [0, 1]].",
        )
    if _step(model, h) == 0.0:
        block = np.zeros((len(A) + n_u,) * 2)
        block[: len(A)] = np.hstack([A, B]) * h
        exact = scipy.linalg.expm(block)[: len(A)]
        A, B = exact[:, : len(A)], exact[:, len(A) :]
    return Machine(A, B, C, D)


def _step(model: Any, h: float) -> float:
    """Sample time of a model [s], 0 for continuous time."""
    dt = getattr(model, "dt", None)
    step = 0.0 if dt is None else h if dt is True else float(dt)
    if step and abs(step - h) > 1e-9 * h:
        raise InputError(
            f"the model is sampled every {step:g} s, the experiment every {h:g} s",
            where="argument model",
            expected="a continuous-time model, or one with the sample time of the experiment",
        )
    return step


def slow_poles(model: Any, poles: Any, h: float) -> Complex:
    """Stable continuous-time poles [rad/s] that are slower than the samples, slowest first, no two alike."""
    exactly_one("model", model, "poles", poles)
    if model is None:
        found = _numbers(poles)
    elif not callable(getattr(model, "poles", None)):
        raise InputError(
            f"got {type(model).__name__}",
            where="argument model",
            expected="a python-control model or an rt.System: an object with a method poles()",
            remedy="Pass time constants tau as poles=[-1/tau].",
        )
    else:
        found = np.atleast_1d(np.asarray(model.poles(), dtype=complex))
        if step := _step(model, h):
            found = np.asarray(
                np.log(found[np.abs(found) > 1e-12]) / step
            )  # poles at z = 0 are delays: infinitely fast
    for pole in found:
        if not np.isfinite(pole) or pole.real >= 0.0:
            raise InputError(
                f"the pole {pole:g} rad/s is not finite and stable",
                where=f"argument {'poles' if model is None else 'model'}",
                expected=_EXPECTED,
                remedy="Time constants tau enter as -1/tau.",
            )
    return _kept(found, h)


def _numbers(poles: Any) -> Complex:
    try:
        found = np.atleast_1d(np.asarray(poles))
    except ValueError as error:
        raise InputError("poles is a ragged nest of lists", where="argument poles", expected=_EXPECTED) from error
    if found.dtype.kind not in "iufc" or found.ndim != 1 or not found.size:
        raise InputError(f"poles is {poles!r}", where="argument poles", expected=_EXPECTED)
    return found.astype(complex)


def _kept(found: Complex, h: float) -> Complex:
    if not found.size:
        raise InputError("the model has no poles", where="argument model", expected="a machine with time constants")
    found = np.asarray(found[np.argsort(np.abs(found), kind="stable")], dtype=complex)
    if abs(found[0]) * h >= np.pi:
        raise InputError(
            f"sample_time {h:g} s is too slow: the slowest time constant is {1.0 / abs(found[0]):.3g} s",
            where="argument sample_time",
            expected="some dynamics slower than the Nyquist frequency",
            remedy=f"Sample every {0.1 / abs(found[0]):.2g} s or faster.",
        )
    kept: list[complex] = []
    for pole in found[np.abs(found) * h < np.pi]:
        upper = complex(pole.real, abs(pole.imag))  # one of each conjugate pair
        if all(abs(upper - other) > _ALIKE * abs(other) for other in kept):
            kept.append(upper)
    return np.array(kept)
