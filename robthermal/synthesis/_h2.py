"""H2 synthesis: two Riccati equations, and the proof of the norm that the controller returned reaches."""

from __future__ import annotations

import time
from contextlib import nullcontext
from dataclasses import replace

import numpy as np
from scipy.linalg import solve_discrete_are

from .._arrays import Array
from .._control import control
from ..errors import InputError, Outcome
from ..linear import Plant, close, h2_norm, prove_closed_loop
from ..verification import Certificate
from ._arguments import sampled, state_space
from ._arithmetic import Arithmetic, Balls, Floats, floats
from ._design import Design, RobustAgainst, named, zero_controller
from ._outcomes import SynthesisCode
from ._plant import GeneralizedPlant, balanced, read_generalized, with_direct_path
from ._regularize import lacks_control_weight, lacks_noise, missing_weights, with_channels

_SLACKS = (1e-5, 1e-4, 1e-3, 1e-2)  # of the bound above the norm in floats, in turn
_CHANNELS = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
_ENOUGH = 1e-3  # relative gain below which smaller channels are not tried
Reached = tuple[float, Plant, Certificate, str, float]  # value, controller, proof, precision, channels
_DIRECT = 1e-12  # relative: a direct path below it is rounding


def h2(P: control.StateSpace, n_meas: int, n_ctrl: int, *, sample_time: float | None = None) -> Design:
    """Design the controller with the smallest H2 norm from w to z, and prove what it reaches.

    With white noise of unit intensity as w, the norm is the root mean square of z. Conventions are those of `hinf`. In
    continuous time the direct path D11 must be zero, or a direct gain of the controller must cancel it; in discrete
    time it counts.

    Parameters
    ----------
    P : control.StateSpace
        Generalized plant, continuous or sampled.
    n_meas, n_ctrl : int
        Numbers of measurements y and of controls u.
    sample_time : float, optional
        Sample time of a controller for a continuous plant, all of whose inputs are taken as held between samples [s].

    Returns
    -------
    Design
        ``value`` is proven for the controller returned; ``lower`` is the optimum in floats.

    Raises
    ------
    InputError
        As `hinf`; and a direct path from w to z that no controller cancels.

    References
    ----------
    Zhou, Doyle and Glover, Robust and Optimal Control (1996), theorem 14.7; Chen and Francis, Optimal Sampled-Data
    Control Systems (1995), section 6.3.

    Examples
    --------
    >>> import control, robthermal as rt
    >>> P = control.ss([[1.0]], [[1, 0, 1]], [[1], [0], [1]], [[0, 0, 0], [0, 0, 1], [0, 1, 0]])  # x' = x + w1 + u
    >>> d = rt.design.h2(P, 1, 1)  # X = Y = 1 + √2: norm² = X + Y X²
    >>> d.holds, round(d.value, 2), rt.verify(d.certificates[0]).valid
    (True, 4.06, True)
    """
    start = time.perf_counter()
    plant = sampled(read_generalized(P, n_meas, n_ctrl), sample_time)
    direct = direct_gain(plant)
    best, lower, count = best_of(plant, direct)
    if best is None:
        controller, loop = named(state_space(P), plant, zero_controller(plant))
        return Design(controller, np.inf, lower, loop, [], _nothing_proven(), _not_proven(direct),
                      "Riccati equations (H2)", "none", time.perf_counter() - start, count, plant)
    value, K, certificate, precision, size = best
    controller, loop = named(state_space(P), plant, K)
    method = "Riccati equations (H2)" + (f", channels of size {size:g} added" if size else "")
    said = f"Certified for the numbers of the controller as returned: H2 norm below {value:.7g}."
    said += missing_weights(plant) if size else ""
    return Design(controller, value, lower, loop, [certificate], RobustAgainst("Proven for the plant as given, alone."),
                  SynthesisCode.CERTIFIED.outcome(said), method, precision, time.perf_counter() - start, count, plant)


