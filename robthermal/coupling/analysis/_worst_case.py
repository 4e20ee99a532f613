"""Worst-case performance over the uncertainty, frequency by frequency; and a perturbation that destabilizes.

With the factors normalized to Dp Dk + Np Nk = 1 (which turns Delta_k into F and Delta_p into E = U Delta_p below), the
coupled loop with the plant of Delta_p has

    e12 = [nominal - row (I + E F)⁻¹ E G] v,   F = Delta_k in those factors,

so |e12| <= |nominal| + |row| (I - R|F|)⁻¹ R |G| entry by entry for every |E| <= R (Neumann series). Proof:
docs/explanations/coupling_synthesis.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..._arrays import Array
from ..._drawing import axes_for
from ...errors import InputError
from ..evaluation import Filters
from ..problem import Problem
from ..systems import siso

_GRID_POINTS = 2000


@dataclass(frozen=True, eq=False)
class WorstCase:
    """Spectrum of weighted e12 for the model, for every measured plant, and an upper bound for all plants under R.

    Values at frequencies, not between them; Delta_p of a measured plant is interpolated linearly, and held at the ends.

    Parameters
    ----------
    omega : ndarray, shape (n_f,)
        Frequencies of the responses [rad/s].
    before, after : ndarray, shape (n_plants, n_f)
        Size of weight e12 per unit of white noise, without and with coupling, for each measured plant.
    bound_before, bound_after : ndarray, shape (n_f,)
        Largest size for any Delta_p under the envelope; infinite where the bound does not converge.
    ma_before, ma_after, msd_before, msd_after : ndarray, shape (n_plants + 1,)
        Three-sigma moving average and moving standard deviation [m] of each plant, and last of the bound (spectra
        integrated on the grid); nan without a window.
    """

    omega: Array
    before: Array
    after: Array
    bound_before: Array
    bound_after: Array
    ma_before: Array
    ma_after: Array
    msd_before: Array
    msd_after: Array

    def __str__(self) -> str:
        names = [f"plant {k + 1}" for k in range(len(self.before))] + ["bound"]
        lines = [f"{'':<10}{'MA before':>12}{'after':>12}{'MSD before':>12}{'after':>12}  [m]"]
        columns = (self.ma_before, self.ma_after, self.msd_before, self.msd_after)
        lines += [f"{name:<10}" + "".join(f"{column[k]:>12.4g}" for column in columns) for k, name in enumerate(names)]
        return "\n".join(lines)

    def plot(self, ax: Any = None) -> Any:
        """Spectra over frequency [Hz]: every plant and the bound, without and with coupling.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Axes to draw into; default new ones.

        Returns
        -------
        matplotlib axes
        """
        ax = axes_for(ax)
        hertz = self.omega / (2 * np.pi)
        for spectra, bound, color, name in ((self.before, self.bound_before, "0.6", "without coupling"),
                                            (self.after, self.bound_after, "C0", "with coupling")):
            ax.loglog(hertz, spectra.T, color=color, linewidth=0.8)
            ax.loglog(hertz, bound, color=color, linestyle="--", label=f"{name} (dashed: bound)")
        ax.set_xlabel("frequency [Hz]")
        ax.set_ylabel("weighted e12 per white noise [m/√Hz]")
        ax.legend()
        return ax


def worst_case(filters: Filters) -> WorstCase:
    """What the filters do on every measured plant, and at worst under the envelope.

    Parameters
    ----------
    filters : Filters
        From `synthesize` or `evaluate`, with an uncertainty.

    Returns
    -------
    WorstCase

    Raises
    ------
    InputError
        If the filters were made without an uncertainty.

    Examples
    --------
    >>> import robthermal as rt
    >>> machine = rt.systems.scanner()
    >>> filters = rt.coupling.evaluate(machine.P1, machine.P2, machine.C1, machine.C2, X_hat=-0.1,
    ...                                uncertainty=list(machine.frf), disturbances=machine.disturbances, window=0.01)
    >>> found = rt.coupling.worst_case(filters)
    >>> found.after.shape[0], bool((found.after <= found.bound_after * (1 + 1e-9)).all())
    (5, True)
    """
    problem = filters.problem
    if problem.uncertainty is None:
        raise InputError("the filters were made without an uncertainty", where="worst_case",
                         expected="filters from synthesize or evaluate with uncertainty=...")
    omega = problem.grid(_GRID_POINTS)
    omega = omega[omega > 0]
    maps = _Maps.at(problem, filters, omega)
    alone = _Maps.at(problem, None, omega)
    samples = _interpolated(problem, omega)
    before, after = (np.array([m.perturbed(sample) for sample in samples]) for m in (alone, maps))
    bounds = alone.bound(problem.envelope(omega)), maps.bound(problem.envelope(omega))
    parts = [_three_sigma(problem, omega, np.vstack([plants, bound]))
             for plants, bound in ((before, bounds[0]), (after, bounds[1]))]
    return WorstCase(omega, before, after, *bounds, ma_before=parts[0][0], ma_after=parts[1][0],
                     msd_before=parts[0][1], msd_after=parts[1][1])


@dataclass(frozen=True)
class _Maps:
    """nominal (n_f, 1, 2), row (n_f, 1, 2), F and G (n_f, 2, 2), unit (n_f, 2), noise (n_f, 2): see the module."""

    nominal: Array
    row: Array
    F: Array
    G: Array
    unit: Array
    noise: Array

    @classmethod
    def at(cls, problem: Problem, filters: Filters | None, omega: Array) -> _Maps:
        one, two = problem.one, problem.two
        S, Q, Z, Dk, Nk = (np.array([getattr(half, name).at(omega) for half in (one, two)])
                           for name in ("S", "Q", "Z", "Dk", "Nk"))
        hats = np.zeros_like(S)
        if filters is not None:
            hats = np.array([siso(filters.X_hat, omega), siso(filters.Y_hat, omega)])
        unit = Q * Dk + Z * Nk  # Dp Dk + Np Nk
        d = Dk / unit  # = S/Q, without the division by zero of a quotient of zeros
        improved = np.array([-(1 + Z[1] * hats[1]), 1 + Z[0] * hats[0]])
        F, G = (np.zeros((omega.size, 2, 2), complex) for _ in range(2))
        F[:, 0, 1], F[:, 1, 0] = hats[0] * d[1], hats[1] * d[0]
        G[:, 0, 0], G[:, 1, 1] = (Nk / unit)[0], (Nk / unit)[1]
        G[:, 0, 1], G[:, 1, 0] = hats[0] * S[1], hats[1] * S[0]
        noise = np.array([half.W.at(omega) for half in (one, two)]) * problem.weight.at(omega)
        nominal, row = (np.transpose(part)[:, None, :] for part in (improved * S, improved * d))
        return cls(nominal, row, F, G, unit.T, noise.T)

    def perturbed(self, delta: Array) -> Array:
        """Size of e12 for Delta_p (n_f, 2, 2)."""
        E = self.unit[:, :, None] * delta
        change = self.row @ np.linalg.solve(np.eye(2) + E @ self.F, E @ self.G)
        return self._size(np.abs(self.nominal - change))

    def bound(self, envelope: Array) -> Array:
        """Largest size for every |Delta_p| <= envelope (2, 2, n_f)."""
        R = np.abs(self.unit)[:, :, None] * np.moveaxis(envelope, -1, 0)
        loop = R @ np.abs(self.F)
        converges = np.abs(np.linalg.eigvals(loop)).max(axis=1) < 1
        loop[~converges] = 0.0
        change = np.abs(self.row) @ np.linalg.solve(np.eye(2) - loop, R @ np.abs(self.G))
        return np.where(converges, self._size(np.abs(self.nominal) + change), np.inf)

    def _size(self, gains: Array) -> Array:
        return np.linalg.norm(gains[:, 0] * np.abs(self.noise), axis=1)


def _interpolated(problem: Problem, omega: Array) -> Array:
    """Delta_p of the measured plants (n_plants, n_f, 2, 2) on another grid."""
    assert problem.uncertainty is not None
    samples = problem.uncertainty.samples
    rows = samples.reshape(-1, samples.shape[-1])
    finer = np.array([np.interp(omega, problem.uncertainty.omega, row) for row in rows])
    return np.moveaxis(finer.reshape(*samples.shape[:3], omega.size), -1, 1)


def _three_sigma(problem: Problem, omega: Array, sizes: Array) -> tuple[Array, Array]:
    """Three-sigma moving average and moving standard deviation of spectra (n, n_f), integrated on the grid."""
    if not problem.samples:
        return (np.full(len(sizes), np.nan),) * 2
    N, half = problem.samples, omega * problem.dt / 2
    F = np.sin(N * half) / (N * np.sin(half))
    values = (np.trapezoid(sizes**2 * share, omega, axis=1) * problem.dt / np.pi for share in (F**2, 1 - F**2))
    ma, msd = (3 * np.sqrt(np.maximum(value, 0.0)) for value in values)
    return ma, msd
