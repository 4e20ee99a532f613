"""The linear systems users give: numbers, transfer functions and state spaces, checked and read."""

from __future__ import annotations

from numbers import Real
from typing import Any

import numpy as np

from ..._arrays import Array
from ..._control import control
from ...errors import InputError
from ._cascade import realize
from ._exact import from_coefficients, roots_of, transfer, truncated
from ._roots import number_of_zeros, snapped
from ._zpk import Zpk, constant, stable

LTI = Any  # control.StateSpace, control.TransferFunction or a number


def sample_time_of(systems: dict[str, LTI]) -> float:
    """The one sample time of several systems [s]; 0: continuous.

    Parameters
    ----------
    systems : dict
        Argument name: system; numbers have none.
    """
    found = {name: _dt(system, name) for name, system in systems.items() if not _is_number(system)}
    given = {name: dt for name, dt in found.items() if dt is not None}
    if not given:
        raise InputError("no argument has a sample time", where=", ".join(systems),
                         expected="python-control systems with dt = 0 (continuous) or dt > 0 [s]")
    times = set(given.values())
    if len(times) > 1:
        listed = ", ".join(f"{name} has dt = {dt:g} s" for name, dt in given.items())
        raise InputError(f"different sample times: {listed}", where=", ".join(given),
                         expected="one dt for all (0: continuous)", remedy="Discretize all systems alike.")
    return times.pop()


def zpk_of(system: LTI, where: str, dt: float) -> Zpk:
    """Zeros, poles and gain of a proper system with one input and one output.

    Parameters
    ----------
    system : LTI or float
        What the user gave.
    where : str
        Name of the argument, for messages.
    dt : float
        Sample time it must have [s].
    """
    if _is_number(system):
        return constant(_finite_number(system, where), dt)
    _expect_siso(system, where, dt)
    if isinstance(system, control.TransferFunction):
        return _from_polynomials(system, where, dt)
    return _from_matrices(system, where, dt)


def state_space_of(system: LTI, where: str, dt: float) -> control.StateSpace:
    """A proper system with one input and one output as a state space without states that do nothing.

    Parameters
    ----------
    system : LTI or float
        What the user gave.
    where : str
        Name of the argument, for messages.
    dt : float
        Sample time it must have [s].
    """
    if isinstance(system, control.StateSpace):
        _expect_siso(system, where, dt)
        A, B, C, D = _without_idle_states(system, where, dt)
        return control.StateSpace(A, B, C, D, dt, remove_useless_states=False)
    return realize(zpk_of(system, where, dt))


def expect_stable(poles: Array, where: str, dt: float, what: str = "is unstable", remedy: str = "") -> None:
    """Refuse a system with a pole that is not strictly stable.

    Parameters
    ----------
    poles : ndarray of complex
        Poles of the system.
    where : str
        Name of the argument.
    dt : float
        Sample time of the loop [s].
    what : str
        Words for the message.
    remedy : str
        Words for the message.
    """
    wrong = poles[~stable(poles, dt)]
    if len(wrong):
        place = "inside the unit circle" if dt else "in the open left half-plane"
        raise InputError(f"{what}: pole at {_text(wrong[0])}", where=where, expected=f"every pole {place}",
                         remedy=remedy)


def diagonal(system: Any, where: str) -> tuple[LTI, LTI]:
    """The two subsystems of a pair, or of a 2x2 system without coupling.

    Parameters
    ----------
    system : pair or 2x2 LTI
        What the user gave.
    where : str
        Name of the argument.
    """
    if isinstance(system, (tuple, list)):
        if len(system) != 2:
            raise InputError(f"{len(system)} systems", where=where, expected="a pair of systems, or one 2x2 system")
        return system[0], system[1]
    if not isinstance(system, (control.StateSpace, control.TransferFunction)) or (
            system.ninputs, system.noutputs) != (2, 2):
        raise InputError(f"{_name(system)} is not a 2x2 system", where=where,
                         expected="a pair of python-control systems, or one 2x2 system")
    for row, column in ((0, 1), (1, 0)):
        if not _is_zero(system, row, column):
            raise InputError(f"entry ({row + 1}, {column + 1}) is not zero", where=where,
                             expected="a diagonal system: two subsystems that do not act on each other",
                             remedy="Put the interaction into the measured plants (uncertainty).")
    if isinstance(system, control.StateSpace):
        _without_idle_states(system, where, _dt(system, where) or 0.0)  # the whole: a channel drops the other's states
    return _channel(system, 0, 0), _channel(system, 1, 1)


def connected(A: Array, B: Array, C: Array, D: Array) -> tuple[Array, Array, Array, Array]:
    """Without states that no input reaches, or that reach no output, through nonzero entries.

    Parameters
    ----------
    A, B, C, D : ndarray
        Matrices of the state space.
    """
    keep = _linked(A, B, C)
    return A[np.ix_(keep, keep)], B[keep], C[:, keep], D


def _linked(A: Array, B: Array, C: Array) -> Array:
    return _reach(A != 0, np.any(B != 0, axis=1)) & _reach(A.T != 0, np.any(C != 0, axis=0))


