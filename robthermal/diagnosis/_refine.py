"""`--refine`: split the lump in which the remainder sits, and diagnose again."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace

from ..errors import Diverged, InputError
from ..fitting import NONE, Choice, chosen_ranges
from ..thermal import FitRange, SplitLump, System, split_lump, ways_to_split
from ._outcomes import DiagnosisCode
from ._refinement import Refinement, Split
from .diagnosis import Diagnosis
from .evidence import NEEDED, Remainder, left
from .fit import Refit

Fitted = Callable[[System, Choice], Refit]
Again = Callable[[System, Choice], Diagnosis]
_LUMPS = 2  # most lumps that are split
_NEARLY = 0.5  # of the share of the first, that another lump must explain to be split too
_RANGE = 100.0  # bounds of the conductance between the parts, times smaller or larger than its start
_SMALLEST = 0.02  # of the lower bound of the lump: the capacity of a part, such as a spot under a laser


def refine(found: Diagnosis, system: System, parameters: Choice, fitted: Fitted, again: Again) -> Refinement | None:
    """Split the lumps in which the remainder sits in every way, and diagnose the best again.

    None where nothing is left beyond the noise, or no way to split a lump can be simulated.

    Parameters
    ----------
    found : Diagnosis
        Answer for the network as it is.
    system : System
        Nominal system that was diagnosed.
    parameters : iterable or mapping, optional
        Nominal parameters that were refitted.
    fitted : callable
        ``fitted(system, parameters)`` fits a system to the training records.
    again : callable
        ``again(system, parameters)`` diagnoses it on the same records.
    """
    if found.remainder is None:
        return None
    ways = [(lump, moved) for lump in _worst(found.remainder, system) for moved in ways_to_split(system, lump)]
    tried = sorted(_fits(found.system, parameters, ways, fitted), key=lambda one: one[0].rms)
    for best, conductance in tried:
        split = _split(system, best.lump, best.moved, conductance)
        try:
            return _refinement(found, again(split.system, _shared(system, parameters, split)), split, best,
                               tuple(one for one, _ in tried))
        except (Diverged, InputError):  # this one runs away from the nominal values: the next
            continue
    return None


def _worst(rest: Remainder, system: System) -> list[str]:
    """Lumps of the user's network in which the remainder may sit, the most suspect first."""
    places = [(lump, share) for lump, share in rest.where if lump in system.lumps]
    return [lump for lump, share in places[:_LUMPS] if share >= _NEARLY * places[0][1]]


def _fits(system: System, parameters: Choice, ways: list[tuple[str, tuple[str, ...]]], fitted: Fitted
          ) -> Iterator[tuple[Split, float]]:
    """Every way with the residual of its fit, and the conductance between the parts."""
    for lump, moved in ways:
        try:
            split = _split(system, lump, moved)
            fit = fitted(split.system, _shared(system, parameters, split))
        except (Diverged, InputError):  # tied parameters cannot be halved, or the fit runs away
            continue
        yield Split(lump, moved, fit.rms), fit.system.parameter(split.conductance)


def _split(system: System, lump: str, moved: tuple[str, ...], conductance: float | None = None) -> SplitLump:
    """The split system, in whose fit table the parts may have capacities of their own."""
    split = split_lump(system, lump, moved, conductance=conductance)
    own, other = _capacities(split)
    one = system.fit.get(own)
    if one is None or one.sigma is not None:  # what is known of the sum is not known of the parts
        return split
    part = _of_part(one)
    return replace(split, system=split.system.model_copy(update={"fit": {**split.system.fit, own: part, other: part}}))


def _capacities(split: SplitLump) -> tuple[str, str]:
    own = f"lumps.{split.lump}.capacity"
    return own, split.twins[own]


def _of_part(whole: FitRange) -> FitRange:
    return FitRange(lower=_SMALLEST * whole.lower, upper=whole.upper)


def _shared(system: System, parameters: Choice, split: SplitLump) -> Choice:
    """The parameters to refit: capacities of the parts and the conductance between them are free, all else is tied.

    Parts of a lump whose capacity has a prior are halves.
    """
    ranges = chosen_ranges(system, parameters) if parameters is not None or system.fit else NONE
    out: dict[str | tuple[str, ...], FitRange] = {}
    for group, lower, upper, sigma in zip(ranges.members, ranges.lower, ranges.upper, ranges.sigma, strict=True):
        half = 0.5 if any(name in split.twins for name in group) else 1.0
        if half < 1.0 and len(group) > 1:
            raise InputError(f"{' = '.join(group)} are tied, and one of them is split", where="argument parameters",
                             remedy="Free them of each other.")
        if group == _capacities(split)[:1] and not math.isfinite(sigma):
            out |= dict.fromkeys(_capacities(split), _of_part(FitRange(lower=float(lower), upper=float(upper))))
            continue
        names = (group[0], split.twins[group[0]]) if half < 1.0 else group
        out[names if len(names) > 1 else names[0]] = FitRange(
            lower=half * float(lower), upper=half * float(upper), sigma=half * float(sigma) if math.isfinite(sigma) else
            None)
    g = split.system.parameter(split.conductance)
    return {**out, split.conductance: FitRange(lower=g / _RANGE, upper=g * _RANGE)}


def _refinement(found: Diagnosis, finer: Diagnosis, split: SplitLump, best: Split, tried: tuple[Split, ...]
                ) -> Refinement:
    before, after = ({kind: left(gap).rms for kind, gap in one.gap.items()} for one in (found, finer))
    helps = all(after[kind] ** 2 <= (1.0 - NEEDED) * before[kind] ** 2 for kind in before)
    value, std = _conductance(finer, split.conductance)
    kinds = " and ".join(f"from {before[kind]:.2g} to {after[kind]:.2g} K on the "
                         f"{'training' if kind == 'train' else kind} records" for kind in before)
    names = ", ".join(one.label for one in finer.effects)
    own, other = map(finer.system.parameter, _capacities(split))
    said = (f"{best} ({own:.3g} and {other:.3g} J/K, {value:.3g} ± {std:.2g} W/K between them): the remainder goes "
            f"{kinds}; the verdict is then {finer.verdict}" + (f", {names}" if names else "")
            + f". Best of {len(tried)} ways to split.")
    code = DiagnosisCode.FINER if helps else DiagnosisCode.NOT_FINER
    if helps and finer.verdict == "consistent" and found.effects:
        said += f" Without any effect: {', '.join(one.label for one in found.effects)} may stand for the split only."
    said = ("Splitting helps: " if helps else "Splitting a lump does not remove the remainder. The best is ") + said
    return Refinement(best=best, tried=tried, conductance=(value, std), before=before, after=after,
                      verdict=finer.verdict, effects=tuple(one.label for one in finer.effects), system=finer.system,
                      outcome=code.outcome(said))


def _conductance(found: Diagnosis, name: str) -> tuple[float, float]:
    """Between the parts, with its standard deviation [W/K]; its coordinate is a logarithm."""
    fit = found.fit if found.effects else found.nominal
    at = fit.structure.ranges.names.index(name)
    value = fit.system.parameter(name)
    return value, value * float(fit.covariance[at, at]) ** 0.5
