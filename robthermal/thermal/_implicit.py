"""Sparse implicit integration for large networks: stiffly accurate SDIRK of order 2 with an embedded error of order 3.

One sparse factorization per step length serves all steps (simplified Newton); a sample is halved while the embedded
error exceeds the tolerance. Memory is linear in the links plus the temperatures that are kept.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from ..errors import Diverged, InputError
from ._equations import Equations
from ._terms import Array

_GAMMA = 1 - np.sqrt(0.5)
_WEIGHTS = np.array([1 - _GAMMA, _GAMMA])
_EMBEDDED = np.linalg.solve(np.vander([0.0, _GAMMA, 1.0], increasing=True).T, [1.0, 1 / 2, 1 / 3])
_NEWTON = 10
_FINEST = 20


@dataclass(frozen=True)
class Run:
    """Kept temperatures (n, n_keep) and energies [J] as in `Trajectory`."""

    lumps: Array
    stored: Array
    ambient_heat: Array
    electrical_energy: Array
    heater_heat: Array
    source_heat: Array


@dataclass
class _Stepper:
    eq: Equations
    h: float
    tolerance: float

    def __post_init__(self) -> None:
        self._lu: dict[int, scipy.sparse.linalg.SuperLU] = {}

    def factor(self, level: int, x: Array, u: Array) -> scipy.sparse.linalg.SuperLU:
        """LU of E - γ h J for steps of h / 2**level, made at the first state that needs it."""
        if level not in self._lu:
            J = self.eq.jacobian(x, u)
            matrix = scipy.sparse.diags_array(self.eq.capacity) - _GAMMA * self.h / 2**level * J
            self._lu[level] = scipy.sparse.linalg.splu(
                scipy.sparse.csc_array(matrix), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True},
                diag_pivot_thresh=0.01)
        return self._lu[level]

    def refresh(self) -> None:
        """Forget all factorizations: the network has changed too much."""
        self._lu.clear()

    def step(self, x: Array, u: Array, level: int) -> tuple[Array, list[Array], float] | None:
        """One step: the new state, its stages and its error [K]; None where Newton does not converge."""
        h, E = self.h / 2**level, self.eq.capacity
        lu = self.factor(level, x, u)
        f0 = self.eq.heat(x, u)
        first = self._stage(x, x, u, h, lu)
        if first is None:
            return None
        k1 = (first - x) / (_GAMMA * h)
        base = x + (1 - _GAMMA) * h * k1
        second = self._stage(base, base + _GAMMA * h * k1, u, h, lu)
        if second is None:
            return None
        heats = [self.eq.heat(first, u), self.eq.heat(second, u)]
        new = x + h * (_WEIGHTS[0] * heats[0] + _WEIGHTS[1] * heats[1]) / E
        difference = h * (_EMBEDDED[0] * f0 + (_EMBEDDED[1] - _WEIGHTS[0]) * heats[0]
                          + (_EMBEDDED[2] - _WEIGHTS[1]) * heats[1])
        return new, [first, second], float(np.abs(lu.solve(difference)).max())

    def _stage(self, base: Array, guess: Array, u: Array, h: float, lu: scipy.sparse.linalg.SuperLU) -> Array | None:
        """Solve E (X - base) = γ h f(X, u) for X."""
        X = guess
        for _ in range(_NEWTON):
            residual = self.eq.capacity * (X - base) - _GAMMA * h * self.eq.heat(X, u)
            if np.abs(residual / self.eq.capacity).max() < 1e-3 * self.tolerance:
                return X
            X = X - lu.solve(residual)
            if not np.abs(X).max() < 1e5:
                return None
        return None


def run_implicit(eq: Equations, x0: Array, u: Array, h: float, tolerance: float, keep: NDArray[np.intp]) -> Run:
    """Integrate a large network.

    Parameters
    ----------
    eq : Equations
        Equations of the network.
    x0 : ndarray, shape (n,)
        Initial temperatures of all lumps [K].
    u : ndarray, shape (n_samples, n_u)
        Exogenous values of every sample, constant until the next.
    h : float
        Time between two samples [s].
    tolerance : float
        Accepted error per step [K].
    keep : ndarray of int
        Lumps whose temperature is stored.

    Returns
    -------
    Run

    Raises
    ------
    Diverged
        When no step length is short enough.
    """
    stepper, x, level = _Stepper(eq, h, tolerance), x0, 0
    meters: Array = np.zeros(len(eq.system.ambients) + len(eq.system.modules) + len(eq.system.inputs) + 1)
    lumps, stored, energy = [x0[keep]], [0.0], [meters]
    for k in range(len(u) - 1):
        x, meters, level = _sample(stepper, x, u[k], meters, level, k)
        lumps.append(x[keep])
        stored.append(float(eq.capacity @ (x - x0)))
        energy.append(meters)
    meter = np.array(energy)
    na, nm = len(eq.system.ambients), len(eq.system.modules)
    return Run(np.array(lumps), np.array(stored), meter[:, :na], meter[:, na:na + nm], meter[:, na + nm:-1],
               meter[:, -1])


def _sample(stepper: _Stepper, x: Array, u: Array, meters: Array, level: int, k: int) -> tuple[Array, Array, int]:
    """Advance one sample, in units of its finest step; return the level for the next sample."""
    done, finest, renewed = 0, 1 << _FINEST, False
    while done < finest:
        result = stepper.step(x, u, level)
        if result is None and not renewed:
            stepper.refresh()
            renewed = True
            continue
        if result is None or not result[2] <= stepper.tolerance:
            level += 1
            renewed = False
            if level > _FINEST:
                raise Diverged(f"the simulation runs away at {k * stepper.h:.6g} s: no step is short enough. Check "
                               "signs and units, or limit the current.", time=k * stepper.h)
            continue
        x, stages, error = result
        h = stepper.h / 2**level
        meters = meters + h * sum(w * _flows(stepper.eq, X, u) for w, X in zip(_WEIGHTS, stages, strict=True))
        done += finest >> level
        if level and error < stepper.tolerance / 12 and done % (finest >> (level - 1)) == 0:
            level -= 1
    return x, meters, level


def _flows(eq: Equations, x: Array, u: Array) -> Array:
    """Heat from every ambient, electrical power of every module, heat of every heater, and of all other sources [W]."""
    n, w, one = len(eq.capacity), eq.drives(u), eq.drives.one
    conductance = eq.D[:, eq.drives.ambients]
    ambient = conductance.sum(axis=0) * w[eq.drives.ambients] - conductance.T @ (x - eq.gradient) + eq.carried @ x
    constant = eq.D[:, [one]].sum() - (conductance.T @ eq.gradient).sum()
    power = {"modules": np.zeros(len(eq.system.modules)), "sources": np.array([constant]),
             "inputs": np.array([heater.gain for heater in eq.system.inputs.values()]) * w[:len(eq.system.inputs)]}
    for term in eq.terms:
        into_a, into_b = term.heat(*eq.driven(term, x, w))
        if term.supply == "sources":
            power["sources"] += into_a.sum() + into_b.sum()
        elif term.supply:
            np.add.at(power[term.supply], term.supply_index, into_a + into_b)
        for nodes, flow in ((term.a, into_a), (term.b, into_b)):
            outside = nodes >= n
            np.subtract.at(ambient, nodes[outside] - n, flow[outside])
    return np.concatenate([ambient, power["modules"], power["inputs"], power["sources"]])


def refuse_memory(eq: Equations) -> None:
    """Refuse effects that need states or times of their own; large networks have none."""
    timed = ("drive.delay", "drive.time_constant", "hysteresis.heat", "periodic.heat", "step.relative")
    for name in eq.system.effects:
        if name.endswith(timed):
            raise InputError(f"{name} in a network of {len(eq.capacity)} lumps", where="argument system",
                             expected="effects without memory in networks of more than a few hundred lumps",
                             remedy="Reduce the model first (rt.thermal.reduce), or leave the effect out.")
