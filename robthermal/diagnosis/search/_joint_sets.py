"""Sets of effects refitted together, and the best ones out of a pool of candidates."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ...errors import Diverged, InputError
from ..effects import Candidate
from ..fit import LIMIT, Refit, extended

Array = NDArray[np.float64]
Key = tuple[str, tuple[str, ...]]
MOST = 3  # effects in a set
_POOLED = 4  # evaluations of the refit of the whole pool
_NEAR = 0.5


@dataclass(frozen=True, eq=False)
class EffectSet:
    """Several effects refitted together.

    Parameters
    ----------
    candidates : tuple of Candidate
        Effects of the set.
    fit : Refit
        With all of them.
    delta_bic : float
        Against the fit without any of them, same filters.
    """

    candidates: tuple[Candidate, ...]
    fit: Refit
    delta_bic: float

    @property
    def keys(self) -> frozenset[Key]:
        """What makes two sets the same."""
        return frozenset(candidate.key for candidate in self.candidates)

    def __str__(self) -> str:
        return " + ".join(candidate.label for candidate in self.candidates) + f"   ΔBIC {self.delta_bic:.1f}"


def bic(fit: Refit) -> float:
    """N log RSS + dim log N; compare fits with the same filters only."""
    dim = fit.structure.n_effects + sum(len(start.mean) for start in fit.structure.starts)
    return fit.n_readings * math.log(fit.rss) + dim * math.log(fit.n_readings)


def refit_set(fit: Refit, candidates: tuple[Candidate, ...], sizes: Sequence[float], near: Refit | None = None,
              limit: int = LIMIT) -> EffectSet:
    """Refit several candidates together from these sizes, with the filters of `fit`; parameters start as in `near`."""
    near = fit if near is None else near
    structure = fit.structure.with_effects((*fit.structure.effects, *candidates))
    values = [*fit.structure.quantities(fit.v), *({**candidate.shape, candidate.effect.size.name: size}
                                                  for candidate, size in zip(candidates, sizes, strict=True))]
    start = np.clip(structure.carried(near.structure, near.v, values), *structure.bounds)
    new = extended(fit, structure, start, limit)
    return EffectSet(candidates, new, bic(fit) - bic(new))


def _again(fit: Refit, known: Refit) -> EffectSet:
    """A set that has been refitted, with the filters of `fit`."""
    new = extended(fit, known.structure, known.v)
    return EffectSet(known.structure.effects, new, bic(fit) - bic(new))


def _forms(candidates: Sequence[Candidate]) -> set[tuple[Key, str]]:
    """Names, and the size of each: an effect may have two forms, such as a cubic and a clip."""
    return {(candidate.key, candidate.effect.size.name) for candidate in candidates}


def best_sets(fit: Refit, pool: tuple[Candidate, ...], sizes: Sequence[float], tries: int,
              more: Sequence[tuple[tuple[Candidate, ...], list[float]]], known: Refit | None = None
              ) -> tuple[EffectSet, ...]:
    """The best sets of up to three candidates of a pool, and some more sets, refitted; one that is known from there.

    The whole pool is refitted first: there the nominal parameters and the shapes are near the truth, and the sums of
    squares of its subsets follow from one linearization.
    """
    found: dict[frozenset[Key], EffectSet] = {}
    starts = [(chosen, own, fit) for chosen, own in more]
    try:
        pooled = refit_set(fit, pool, sizes, limit=_POOLED)
        starts += [(chosen, own, pooled.fit) for chosen, own in _promising(fit, pooled)[:tries]]
    except (Diverged, InputError):  # too many at once
        pass
    for chosen, own, near in starts:
        warm = known if known is not None and _forms(known.structure.effects) == _forms(chosen) else None
        if warm is not None and frozenset(candidate.key for candidate in chosen) in found:
            continue
        try:
            new = refit_set(fit, chosen, own, near) if warm is None else _again(fit, warm)
        except (Diverged, InputError):  # a set that no simulation follows is no explanation
            continue
        if new.keys not in found or new.delta_bic > found[new.keys].delta_bic:
            found[new.keys] = new
    return tuple(sorted(found.values(), key=lambda one: -one.delta_bic))


@dataclass(frozen=True, eq=False)
class _Pool:
    """Refit of a whole pool of candidates, linearized, so that the sums of squares of its subsets follow.

    Parameters
    ----------
    fit : EffectSet
        All candidates of the pool refitted together.
    values : list of dict
        Quantities of every candidate there.
    own : list of ndarray
        Unknowns of every candidate.
    rest : ndarray
        All other unknowns.
    gone : list of ndarray
        Change of the whitened residuals when a candidate is left out, all else as it is.
    """

    fit: EffectSet
    values: list[dict[str, float]]
    own: list[NDArray[np.intp]]
    rest: NDArray[np.intp]
    gone: list[Array]

    def subset(self, members: tuple[int, ...]) -> tuple[float, list[float]]:
        """BIC and sizes of a subset, linearized about the pool.

        Parameters
        ----------
        members : tuple of int
            Places in the pool.
        """
        J, scale = self._scaled
        z = self.fit.fit.z + sum((self.gone[i] for i in range(len(self.own)) if i not in members), np.zeros(len(J)))
        at = np.concatenate([self.rest, *(self.own[i] for i in members)])
        step = np.linalg.lstsq(J[:, at], z, rcond=1e-9)[0]
        moved = dict(zip(at.tolist(), (step / np.where(scale[at] > 0, scale[at], 1.0)).tolist(), strict=True))
        sizes = [self.values[i][self.fit.candidates[i].effect.size.name] + moved[int(self.own[i][0])] for i in members]
        rss, n = float(np.sum((z - J[:, at] @ step) ** 2)), self.fit.fit.n_readings
        return n * math.log(rss) + sum(self.own[i].size for i in members) * math.log(n), sizes

    @cached_property
    def _scaled(self) -> tuple[Array, Array]:
        """Derivatives with columns of length one, and the lengths."""
        J = self.fit.fit.J
        scale = np.linalg.norm(J, axis=0)
        return J / np.where(scale > 0, scale, 1.0), scale


def _linearized(fit: Refit, pooled: EffectSet) -> _Pool:
    structure, first = pooled.fit.structure, len(fit.structure.effects)
    values = structure.quantities(pooled.fit.v)[first:]
    ends = structure.n_parameters + np.cumsum([len(c.effect.free) for c in structure.effects])
    own = [np.arange(end - len(c.effect.free), end) for c, end in zip(structure.effects, ends, strict=True)][first:]
    rest = np.setdiff1d(np.arange(pooled.fit.J.shape[1]), np.concatenate(own))
    here = [one.model(system) for one, system in zip(structure.data, structure.systems(pooled.fit.v), strict=True)]
    return _Pool(pooled, values, own, rest, [_without(fit, pooled, here, i) for i in range(len(own))])


def _promising(fit: Refit, pooled: EffectSet) -> list[tuple[tuple[Candidate, ...], list[float]]]:
    """Subsets by their linearized BIC about the refit of the pool, with their sizes; impossible ones are left out."""
    pool, found = _linearized(fit, pooled), []
    for count in range(1, min(MOST, len(pool.own)) + 1):
        for members in combinations(range(len(pool.own)), count):
            criterion, sizes = pool.subset(members)
            if all(_possible(pooled.candidates[i], size) for i, size in zip(members, sizes, strict=True)):
                found.append((criterion, members, sizes))
    kept: list[tuple[int, ...]] = []
    out = []
    for _, members, sizes in sorted(found):
        if not any(set(smaller) <= set(members) for smaller in kept):  # what a better set adds nothing to
            kept.append(members)
            out.append((tuple(_shaped(pooled.candidates[i], pool.values[i]) for i in members), sizes))
    return out


def _without(fit: Refit, pooled: EffectSet, here: Sequence[Array], gone: int) -> Array:
    """What leaving out one effect changes in the whitened residuals, all else as it is."""
    old, place = pooled.fit.structure, len(fit.structure.effects) + gone
    structure = old.with_effects(old.effects[:place] + old.effects[place + 1:])
    values = old.quantities(pooled.fit.v)
    v = structure.carried(old, pooled.fit.v, values[:place] + values[place + 1:])
    change = [(with_it - one.model(system))[..., None] for one, with_it, system in
              zip(old.data, here, structure.systems(v), strict=True)]
    return pooled.fit.whiten(change)[:, 0]


def near_trial(candidate: Candidate, size: float) -> float:
    """A size that is possible and, where the signature holds only about a trial value, near that."""
    trial = candidate.shape.get(candidate.effect.size.name)
    low, high = ((candidate.effect.size.lower, candidate.effect.size.upper) if trial is None
                 else (_NEAR * trial, trial / _NEAR))
    return float(np.clip(size, low, high))


def _possible(candidate: Candidate, size: float) -> bool:
    return candidate.effect.size.lower <= size <= candidate.effect.size.upper and size != 0.0


def _shaped(candidate: Candidate, values: dict[str, float]) -> Candidate:
    """The candidate with the shape that the pool found."""
    return replace(candidate, shape={name: v for name, v in values.items() if name != candidate.effect.size.name})