def direct_gain(plant: GeneralizedPlant) -> Array:
    """Direct gain of an H2 controller that its equations do not give: what cancels D11 in continuous time."""
    return np.zeros((plant.B2.shape[1], len(plant.C2))) if plant.dt else cancelling(plant)


def best_of(plant: GeneralizedPlant, direct: Array) -> tuple[Reached | None, float, int]:
    """The controller with the smallest proven norm, the smallest norm in floats, and how many channels were tried."""
    control_weight, noise = lacks(plant)
    best: Reached | None = None
    lower, count = np.inf, 0
    for size in _CHANNELS if control_weight or noise else (0.0,):
        extended = with_channels(balanced(plant), size, control_weight, noise) if size else plant
        found = _reach(plant, extended, direct)
        count += 1
        if found is None:
            continue
        value, K, certificate, precision = found
        gained = best is None or value < best[0] * (1 - _ENOUGH)
        lower = min(lower, h2_norm(close(plant.joined, K)))
        if best is None or value < best[0]:
            best = value, K, certificate, precision, size
        if not gained:
            break
    return best, lower, count


def _not_proven(direct: Array) -> Outcome:
    if direct.any():
        return SynthesisCode.NOT_CERTIFIED.outcome(
            "The direct path D11 + D12 D_K D21 is cancelled to rounding, not to the last digit, so that the H2 norm of "
            "the exact numbers is infinite.", remedy="Filter the disturbance with a lag, or use sample_time.")
    return SynthesisCode.NOT_FOUND.outcome()


def _nothing_proven() -> RobustAgainst:
    return RobustAgainst("Nothing is proven, of this plant or of others.")


def lacks(plant: GeneralizedPlant) -> tuple[bool, bool]:
    """Whether weights on controls, or noise on measurements, are missing; sampled: whether an equation fails."""
    if not plant.dt:
        return lacks_control_weight(plant), lacks_noise(plant)
    return (_sampled_equation(plant.A, plant.B2, plant.C1, plant.D12) is None,
            _sampled_equation(plant.A.T, plant.C2.T, plant.B1.T, plant.D21.T) is None)


def cancelling(plant: GeneralizedPlant) -> Array:
    """Direct gain G with D11 + D12 G D21 = 0, least squares; refused where none cancels (continuous time)."""
    G: Array = -np.linalg.pinv(plant.D12) @ plant.D11 @ np.linalg.pinv(plant.D21)
    left = plant.D11 + plant.D12 @ G @ plant.D21
    if np.linalg.norm(left) > _DIRECT * max(float(np.linalg.norm(plant.D11)), 1.0):
        i, j = np.unravel_index(abs(left).argmax(), left.shape)
        raise InputError(f"a direct path from disturbance {j} to performance output {i} that no controller cancels: "
                         "the H2 norm is infinite", where="argument P", expected="D11 = 0, or in reach of D12 and D21",
                         remedy="Filter the disturbance or the output with a lag.")
    return G if np.any(plant.D11) else np.zeros_like(G)


def _reach(plant: GeneralizedPlant, work: GeneralizedPlant, direct: Array
           ) -> tuple[float, Plant, Certificate, str] | None:
    """Proven norm, controller, certificate and precision of the first arithmetic whose loop is proven."""
    for arithmetic in (Floats(), Balls(192), Balls(448)):
        with arithmetic.working() if isinstance(arithmetic, Balls) else nullcontext():
            K = _sampled(work) if work.dt else _continuous(work, direct, arithmetic)
        if K is None:
            continue
        K = with_direct_path(K, plant.D22)
        loop = close(plant.joined, K)
        norm = h2_norm(Plant(loop.A, loop.B, loop.C, loop.D if plant.dt else 0 * loop.D, loop.dt))
        if not np.isfinite(norm):
            continue
        certificate = _certified(plant, K, max(norm, 1e-12))
        if certificate is not None:
            name = f"{arithmetic.bits} bit" if isinstance(arithmetic, Balls) else "floats"
            return float(certificate.region["bound"]), K, certificate, name
    return None


