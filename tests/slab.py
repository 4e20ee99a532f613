"""A slab that takes heat at one face, in finite differences: truth for local functions that no few poles describe."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.signal import lfilter

import robthermal as rt


@dataclass(frozen=True)
class Slab:
    """Flux into the face of a slab of thickness 1 and conductivity 1, tau = 1/diffusivity; the far face held or not.

    `film` is a film between heat source and face: the input is then the temperature beyond the film of this
    conductance, and the output the temperature of the face.
    """

    tau: float
    cells: int = 250
    insulated: bool = False
    film: float = 0.0

    @cached_property
    def modes(self) -> tuple[np.ndarray, np.ndarray, float]:
        """Eigenvalues [1/s], residues, and the direct part: half a cell of conduction before the first node."""
        n, h = self.cells, 1.0 / self.cells
        ends = np.zeros(n)
        ends[-1] = 0.0 if self.insulated else 2.0 / h
        into = 1.0 / (1.0 / self.film + h / 2) if self.film else 0.0
        ends[0] += into
        K = np.diag(np.r_[1.0, 2.0 * np.ones(n - 2), 1.0] / h + ends)
        K -= np.diag(np.ones(n - 1) / h, 1) + np.diag(np.ones(n - 1) / h, -1)
        values, vectors = np.linalg.eigh(-K / h / self.tau)
        to_face = vectors[0] * (1.0 - into * h / 2 if self.film else 1.0)
        direct = into * h / 2 if self.film else h / 2
        return values, to_face * vectors[0] * (into or 1.0) / (h * self.tau), direct

    def continuous(self, f: np.ndarray) -> np.ndarray:
        values, residues, direct = self.modes
        return direct + (residues / (2j * np.pi * f[:, None] - values)).sum(axis=1)

    def response(self, f: np.ndarray, sample_time: float = 1.0) -> np.ndarray:
        """Under zero-order hold."""
        values, residues, direct = self.modes
        a, z = np.exp(values * sample_time), np.exp(2j * np.pi * f * sample_time)
        return direct + (residues * np.expm1(values * sample_time) / values / (z[:, None] - a)).sum(axis=1)

    def record(self, rng: np.random.Generator, n: int, noise: float, past: int) -> rt.Record:
        """White flux, held for 1 s; the record begins `past` samples after the body was cold."""
        values, residues, direct = self.modes
        u = rng.normal(size=n + past)
        y = direct * u
        for p, r in zip(values, residues, strict=True):
            if r:
                y += lfilter([0.0, r * np.expm1(p) / p], [1.0, -np.exp(p)], u)
        return rt.Record(sample_time=1.0, inputs=u[past:], outputs=y[past:] + noise * rng.normal(size=n),
                         input_names=["q"], output_names=["T"])
