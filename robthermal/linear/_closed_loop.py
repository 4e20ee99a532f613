"""What a controller reaches with a generalized plant: candidates in floats for a proof about the numbers of both."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from .._arrays import Array
from ..errors import InputError
from ..verification import Certificate, establish
from ._hinf import SHIFTS, bounded_real_matrix
from ._levels import plant_norm
from ._peak import ellipsoids
from ._stability import coordinates, lyapunov_matrix, solve
from ._systems import Plant, made_by, read_plant

_MEASURES = ("hinf", "h2", "peak", "stability", "region")
_SLACK = 1e-3  # of a bound that is found here, relative
_FLOORS = (1e-10, 1e-7, 1e-4)  # added to C'C of the H2 norm, relative, in turn


def closed_loop(plant: Any, controller: Any, *, measure: str = "hinf", bound: float | None = None, rate: float = 0.0,
                poles: Mapping[str, float] | None = None,
                channels: tuple[Sequence[int], Sequence[int]] | None = None) -> Certificate:
    """Certify what a controller reaches: the checker forms the loop from the numbers of plant and controller.

    Parameters
    ----------
    plant : control.StateSpace
        Generalized plant from (w, u) to (z, y), controls last among its inputs, measurements last among its outputs.
    controller : control.StateSpace or control.TransferFunction
        K from y to u, with u = +K y, of the same sample time.
    measure : {"hinf", "h2", "peak", "stability", "region"}
        What is proven of the loop from w to z; all of them include stability.
    bound : float, optional
        Number the norm is to stay below [output unit per input unit]; by default 0.1 % above the norm found in floats.
    rate : float
        Decay to spare, for measure "stability": real parts below -rate [1/s], sampled absolute values below 1 - rate.
    poles : mapping, optional
        For measure "region": "decay" [1/s], "damping" [-], "radius" [1/s; sampled -].
    channels : tuple of (outputs, inputs), optional
        Which performance outputs and disturbances a norm is about, counted from 0; by default all.

    Returns
    -------
    Certificate
        Kind "closed_loop"; ``holds`` False, with the reason, where it is not proven.

    Raises
    ------
    InputError
        Other types or sizes, sample times that differ, a loop that is not well-posed, an unknown measure.

    Examples
    --------
    >>> import control, robthermal as rt
    >>> P = control.ss([[0.5]], [[1.0, 1.0]], [[1.0], [1.0]], 0)  # unstable, disturbed at its input
    >>> cert = rt.certify.closed_loop(P, control.ss([], [], [], [[-2.5]]), bound=0.501)  # 1/(s + 2)
    >>> cert.holds, rt.certify.closed_loop(P, control.ss([], [], [], [[-2.5]]), bound=0.5).holds
    (True, False)
    """
    return prove_closed_loop(read_plant(plant, "argument plant"), read_plant(controller, "argument controller"),
                             measure=measure, bound=bound, rate=rate, poles=poles, channels=channels)


def prove_closed_loop(P: Plant, K: Plant, *, measure: str = "hinf", bound: float | None = None, rate: float = 0.0,
                      poles: Mapping[str, float] | None = None,
                      channels: tuple[Sequence[int], Sequence[int]] | None = None,
                      norm: float | None = None) -> Certificate:
    """The same as `closed_loop`, of arrays.

    Parameters
    ----------
    P : Plant
        Generalized plant, controls and measurements last.
    K : Plant
        Controller, from measurements to controls.
    measure, bound, rate, poles, channels
        What is proven, as in `closed_loop`.
    norm : float, optional
        H-infinity norm of the loop in floats, where it is known already.
    """
    if measure not in _MEASURES:
        raise InputError(f"measure = {measure!r}", where="argument measure", expected=f"one of {list(_MEASURES)}")
    loop = close(P, K)
    region: dict[str, Any] = {"measure": measure}
    if channels is not None:
        region["channels"] = {"outputs": list(channels[0]), "inputs": list(channels[1])}
        loop = _chosen(loop, *channels)
    if measure == "stability":
        region["rate"] = float(rate)
    elif measure == "region":
        region |= {key: float(value) for key, value in (poles or {}).items()}
    else:
        region["bound"] = float(bound) if bound is not None else _estimate(loop, measure) * (1 + _SLACK)
    system = {"plant": _matrices(P), "controller": _matrices(K), "n_meas": len(K.B.T), "n_ctrl": len(K.C),
              "sample_time": P.dt}
    candidates = _evidence(loop, region, norm)
    cert = _try(system, region, next(candidates))
    for candidate in candidates:
        if cert.holds:
            break
        cert = _try(system, region, candidate)
    return cert


def _try(system: Mapping[str, Any], region: Mapping[str, Any], candidate: tuple[dict[str, Any], str]) -> Certificate:
    return establish("closed_loop", system=system, region=region, evidence=candidate[0], margin={},
                     made_by=made_by(candidate[1], "candidate in floats"))


def close(plant: Plant, controller: Plant) -> Plant:
    """Loop from w to z in floats, states of the plant first; u = +K y.

    Parameters
    ----------
    plant : Plant
        Generalized plant, controls and measurements last.
    controller : Plant
        K, whose size says how many controls and measurements there are.

    Returns
    -------
    Plant

    Raises
    ------
    InputError
        If sizes or sample times do not fit, or det(1 - D_K D22) is zero.
    """
    n_ctrl, n_meas = controller.D.shape
    if plant.dt != controller.dt:
        raise InputError(f"the plant is sampled at {plant.dt:g} s, the controller at {controller.dt:g} s (0: "
                         "continuous)", where="argument controller", expected="the same sample time")
    p, m = plant.D.shape
    if n_ctrl > m or n_meas > p:
        raise InputError(f"a controller with {n_meas} inputs and {n_ctrl} outputs", where="argument controller",
                         expected=f"at most the {p} outputs and {m} inputs of the plant")
    q, r = p - n_meas, m - n_ctrl
    B1, B2, C1, C2 = plant.B[:, :r], plant.B[:, r:], plant.C[:q], plant.C[q:]
    D11, D12, D21, D22 = plant.D[:q, :r], plant.D[:q, r:], plant.D[q:, :r], plant.D[q:, r:]
    open_loop = np.eye(n_ctrl) - controller.D @ D22
    if abs(np.linalg.det(open_loop)) < 1e-12:
        raise InputError("the loop is not well-posed: det(1 - D_K D22) is zero", where="argument controller",
                         expected="a controller whose direct gain does not cancel that of the plant")
    E = np.linalg.inv(open_loop)
    ux, uk, uw = E @ controller.D @ C2, E @ controller.C, E @ controller.D @ D21
    A = np.block([[plant.A + B2 @ ux, B2 @ uk],
                  [controller.B @ (C2 + D22 @ ux), controller.A + controller.B @ D22 @ uk]])
    B = np.vstack([B1 + B2 @ uw, controller.B @ (D21 + D22 @ uw)])
    return Plant(A, B, np.hstack([C1 + D12 @ ux, D12 @ uk]), D11 + D12 @ uw, plant.dt)


def h2_norm(loop: Plant) -> float:
    """H2 norm in floats, infinity where the loop is not stable or has a direct path in continuous time."""
    if not loop.stable or (not loop.dt and np.any(loop.D)):
        return float("inf")
    P = solve(loop.A.T, loop.C.T @ loop.C, bool(loop.dt)) if len(loop.A) else np.zeros((0, 0))
    if P is None:
        return float("inf")
    return float(np.sqrt(max(np.trace(loop.B.T @ P @ loop.B) + np.sum(loop.D**2), 0.0)))


def _chosen(loop: Plant, outputs: Sequence[int], inputs: Sequence[int]) -> Plant:
    p, m = loop.D.shape
    for name, items, count in (("outputs", outputs, p), ("inputs", inputs, m)):
        if not len(items) or not all(isinstance(k, (int, np.integer)) and 0 <= k < count for k in items):
            raise InputError(f"{name} {list(items)!r}", where="argument channels",
                             expected=f"whole numbers from 0 to {count - 1}")
    return Plant(loop.A, loop.B[:, list(inputs)], loop.C[list(outputs)], loop.D[np.ix_(outputs, inputs)], loop.dt)


def _estimate(loop: Plant, measure: str) -> float:
    """Number a bound is built on; 1 where there is none to be found."""
    if not loop.stable:
        return 1.0
    if measure == "peak":
        return float(min((bound for _, bound, _ in ellipsoids(loop)), default=1.0))
    found = plant_norm(loop)[0] if measure == "hinf" else h2_norm(loop)
    return found if 0 < found < np.inf else 1.0


def _evidence(loop: Plant, region: Mapping[str, Any], norm: float | None) -> Iterator[tuple[dict[str, Any], str]]:
    """Candidates in turn, each with how it was found; at least one."""
    measure = region["measure"]
    if measure == "stability":
        matrix = lyapunov_matrix(loop, region["rate"])
        if matrix is not None:
            yield {"method": "lyapunov", "matrix": matrix}, "scipy Lyapunov equation"
        yield {"method": "polynomial"}, "none"
    elif measure == "hinf":
        yield from _bounded_real(loop, region["bound"], norm)
        yield {"method": "polynomial"}, "none"
    elif measure == "h2":
        for floor in _FLOORS:
            yield {"method": "lyapunov", "matrix": _observed(loop, floor)}, "scipy Lyapunov equation"
    elif measure == "peak":
        if not loop.stable:
            yield {"method": "ellipsoid", "matrix": np.eye(len(loop.A)), "decay": 0.5, "share": 0.5}, "none"
        else:
            for found, _, how in ellipsoids(loop):
                yield found, how
    else:
        yield {"method": "lyapunov", "matrix": _modal(loop.A)}, "eigenvectors"


def _bounded_real(loop: Plant, bound: float, norm: float | None) -> Iterator[tuple[dict[str, Any], str]]:
    if not loop.stable or not len(loop.A):
        return
    norm = plant_norm(loop)[0] if norm is None else norm
    if norm >= bound:
        return
    for shift in SHIFTS:
        matrix = bounded_real_matrix(loop, norm + 0.7 * (bound - norm), bound**2 * shift)
        if matrix is not None:
            yield {"method": "bounded_real", "matrix": matrix}, "scipy Riccati equation"


def _observed(loop: Plant, floor: float) -> Array:
    """Gramian of C, raised a little in coordinates whose states are excited alike, so that it is strict."""
    n = len(loop.A)
    T = coordinates(loop.A, loop.B @ loop.B.T, bool(loop.dt)) if n and loop.stable else None
    if T is None:
        return np.eye(n)
    A, C = np.linalg.solve(T, loop.A @ T), loop.C @ T
    size = max(float(np.trace(C.T @ C)) / n, 1e-300)
    P = solve(A.T, C.T @ C + floor * size * np.eye(n), bool(loop.dt))
    if P is None:
        return np.eye(n)
    inverse = np.linalg.inv(T)
    P = inverse.T @ P @ inverse
    return (P + P.T) / 2


def _modal(A: Array) -> Array:
    """P in which every mode is of size one and unrelated to the others: right for every region of eigenvalues."""
    vectors = np.linalg.eig(A)[1]
    P = np.linalg.pinv(vectors @ vectors.conj().T).real
    return (P + P.T) / 2


def _matrices(plant: Plant) -> dict[str, Array]:
    return {"A": plant.A, "B": plant.B, "C": plant.C, "D": plant.D}
