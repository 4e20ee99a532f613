"""Fit of a structure to the records with its priors, filters and noise levels renewed at the estimate."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...errors import Diverged, InputError, Outcome
from .._outcomes import DiagnosisCode
from ..data import NoiseEstimate
from ..path import Linearized, White, linearized_records
from ._descent import Descent, Point, decrease, descend
from ._ended import ended
from ._noise_scaling import NoiseScaling, refined
from ._refit import Refit
from ._structure import Structure
from ._whitened import Whitened

Array = NDArray[np.float64]
LIMIT = 40  # evaluations of a refit
ENOUGH = 3e-5  # relative: a tenth of a unit of BIC on a thousand samples of three sensors
_ENOUGH_LONG = 1e-3  # of long records beside what a finer network changes, of which a few percent say nothing
_ROUNDS = 3  # of filter and noise levels
_PART = 1500  # samples of a long record that are fitted first
_LONG = 3  # times as many: a long record
_CLEAR = 10.0  # of BIC
_LOOK = 2  # evaluations of a start from rest before it is looked at
_BEYOND_DOUBT = 2.0  # times its price: from more a start from rest does not come back
_AT_ONCE = 20.0  # the same, before a first step
_FAR = 3.0  # times the decrease that chance promises: from less the whole record converges as soon


def fitted(structure: Structure, v: Array, floor: NoiseEstimate, levels: NoiseScaling) -> Refit:
    """Fit from v; filter and noise levels are renewed at the estimate, and the fit repeated.

    The first part of long records is fitted before them: it costs little, and is near.
    """
    part = structure.first(_PART)
    if structure.n_readings >= _LONG * part.n_readings:
        try:
            near = _on_part(part, v, floor, levels)
            if near is not None:
                return _fitted(structure, near[0], floor, near[1], v)
        except (Diverged, InputError):  # the part leads where the whole record does not survive
            pass
    return _fitted(structure, v, floor, levels)


def _on_part(part: Structure, v: Array, floor: NoiseEstimate, levels: NoiseScaling
             ) -> tuple[Array, NoiseScaling] | None:
    """Optimum of a part of the records, and the noise levels there; None if v is as near as chance lets it be."""
    whiteners = filters(part, v, floor, levels)[1]
    start = Point(Whitened(part, whiteners), v)
    if decrease(start, part.bounds) < _FAR * v.size / start.z.size * float(start.z @ start.z):
        return None
    near = minimized(part, v, whiteners).at.v
    return near, _refined(part.paths(near), floor, levels)


def _fitted(structure: Structure, v: Array, floor: NoiseEstimate, levels: NoiseScaling, other: Array | None = None
            ) -> Refit:
    """Fit from v, or from another start if its sum of squares is smaller."""
    for _ in range(_ROUNDS):
        paths, whiteners = filters(structure, v, floor, levels)
        if other is not None:
            problem = Whitened(structure, whiteners)
            v, other = min((v, other), key=lambda at: float(np.sum(problem.residual(at) ** 2))), None
        found = minimized(structure, v, whiteners)
        v = found.at.v
        paths = structure.paths(v)
        new = _refined(paths, floor, levels)
        if new.close_to(levels):
            break
        levels = new
    paths, whiteners = filters(structure, v, floor, levels)
    z = Whitened(structure, whiteners).residual(v)
    structure.keep_only(v)
    return Refit(structure, v, floor, levels, paths, whiteners, z, _outcome(found))


def extended(fit: Refit, structure: Structure, v: Array, limit: int = LIMIT) -> Refit:
    """Fit another structure with the same filters, so that sums of squares can be compared."""
    structure, found = _at_rest(structure, minimized(structure, v, fit.whiteners, limit), fit.whiteners, limit)
    structure.keep_only(found.at.v)
    return replace(fit, structure=structure, v=found.at.v, z=found.at.z, outcome=_outcome(found))


def _at_rest(structure: Structure, found: Descent, whiteners: Sequence[White], limit: int
             ) -> tuple[Structure, Descent]:
    """With settled lags at the start of the records, unless these ask for more beyond doubt.

    On a step from rest a lag and a start in motion look much the same, and most experiments begin at rest. Where the
    linearization after a first step says that settled lags cost far more than that, they are not fitted to the end.
    Nothing is settled by a fit in motion that has not converged: far from its optimum the rest of the misfit decides.
    """
    rest = structure.at_rest()
    price = (structure.n_own - rest.n_own) * (math.log(structure.n_readings) + _CLEAR)
    if not price:
        return structure, found
    power = float(found.at.z @ found.at.z)
    start = rest.carried(structure, found.at.v, structure.quantities(found.at.v))
    if _least(Point(Whitened(rest, whiteners), np.clip(start, *rest.bounds)), rest) > power + _AT_ONCE * price:
        return structure, found
    other = minimized(rest, start, whiteners, min(limit, _LOOK))
    if _least(other.at, rest) > power + _BEYOND_DOUBT * price:
        return structure, found
    sure = found.converged or limit >= LIMIT
    if not other.converged and (sure or limit > _LOOK):
        other = minimized(rest, other.at.v, whiteners, LIMIT if sure else limit - _LOOK)
    if float(other.at.z @ other.at.z) > power + price:
        return structure, found
    if sure:
        return rest, other
    moving = structure.carried(rest, other.at.v, rest.quantities(other.at.v))
    return structure, min(found, minimized(structure, moving, whiteners, 1), key=lambda one: float(one.at.z @ one.at.z))


def _least(at: Point, structure: Structure) -> float:
    """Sum of squares that the linearization at a point promises."""
    return float(at.z @ at.z) - decrease(at, structure.bounds)


def coarsened(fit: Refit) -> Refit:
    """The same structure where the network may be too coarse: what a finer one would change is unknown, of usual size.

    Noise levels are found again: those of the fit have grown with what it could not explain.
    """
    structure = replace(fit.structure, coarse=())
    n = structure.n_parameters + structure.n_effects
    own = fit.v[fit.structure.n_common:]
    plain = np.concatenate([fit.v[:n], own])
    coarse = tuple(path.coarse_columns(structure.base) for path in structure.paths(plain))
    finer = replace(structure, coarse=coarse)
    return fitted(finer, np.concatenate([fit.v[:n], np.zeros(finer.n_coarse), own]), fit.floor,
                  fit.levels.declared)


def exact(fit: Refit) -> Refit:
    """The same structure refitted with the network taken to be right, and noise no larger than declared."""
    return fit.kept("exact", lambda: _exact(fit))


def _exact(fit: Refit) -> Refit:
    structure = replace(fit.structure, coarse=())
    n = structure.n_common
    v = np.concatenate([fit.v[:n], fit.v[fit.structure.n_common:]])
    start = _from_either(structure, v, fit.floor, fit.levels.declared) if fit.structure.coarse else fit
    noise = {name: min(factor, 1.0) for name, factor in fit.levels.noise.items()}
    return replace(start, levels=replace(fit.levels, disturbance=min(fit.levels.disturbance, 1.0), noise=noise))


def _from_either(structure: Structure, v: Array, floor: NoiseEstimate, levels: NoiseScaling) -> Refit:
    """Fit from v and, where that ends before it converges, from the declared parameters with the same effects.

    What a finer network would change has taken some of the work of the parameters; without it their valley may be far.
    """
    fit = fitted(structure, v, floor, levels)
    if fit.outcome.ok or not structure.n_parameters:
        return fit
    try:
        other = fitted(structure, structure.start(structure.ranges.start, structure.quantities(v)), floor, levels)
        power = float(np.sum(Whitened(structure, fit.whiteners).residual(other.v) ** 2))
    except (Diverged, InputError):  # the declared parameters do not survive with these effects
        return fit
    return other if power < fit.rss else fit


def only_heated(fit: Refit) -> Refit:
    """The same structure refitted with unknown ambients no warmer than a machine that is only heated allows."""
    structure = replace(fit.structure, only_heated=True)
    return fitted(structure, np.clip(fit.v, *structure.bounds), fit.floor, fit.levels.declared)


def relinearized(fit: Refit) -> Refit:
    """The same with linearizations of its own structure; `extended` keeps those of the structure it came from."""
    return replace(fit, paths=fit.structure.paths(fit.v))


def filters(structure: Structure, v: Array, floor: NoiseEstimate, levels: NoiseScaling
            ) -> tuple[tuple[Linearized, ...], tuple[White, ...]]:
    """The model beside all data, linearized there, and what makes the errors of each data set white."""
    paths = structure.paths(v)
    return paths, tuple(path.white(lambda record: levels.noise_of(record, floor)) for path in paths)


def _refined(paths: Sequence[Linearized], floor: NoiseEstimate, levels: NoiseScaling) -> NoiseScaling:
    """Noise levels of the records; those of responses come with them."""
    records = linearized_records(paths)
    if not records:
        return levels
    sensors = {name for path in records for name in path.one.sensors}
    return refined(records, replace(floor, noise={name: floor.noise[name] for name in floor.noise if name in sensors}),
                   levels)


def minimized(structure: Structure, v: Array, whiteners: Sequence[White], limit: int = LIMIT) -> Descent:
    """Gauss-Newton with fixed filters."""
    long = structure.n_readings >= _LONG * structure.first(_PART).n_readings
    enough = _ENOUGH_LONG if long and structure.n_coarse else ENOUGH
    return ended(structure, v, whiteners, limit,
                 lambda: descend(Whitened(structure, whiteners), v, structure.bounds, limit, enough))


def _outcome(found: Descent) -> Outcome:
    if found.converged:
        return DiagnosisCode.CONVERGED.outcome(f"Converged in {found.iterations} evaluations.")
    return DiagnosisCode.NOT_CONVERGED.outcome(f"Stopped after {found.iterations} evaluations without converging.")