def _certified(plant: GeneralizedPlant, K: Plant, norm: float) -> Certificate | None:
    for slack in _SLACKS:
        certificate = prove_closed_loop(plant.joined, K, measure="h2", bound=norm * (1 + slack))
        if certificate.holds:
            return certificate
    return None


def _continuous(plant: GeneralizedPlant, direct: Array, arithmetic: Arithmetic) -> Plant | None:
    """u = F x̂ + G (y - C2 x̂): the H2 controller of the plant with G in its loop, then G added."""
    own = balanced(replace(plant, A=plant.A + plant.B2 @ direct @ plant.C2, B1=plant.B1 + plant.B2 @ direct @ plant.D21,
                           C1=plant.C1 + plant.D12 @ direct @ plant.C2))
    A, B1, B2, C1, C2, D12, D21 = (arithmetic.array(part) for part in (own.A, own.B1, own.B2, own.C1, own.C2, own.D12,
                                                                      own.D21))
    F = _gain(A, B2, C1, D12, arithmetic)
    L = _gain(A.T, C2.T, B1.T, D21.T, arithmetic)
    if F is None or L is None:
        return None
    F, L = floats(F), floats(L.T)
    return Plant(own.A + own.B2 @ F + L @ own.C2, -L, F, direct, 0.0)


def _gain(A: Array, B: Array, C: Array, D: Array, arithmetic: Arithmetic) -> Array | None:
    """F = -R⁻¹ (B'X + D'C) with X of A'X + XA - (XB + C'D) R⁻¹ (B'X + D'C) + C'C = 0."""
    try:
        R = arithmetic.inv(D.T @ D)
    except np.linalg.LinAlgError:
        return None
    own = A - B @ R @ D.T @ C
    H = np.block([[own, -B @ R @ B.T], [-(C.T @ C - C.T @ D @ R @ D.T @ C), -own.T]])
    X = arithmetic.riccati(H)
    return None if X is None else -R @ (B.T @ X + D.T @ C)


def _sampled_equation(A: Array, B: Array, C: Array, D: Array) -> Array | None:
    """Stabilizing solution of the discrete Riccati equation, None where there is none in floats."""
    try:
        X: Array = solve_discrete_are(A, B, C.T @ C, D.T @ D, s=C.T @ D)
    except (np.linalg.LinAlgError, ValueError):
        return None
    return X if np.isfinite(X).all() else None


def _sampled(plant: GeneralizedPlant) -> Plant | None:
    """Controller with a direct gain: the newest measurement is used (Chen and Francis, section 6.3)."""
    own = balanced(plant)
    A, B1, B2, C1, C2, D11, D12, D21 = (own.A, own.B1, own.B2, own.C1, own.C2, own.D11, own.D12, own.D21)
    X, Y = _sampled_equation(A, B2, C1, D12), _sampled_equation(A.T, C2.T, B1.T, D21.T)
    if X is None or Y is None:
        return None
    R, S = D12.T @ D12 + B2.T @ X @ B2, D21 @ D21.T + C2 @ Y @ C2.T
    try:
        F = -np.linalg.solve(R, D12.T @ C1 + B2.T @ X @ A)
        L = -np.linalg.solve(S, D21 @ B1.T + C2 @ Y @ A.T).T
        # direct gain: the best estimate of F x and of what w adds, from the innovation of this sample
        F0 = -np.linalg.solve(R, D12.T @ D11 + B2.T @ X @ B1)
        L0 = np.linalg.solve(S, (F @ Y @ C2.T + F0 @ D21.T).T).T
    except np.linalg.LinAlgError:
        return None
    return Plant(A + B2 @ F + L @ C2 - B2 @ L0 @ C2, -(L - B2 @ L0), F - L0 @ C2, L0, own.dt)
