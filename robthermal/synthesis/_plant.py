"""The generalized plant: its parts, its state coordinates, and what no controller could ever do with it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .._arrays import Array
from .._checks import quoted
from ..errors import InputError
from ..linear import Plant, read_plant

_HIDDEN = 1e-10  # relative distance to a mode that no control reaches, or no measurement sees
_SWEEPS = 20


@dataclass(frozen=True)
class GeneralizedPlant:
    """P from (w, u) to (z, y): x' = A x + B1 w + B2 u (or x+), z = C1 x + D11 w + D12 u, y = C2 x + D21 w + D22 u."""

    A: Array
    B1: Array
    B2: Array
    C1: Array
    C2: Array
    D11: Array
    D12: Array
    D21: Array
    D22: Array
    dt: float

    @property
    def joined(self) -> Plant:
        """All of it as one system."""
        return Plant(self.A, np.hstack([self.B1, self.B2]), np.vstack([self.C1, self.C2]),
                     np.block([[self.D11, self.D12], [self.D21, self.D22]]), self.dt)


def split(plant: Plant, n_meas: int, n_ctrl: int) -> GeneralizedPlant:
    """Parts of a system whose last inputs are controls and last outputs measurements."""
    p, m = plant.D.shape[0] - n_meas, plant.D.shape[1] - n_ctrl
    D = plant.D
    return GeneralizedPlant(plant.A, plant.B[:, :m], plant.B[:, m:], plant.C[:p], plant.C[p:], D[:p, :m], D[:p, m:],
                            D[p:, :m], D[p:, m:], plant.dt)


def read_generalized(system: Any, n_meas: int, n_ctrl: int, where: str = "argument P") -> GeneralizedPlant:
    """Check a generalized plant, and that some controller stabilizes it."""
    plant = read_plant(system, where)
    for name, value, count, what in (("n_meas", n_meas, plant.D.shape[0], "outputs"),
                                     ("n_ctrl", n_ctrl, plant.D.shape[1], "inputs")):
        if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
            raise InputError(f"{name} = {quoted(value)}", where=f"argument {name}", expected="a whole number")
        if not 1 <= value < count:
            raise InputError(f"{name} = {value}: the plant has {count} {what}", where=f"argument {name}",
                             expected=f"from 1 to {count - 1}, so that one is left for the performance",
                             remedy=f"The last {name} {what} of P belong to the controller.")
    found = split(plant, int(n_meas), int(n_ctrl))
    check_modes(found, where)
    return found


def check_modes(plant: GeneralizedPlant, where: str = "argument P") -> None:
    """Refuse a plant with an unstable mode that the controls do not reach or the measurements do not see."""
    own = balanced(plant)
    weight = "Of a weight: take a stable one, 1/(s + 0.001) for 1/s."
    for A, B, word, part in ((own.A, own.B2, "not stabilisable", "control"),
                             (own.A.T, own.C2.T, "not detectable", "sensor")):
        mode = hidden_mode(A, B, plant.dt)
        if mode is not None:
            cause = "no control reaches it" if word == "not stabilisable" else "no measurement sees it"
            raise InputError(f"{word}: the mode at {say_mode(mode, plant.dt)}; {cause}", where=where,
                             expected="every unstable mode within reach of the controls and seen by the measurements",
                             remedy=f"Add or move a {part}, or leave the mode out. {weight}")


def hidden_mode(A: Array, B: Array, dt: float) -> complex | None:
    """An eigenvalue on or beyond the boundary of stability at which [A - λ, B] loses rank; None where there is none."""
    n = len(A)
    if n == 0:
        return None
    values, size = np.linalg.eigvals(A), float(np.linalg.norm(np.hstack([A, B]), 2))
    sizes: Array = abs(values)
    edge = 1e-9 * (1.0 if dt else float(sizes.max()))
    for value in values[(abs(values) >= 1 - edge) if dt else (values.real >= -edge)]:
        gap = np.linalg.svd(np.hstack([A - value * np.eye(n), B]), compute_uv=False)[n - 1]
        if gap <= _HIDDEN * size:  # equal: no dynamics and no control
            return complex(value)
    return None


