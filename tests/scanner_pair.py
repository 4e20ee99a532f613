"""Two suspended positioning stages in plain numpy and scipy, as `robthermal` never sees them: records and models."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.signal import bilinear, lfilter, ss2tf

Array = NDArray[Any]
DT, SAMPLES = 2e-4, 2500  # s; a record of half a second


@dataclass(frozen=True)
class Stage:
    """Mass [kg] on a suspension [Hz], a flexible mode [Hz] with its share of the motion, crossover of the loop [Hz]."""

    mass: float
    suspension: float
    mode: float
    share: float
    crossover: float

    def tf(self, mass: float = 1.0, mode: float = 1.0) -> tuple[Array, Array]:
        """Falling powers of z: sampled every DT, the force is held and comes half a sample late."""
        A, B, C = np.zeros((4, 4)), np.zeros((4, 1)), np.array([[1.0, 0.0, self.share, 0.0]])
        for k, (hertz, damping) in enumerate(((self.suspension, 0.4), (mode * self.mode, 0.04))):
            w = 2 * np.pi * hertz
            A[2 * k:2 * k + 2, 2 * k:2 * k + 2] = [[0.0, 1.0], [-w * w, -2 * damping * w]]
            B[2 * k + 1] = 1 / (mass * self.mass)
        half = expm(np.block([[A, B], [np.zeros((1, 5))]]) * DT / 2)
        F, G = half[:4, :4], half[:4, 4:]
        late = np.block([[F @ F, F @ G], [np.zeros((1, 5))]])  # the last state is the force of the sample before
        num, den = ss2tf(late, np.vstack([G, [[1.0]]]), np.hstack([C, [[0.0]]]), np.zeros((1, 1)))
        return np.trim_zeros(np.where(np.abs(num[0]) < 1e-9 * np.abs(num[0]).max(), 0.0, num[0]), "f"), den

    def controller(self) -> tuple[Array, Array]:
        """PID with roll-off (bilinear), for a loop gain of one at the crossover."""
        w = 2 * np.pi * self.crossover
        num = np.polymul([3 / w, 1.0], [1.0, w / 8])
        num, den = bilinear(num, np.polymul([1 / (5 * w), 1.0], [1.0, 0.0]), 1 / DT)
        return num / abs(response((num, den), self.crossover) * response(self.tf(), self.crossover)), den


RETICLE, WAFER = Stage(12.0, 25.0, 900.0, 0.2, 110.0), Stage(22.0, 20.0, 750.0, 0.2, 90.0)


def response(system: tuple[Array, Array], hertz: Any) -> Any:
    """A transfer function at frequencies [Hz]."""
    z = np.exp(2j * np.pi * DT * np.asarray(hertz))
    return np.polyval(system[0], z) / np.polyval(system[1], z)


def true_plants() -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """The machine: heavier and with another mode than the models of `Stage.tf`."""
    return RETICLE.tf(1.04, 1.01), WAFER.tf(0.97, 0.99)


def write_records(folder: Path, sign: float = 1.0) -> None:
    """One record of white force [N] and noisy position [m] of each stage; sign -1: the wafer's sensor is turned."""
    for seed, (name, plant) in enumerate(zip(("reticle", "wafer"), true_plants(), strict=True)):
        rng = np.random.default_rng(seed)
        force = rng.uniform(-40.0, 40.0, SAMPLES)
        position = lfilter(*padded(plant), force)
        position = (sign if name == "wafer" else 1.0) * position + 2e-4 * position.std() * rng.standard_normal(SAMPLES)
        rows = [f"{k * DT:.4f},{u:.9g},{y:.9g}" for k, (u, y) in enumerate(zip(force, position, strict=True))]
        (folder / f"{name}.csv").write_text("\n".join(["time,F,y", *rows]))


def padded(system: tuple[Array, Array]) -> tuple[Array, Array]:
    """In powers of 1/z, as `scipy.signal.lfilter` reads them."""
    num, den = system
    return np.concatenate([np.zeros(len(den) - len(num)), num]), den


def spec() -> str:
    """Text of couple.toml."""
    lines = ["[coupling]", 'name = "pair of stages"', f"sample_time = {DT}"]
    for number, stage in enumerate((RETICLE, WAFER), 1):
        lines += [f"[subsystems.{number}]", f'name = "{("reticle", "wafer")[number - 1]}"',
                  f"plant = {table(stage.tf())}", f"controller = {table(stage.controller())}",
                  "disturbance = { num = [4e-10], den = [1.0, -0.98] }"]
    lines += ["[design]", "window = 0.01", "msd_limit = 1.5", "order = 8", "margin = 0.1", "stable_controller = true"]
    return "\n".join(lines) + "\n"


def table(system: tuple[Array, Array]) -> str:
    """Inline TOML table, every digit kept."""
    return f"{{ num = {system[0].tolist()}, den = {system[1].tolist()} }}"
