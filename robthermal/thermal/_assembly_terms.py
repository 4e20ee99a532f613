"""The nonlinear terms of a system, with nodes and columns numbered."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ._drives import Drives
from ._effect_terms import CondensationTerm, FollowTerm, HeaterTerm, LeadTerm, StepTerm
from ._module_term import ModuleTerm, RippleTerm
from ._parts import Link
from ._terms import Array, Indices, NaturalTerm, PowerTerm, RadiationTerm, Term

if TYPE_CHECKING:
    from ._system import System

Index = Mapping[str, int]


def terms_of(system: System, index: Index, drives: Drives) -> tuple[Term, ...]:
    """Terms that are present: the modules' first."""
    found: list[Term] = []
    if system.modules:
        found.append(_modules(system, index, drives))
    if drives.ripples:
        found.append(_ripples(system, index, drives))
    found.extend(_links(system, index, drives))
    found.extend(_effects(system, index, drives))
    return tuple(found)


def _modules(system: System, index: Index, drives: Drives) -> ModuleTerm:
    modules = list(system.modules.values())
    return ModuleTerm(
        components=tuple(system.modules), a=_indices(index[m.hot] for m in modules),
        b=_indices(index[m.cold] for m in modules), drive=_indices(drives.column[name] for name in system.modules),
        supply_index=np.arange(len(modules)),
        S=np.array([m.seebeck.value for m in modules]), S_slope=np.array([m.seebeck.slope for m in modules]),
        R=np.array([m.resistance.value for m in modules]), R_slope=np.array([m.resistance.slope for m in modules]),
        K_slope=np.array([m.conductance.slope for m in modules]),
        T_ref=np.array([m.reference_temperature for m in modules]),
        thomson=np.array([m.thomson for m in modules]), split=np.array([m.joule_split for m in modules]))


def _ripples(system: System, index: Index, drives: Drives) -> RippleTerm:
    modules = [system.modules[name] for name in drives.ripples]
    none = np.zeros(len(modules))
    return RippleTerm(
        components=tuple(drives.ripples), a=_indices(index[m.hot] for m in modules),
        b=_indices(index[m.cold] for m in modules), drive=_indices(drives.ripples.values()),
        supply_index=_indices(system.module_names.index(name) for name in drives.ripples), S=none, S_slope=none,
        R=np.array([m.resistance.value for m in modules]), R_slope=np.array([m.resistance.slope for m in modules]),
        K_slope=none, T_ref=np.array([m.reference_temperature for m in modules]), thomson=none,
        split=np.array([m.joule_split for m in modules]))


def _links(system: System, index: Index, drives: Drives) -> list[Term]:
    found: list[Term] = []
    natural = [link for link in system.links if link.natural is not None]
    if natural:
        gains = [(link.natural.gain, link.natural.exponent) for link in natural if link.natural]
        found.append(NaturalTerm(_names(natural), *_ends(natural, index), *_warmer(system, natural),
                                 *np.array(gains, float).T))
    radiating = [link for link in system.links if link.radiation is not None]
    if radiating:
        found.append(RadiationTerm(_names(radiating), *_ends(radiating, index), *_warmer(system, radiating),
                                   np.array([link.radiation for link in radiating], float)))
    lawful = [(link, link.temperature_law) for link in system.links if link.temperature_law is not None]
    if lawful:
        own = [link for link, _ in lawful]
        found.append(PowerTerm(_names(own), *_ends(own, index), *_warmer(system, own),
                               np.array([link.conductance for link in own]),
                               np.array([law.exponent for _, law in lawful]),
                               np.array([law.reference_temperature for _, law in lawful])))
    stepping = [link for link in system.links if link.step is not None]
    if stepping:
        warmer_a, warmer_b = _warmer(system, stepping)
        found.append(StepTerm(_names(stepping), *_ends(stepping, index),
                              _indices(drives.steps[link.name] for link in stepping),
                              np.array([link.conductance for link in stepping]),
                              np.array([link.step.relative for link in stepping if link.step]), warmer_b - warmer_a))
    following = [link for link in system.links if link.follow is not None]
    if following:
        warmer_a, warmer_b = _warmer(system, following)
        found.append(FollowTerm(_names(following), *_ends(following, index),
                                _indices(drives.column[link.follow.column] for link in following if link.follow),
                                np.array([link.conductance for link in following]),
                                np.array([link.follow.relative for link in following if link.follow]),
                                warmer_b - warmer_a))
    return found


def _effects(system: System, index: Index, drives: Drives) -> list[Term]:
    found: list[Term] = []
    heaters = {name: heater for name, heater in system.inputs.items() if heater.power_slope is not None}
    if heaters:
        through = [(h.feedthrough.lump, h.feedthrough.share) if h.feedthrough else (h.lump, 0.0)
                   for h in heaters.values()]
        found.append(HeaterTerm(
            components=tuple(heaters), a=_indices(index[h.lump] for h in heaters.values()),
            b=_indices(index[lump] for lump, _ in through), drive=_indices(drives.column[name] for name in heaters),
            supply_index=_indices(system.input_names.index(name) for name in heaters),
            gain=np.array([h.gain for h in heaters.values()]),
            slope=np.array([h.power_slope for h in heaters.values()], float),
            share=np.array([share for _, share in through]),
            T_ref=next(iter(system.ambients.values())).temperature))
    if system.leads:
        found.append(LeadTerm(_names(system.leads), _indices(index[lead.lump] for lead in system.leads),
                              _indices(drives.column[lead.module] for lead in system.leads),
                              _indices(system.module_names.index(lead.module) for lead in system.leads),
                              np.array([lead.resistance for lead in system.leads])))
    wet = {name: lump.condensation for name, lump in system.lumps.items() if lump.condensation is not None}
    if wet:
        found.append(CondensationTerm(tuple(wet), _indices(index[name] for name in wet),
                                      np.array([c.conductance for c in wet.values()]),
                                      np.array([c.dew_point for c in wet.values()])))
    return found


def _indices(numbers: object) -> Indices:
    return np.array(list(numbers), np.intp)  # type: ignore[call-overload]  # any iterable of numbers


def _names(parts: Sequence) -> tuple[str, ...]:
    return tuple(part.name for part in parts)


def _ends(links: Sequence[Link], index: Index) -> tuple[Indices, Indices]:
    return _indices(index[link.between[0]] for link in links), _indices(index[link.between[1]] for link in links)


def _warmer(system: System, links: Sequence[Link]) -> tuple[Array, Array]:
    """By how much the ambient at each end is warmer than nominal to the lump at the other end [K]."""
    def seen(end: str, other: str) -> float:
        return system.lumps[other].gradient if end in system.ambients else 0.0
    return (np.array([seen(*link.between) for link in links]), np.array([seen(*link.between[::-1]) for link in links]))