def say_mode(value: complex, dt: float) -> str:
    """A mode in words: its frequency, or its rate where it does not oscillate."""
    if dt:
        return f"z = {value.real:.4g}{value.imag:+.4g}j" if abs(value.imag) > 1e-9 else f"z = {value.real:.4g}"
    if abs(value.imag) <= 1e-9 * abs(value):
        return f"{value.real:+.4g} 1/s" if abs(value) > 1e-12 else "0 rad/s (an integrator)"
    return f"{abs(value.imag):.4g} rad/s (real part {value.real:+.3g} 1/s)"


def balanced(plant: GeneralizedPlant) -> GeneralizedPlant:
    """The same plant with state coordinates scaled by powers of two, rows and columns alike in size."""
    n = len(plant.A)
    scale = np.ones(n)
    A, B, C = abs(plant.A - np.diag(np.diag(plant.A))), plant.joined.B, plant.joined.C
    rows, columns = np.linalg.norm(B, axis=1), np.linalg.norm(C, axis=0)
    for _ in range(_SWEEPS):
        before = scale.copy()
        for i in range(n):
            into = np.hypot(np.linalg.norm(A[i] / scale), 0) * scale[i]  # x_i' from others, in new coordinates
            out = np.linalg.norm(A[:, i] * scale) / scale[i]
            into, out = np.hypot(into, rows[i] * scale[i]), np.hypot(out, columns[i] / scale[i])
            if into > 0 and out > 0:
                scale[i] *= 2.0 ** np.round(np.log2(out / into) / 2)
        if np.array_equal(before, scale):
            break
    return replace(plant, A=plant.A * scale[:, None] / scale, B1=plant.B1 * scale[:, None],
                   B2=plant.B2 * scale[:, None], C1=plant.C1 / scale, C2=plant.C2 / scale)


def to_continuous(plant: GeneralizedPlant) -> tuple[GeneralizedPlant, float]:
    """Continuous plant with the same values at s = side (z - side')..., and the side: z = side (1 + s)/(1 - s).

    The H-infinity norm is the same. Side -1 is taken where an eigenvalue lies at z = -1.
    """
    n, joined = len(plant.A), plant.joined
    values = np.linalg.eigvals(plant.A) if n else np.zeros(0)
    side = 1.0 if n == 0 or abs(values + 1).min() > 1e-6 or abs(values + 1).min() > abs(values - 1).min() else -1.0
    A, B = side * joined.A, side * joined.B  # in z/side
    inverse = np.linalg.inv(A + np.eye(n))
    root = np.sqrt(2.0)
    moved = Plant(inverse @ (A - np.eye(n)), root * inverse @ B, root * joined.C @ inverse,
                  joined.D - joined.C @ inverse @ B, 0.0)
    return split(moved, len(plant.C2), plant.B2.shape[1]), side


def to_sampled(controller: Plant, side: float, dt: float) -> Plant:
    """Sampled controller of a continuous one, the inverse of `to_continuous`; LinAlgError where z = ∞ is a pole."""
    n = len(controller.A)
    inverse = np.linalg.inv(np.eye(n) - controller.A)
    root = np.sqrt(2.0)
    A, B = (np.eye(n) + controller.A) @ inverse, root * inverse @ controller.B
    return Plant(side * A, side * B, root * controller.C @ inverse,
                 controller.D + controller.C @ inverse @ controller.B, dt)


def with_direct_path(K: Plant, D22: Array) -> Plant:
    """K (1 + D22 K)⁻¹: what u = K (y - D22 u) is from y to u."""
    if not np.any(D22):
        return K
    E = np.linalg.inv(np.eye(len(D22)) + D22 @ K.D)
    return Plant(K.A - K.B @ E @ D22 @ K.C, K.B @ E, K.C - K.D @ E @ D22 @ K.C, K.D @ E, K.dt)


def chosen(plant: GeneralizedPlant, outputs: Sequence[int], inputs: Sequence[int]) -> GeneralizedPlant:
    """The plant with some of its performance outputs and disturbances."""
    z, w = list(outputs), list(inputs)
    return replace(plant, B1=plant.B1[:, w], C1=plant.C1[z], D11=plant.D11[np.ix_(z, w)], D12=plant.D12[z],
                   D21=plant.D21[:, w])