def _without_idle_states(system: control.StateSpace, where: str, dt: float) -> tuple[Array, Array, Array, Array]:
    """Connected part; a mode that is left out must be stable, since no controller could help it."""
    A, B, C, D = (np.asarray(M, dtype=float) for M in (system.A, system.B, system.C, system.D))
    idle = ~_linked(A, B, C)
    if np.any(idle):  # block triangular in connected and idle states, so these are eigenvalues of A
        expect_stable(np.linalg.eigvals(A[np.ix_(idle, idle)]), where, dt,
                      "a mode that the input does not reach, or the output does not see, is unstable",
                      "Remove it from the model, if it does not exist.")
    return connected(A, B, C, D)


def _reach(links: Array, start: Array) -> Array:
    reached = start.copy()
    for _ in range(len(links)):
        more = reached | np.any(links[:, reached], axis=1)
        if np.array_equal(more, reached):
            break
        reached = more
    return reached


def _channel(system: LTI, row: int, column: int) -> LTI:
    if isinstance(system, control.TransferFunction):
        return control.TransferFunction(system.num_array[row, column], system.den_array[row, column], system.dt)
    parts = connected(system.A, system.B[:, [column]], system.C[[row]], system.D[[row]][:, [column]])
    return control.StateSpace(*parts, system.dt, remove_useless_states=False)


def _is_zero(system: LTI, row: int, column: int) -> bool:
    channel = _channel(system, row, column)
    if isinstance(channel, control.TransferFunction):
        return not np.any(channel.num_array[0, 0])
    return not len(channel.A) and not np.any(channel.D)


def _from_polynomials(system: control.TransferFunction, where: str, dt: float) -> Zpk:
    num, den = (np.trim_zeros(np.atleast_1d(np.asarray(c, dtype=float)), "f")
                for c in (system.num_array[0, 0], system.den_array[0, 0]))
    if not np.all(np.isfinite(num)) or not np.all(np.isfinite(den)):
        raise InputError("NaN or infinite coefficients", where=where, expected="finite numbers")
    if len(num) == 0:
        return constant(0.0, dt)
    if len(num) > len(den):
        raise InputError(f"improper: numerator of degree {len(num) - 1}, denominator of degree {len(den) - 1}",
                         where=where, expected="a proper transfer function", remedy="Add a low-pass filter.")
    roots = [snapped(roots_of(from_coefficients(c)), dt) for c in (num, den)]
    return Zpk(roots[0], roots[1], float(num[0] / den[0]), dt).without_hidden()


def _from_matrices(system: control.StateSpace, where: str, dt: float) -> Zpk:
    A, B, C, D = _without_idle_states(system, where, dt)
    if not len(A):
        return constant(float(D[0, 0]), dt)
    degree = number_of_zeros(A, B, C, D)
    if degree is None:
        return constant(0.0, dt)
    numerator, denominator = transfer(A, B, C, D)
    numerator = truncated(numerator, degree)
    zeros, poles = (snapped(roots_of(polynomial), dt) for polynomial in (numerator, denominator))
    return Zpk(zeros, poles, float(numerator[degree]), dt).without_hidden()


def _expect_siso(system: LTI, where: str, dt: float) -> None:
    if not isinstance(system, (control.StateSpace, control.TransferFunction)):
        raise InputError(f"{_name(system)} is not a linear system", where=where,
                         expected="a python-control StateSpace or TransferFunction, or a number")
    if (system.ninputs, system.noutputs) != (1, 1):
        raise InputError(f"{system.noutputs} outputs and {system.ninputs} inputs", where=where,
                         expected="one input and one output",
                         remedy="Subsystems of several channels: evaluate_matrix and synthesize_matrix take them.")
    own = _dt(system, where)
    if own is not None and own != dt:
        raise InputError(f"sample time {own:g} s, the others have {dt:g} s", where=where,
                         expected=f"dt = {dt:g}", remedy="Discretize all systems alike.")
    if isinstance(system, control.StateSpace) and not all(
            np.all(np.isfinite(M)) for M in (system.A, system.B, system.C, system.D)):
        raise InputError("NaN or infinite entries", where=where, expected="finite matrices A, B, C, D")


def _dt(system: LTI, where: str) -> float | None:
    dt = getattr(system, "dt", None)
    if dt is True:
        raise InputError("dt = True: discrete time without a sample time", where=where,
                         expected="dt > 0 [s]", remedy="Give the sample time in seconds.")
    return None if dt is None else float(dt)


def _is_number(system: object) -> bool:
    return isinstance(system, Real) or (isinstance(system, np.ndarray) and system.ndim == 0)


def _finite_number(value: Any, where: str) -> float:
    number = float(value)
    if not np.isfinite(number):
        raise InputError(f"{number} is not finite", where=where, expected="a finite number")
    return number


def _name(value: object) -> str:
    return repr(value) if isinstance(value, (str, int, float, type(None))) else type(value).__name__


def _text(root: complex) -> str:
    return f"{root.real:.6g}" if abs(root.imag) < 1e-12 * abs(root) else f"{root.real:.6g}{root.imag:+.6g}j"
