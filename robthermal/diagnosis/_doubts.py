"""What to hold against an answer, and what it says of ambients that were not recorded, a sentence each."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from scipy.constants import Stefan_Boltzmann

from .._celsius import ZERO_CELSIUS
from ..thermal import System, parameter_in_words
from ._found import Found
from ._judge import Name, Verdict
from .effects import AMBIENT_DRIFT, Candidate
from .evidence import PREDICTED
from .fit import FoundAmbient, Refit, found_ambients
from .search import MASSES, Accepted, other_periods

_LIKE_THE_ROOM = ("heat_source", "ambient_gradient")  # constants that a warmer or colder room gives too
_SURE, _FAR = 3.0, 1.0  # standard deviations, and K: a room farther from what the system says may be something else
_NOISIER = 1.6  # times what is declared; 1.4 times is allowed for
_LISTED = 4  # records by name


def doubts(system: System, remainder: bool) -> list[str]:
    """What to hold against a name beside a remainder, from the suite of foreign truth.

    Parameters
    ----------
    system : System
        Nominal system that was diagnosed.
    remainder : bool
        Whether a name stands beside a remainder.
    """
    if not system.modules or not remainder:
        return []
    return ["A module has no inside of its own in this test. Of 95 simulated stacks with a module that got a name, "
            "five got a wrong one, which does not exclude one in eight: confirm this name on the machine."]


def nothing_fitted(nominal: Refit, verdict: Verdict) -> list[str]:
    """That all numbers were taken as right where something is missing, a sentence; none with a fit table.

    Parameters
    ----------
    nominal : Refit
        Fit of the nominal system that was diagnosed.
    verdict : str
        Of the answer.
    """
    if verdict == "consistent" or not nominal.takes_all_as_right:
        return []
    return ["The system has no fit table, so its numbers were taken as right: a wrong one can pass for what is "
            "missing. Put what is not known for certain under [fit], with its range."]


def at_bounds(fit: Refit, verdict: Verdict) -> list[str]:
    """Numbers that the fit with the answer puts at an end of their range, a sentence; an end of 0 is no choice.

    Parameters
    ----------
    fit : Refit
        Fit with all that was accepted.
    verdict : str
        Of the answer.
    """
    ranges = fit.structure.ranges
    values = ranges.values(fit.v[:fit.structure.n_parameters])
    ended = []
    for i in np.flatnonzero(ranges.at_bound(values)):
        low = values[i] - ranges.lower[i] < ranges.upper[i] - values[i]
        end = ranges.lower[i] if low else ranges.upper[i]
        if end:
            what = " and ".join(map(parameter_in_words, ranges.members[i]))
            ended.append(f"{what} at its {'lower' if low else 'upper'} end, {end:.4g}")
    if verdict == "consistent" or not ended:
        return []
    return [f"The fit puts {', '.join(ended)}: the range in [fit] is too narrow, or something that the model lacks "
            "pulls it there. Widen it, or doubt what is named beside it."]


def noise_above_declared(fit: Refit, verdict: Verdict) -> list[str]:
    """Where sensors are noisier than declared and nothing else is seen in what is left, a sentence.

    The tests of what is left ask for its shape: white noise of any size passes them.

    Parameters
    ----------
    fit : Refit
        Fit with all that was accepted, whose levels are at their limit.
    verdict : str
        Of an answer without a remainder.
    """
    if verdict == "unexplained" or not fit.levels.sensors_exhausted:
        return []
    found = []
    for name, declared in fit.floor.noise.items():
        z = [own[:, one.sensors.index(name)] for own, one in zip(fit.innovations(), fit.structure.data, strict=True)
             if name in one.sensors]
        left = declared * fit.levels.noise.get(name, 1.0) * float(np.sqrt(np.mean(np.concatenate(z) ** 2)))
        if left > _NOISIER * declared:
            unit = fit.floor.units.get(name, "K")
            found.append(f"{left:.2g} {unit} are left at {name}, where {declared:.2g} {unit} are declared")
    if not found:
        return []
    return [f"{'; '.join(found)}: to these records that is noise. Declare it, if the sensor has as much; if it has "
            "less, something is missing that they do not show."]


def place_undecided(effects: Sequence[Name], alternatives: Sequence[Sequence[Name]]) -> list[str]:
    """Where one heat path is named and the records do not tell to which of neighboring lumps it goes, a sentence each.

    Parameters
    ----------
    effects : sequence of tuple
        Named effects with their places.
    alternatives : sequence of sequence of tuple
        The same effect at neighboring lumps, for each of them.
    """
    said = []
    for (name, where), others in zip(effects, alternatives, strict=True):
        if others and name in MASSES:
            listed = " or ".join(f"hangs on {at[0]}" if one == MASSES[0] else f"lies within the path {at[0]}"
                                 for one, at in ((name, where), *others))
            said.append(f"The records do not tell whether this mass {listed}: one answer, because where a lump ends is "
                        "the model's choice. The augmented model has the first.")
        elif others:
            places = " or between ".join(" and ".join(at) for at in (where, *(at for _, at in others)))
            said.append(f"The records do not tell whether this path goes between {places}: neighboring lumps are one "
                        "answer, because where a lump ends is the model's choice. The augmented model has the first.")
    return said


def surfaces(effects: Sequence[Found]) -> list[str]:
    """How large a surface must be that radiates as much as is named, a sentence each.

    A conductance to surroundings that the file lacks, or a second radiating lump, can hide in its coefficient; an area
    is what a user can look up.

    Parameters
    ----------
    effects : sequence of Found
        Named effects with their sizes.
    """
    return [f"Radiation of this size between {' and '.join(one.where)} needs a surface of at least "
            f"{_area(one.values['coefficient'][0])} (black): if {one.where[0]} has less, another loss hides in it."
            for one in effects if one.effect == "radiation" and "coefficient" in one.values]


def _area(coefficient: float) -> str:
    """Of a black surface with this coefficient [W/K⁴]."""
    square_meters = coefficient / Stefan_Boltzmann
    size, unit = (square_meters, "m²") if square_meters >= 0.1 else (1e4 * square_meters, "cm²")
    return f"{float(f'{size:.2g}'):g} {unit}"


def within_the_body(system: System, effects: Sequence[Name]) -> list[str]:
    """Where a lag is named beside a remainder: lumps whose body may take that time itself, in a sentence.

    Parameters
    ----------
    system : System
        With the lumps of heaters and sensors.
    effects : sequence of tuple
        Named effects with their places, and what the records cannot tell from them.
    """
    lumps = [system.inputs[where[0]].lump if name == "input_lag" else system.sensors[where[0]].lump
             for name, where in effects  # a module heats two lumps at once
             if name == "sensor_lag" or (name == "input_lag" and where[0] in system.inputs)]
    at = " or ".join(dict.fromkeys(filter(None, lumps)))
    return [f"A lag at {at} may also be the time that heat takes within {at}, from where it enters to the "
            f"thermometer: see whether a network with {at} split in two does as well."] if at else []


def confirmed(effects: Iterable[Found]) -> list[str]:
    """Effects that are named because they predict another day, though they do not hold over parts of the training one.

    Parameters
    ----------
    effects : iterable of Found
        Named effects, with their evidence.
    """
    return [f"Over parts of the training records {one.label} does not hold; it is named because it takes "
            f"{100.0 * one.evidence.predicted:.0f} % off what the validation records have without it."
            for one in effects if one.evidence is not None and one.evidence.predicted >= PREDICTED]


def which_is_off(system: System, effects: Sequence[Name]) -> list[str]:
    """Where an offset of a thermometer is named beside a remainder and there are others, a sentence each.

    Only the difference of two thermometers shows beside heats that the model has a little wrong: a measured Peltier
    cell left 0.50 K with one of its two thermocouples off, and 0.52 K with the other one off the other way.

    Parameters
    ----------
    system : System
        With its thermometers.
    effects : sequence of tuple
        Named effects with their places.
    """
    off = [where[0] for name, where in effects if name == "sensor_offset" and where[0] in system.thermometers]
    return [f"Whether {one} is off, or the other thermometers the other way, a model that leaves so much cannot say: "
            "compare them at rest, with nothing driven." for one in off] if len(system.thermometers) > 1 else []


def periods_undecided(rounds: Sequence[Accepted], remainder: bool) -> list[str]:
    """Where records of different times leave several periods possible, a sentence each.

    Parameters
    ----------
    rounds : sequence of Accepted
        Accepted effects, each with the fit before it.
    remainder : bool
        Whether something is left beyond the noise.
    """
    said = []
    for round_ in rounds:
        candidate, found = round_.best.candidate, round_.best.found
        if not candidate.effect.paired:
            continue
        shape = {name: value for name, value in found.items() if name != candidate.effect.size.name}
        others = other_periods(round_.before, replace(candidate, shape=shape), remainder)
        if others:
            listed = " or ".join(f"{period:.4g} s" for period in others[:_LISTED])
            said.append(f"The period of {candidate.label} is {shape['period']:.4g} s, or as well {listed}: the records "
                        "do not tell how many periods went by between them. A longer record does.")
    return said


def may_be_the_room(nominal: Refit, effects: Sequence[Candidate]) -> list[str]:
    """Which effects may be an ambient that was not recorded, or are inferred of it.

    A constant heat into a lump that is joined to it may be the ambient. That it swings or drifts is a candidate itself.

    Parameters
    ----------
    nominal : Refit
        Fit of the nominal system that was diagnosed.
    effects : sequence of Candidate
        Effects that were accepted, provisional ones included.
    """
    said = []
    for room in nominal.unrecorded:
        joined = {end for link in nominal.system.links if room in link.between for end in link.between}
        labels = [one.label for one in effects if one.effect.name in _LIKE_THE_ROOM and one.where[0] in joined]
        if labels:
            said.append(f"The temperature of {room} was not recorded: {', '.join(labels)} may be {room} itself, "
                        "warmer or colder than the system says, or drifting. Record it.")
        if any(one.effect.name == AMBIENT_DRIFT and one.where == (room,) for one in effects):
            said.append(f"That {room} drifts is read off other temperatures: record it.")
    return said


def may_be_a_coolant(system: System, effects: Sequence[Candidate]) -> list[str]:
    """Where heat gets from one lump to another that one ambient cools: it may flow past them, a sentence.

    Parameters
    ----------
    system : System
        Nominal system, whose ambients may say which lumps they pass.
    effects : sequence of Candidate
        What was added to it.
    """
    for one in effects:
        pair = {"missing_link": one.where, "input_feedthrough": (_heated(system, one.where[0]), one.where[-1])
                }.get(one.effect.name, ())
        both = {_cooled_by(system, lump) for lump in pair if lump in system.lumps}
        ambient = both.pop() if len(both) == 1 else ""
        if ambient and not system.ambients[ambient].coolant:
            listed = ", ".join(f'"{lump}"' for lump in system.lumps if _cooled_by(system, lump) == ambient)
            return [f"{' and '.join(pair)} are cooled by {ambient} before all: if it flows from one to the other, it "
                    f"carries heat there, which looks like {one.label}. Say so with coolant = [{listed}], in the order "
                    f"of the flow, in [ambients.{ambient}], and diagnose again."]
    return []


def _heated(system: System, heater: str) -> str:
    return system.inputs[heater].lump if heater in system.inputs else ""


def _cooled_by(system: System, lump: str) -> str:
    """The ambient that takes more of its heat than anything else does; "" if another lump does."""
    paths = [(link.conductance, end) for link in system.links if lump in link.between
             for end in link.between if end != lump]
    strongest = max(paths, default=(0.0, ""))[1]
    return strongest if strongest in system.ambients else ""


def may_be_the_supply(system: System, effects: Sequence[Candidate]) -> list[str]:
    """Which swings of heat may be the supply of a heater of their lump, a sentence each.

    Parameters
    ----------
    system : System
        With the lumps of its heaters.
    effects : sequence of Candidate
        Effects that were accepted, provisional ones included.
    """
    said = []
    for one in effects:
        heaters = [name for name, own in system.inputs.items() if own.gain and own.lump == one.where[0]]
        if one.effect.paired and heaters:
            said.append(f"{one.label} may be the supply of {' or '.join(heaters)}, whose power changes by twice what "
                        "its voltage does: record the voltage, and give the power as the column.")
    return said


def ambients_in_words(found: Sequence[FoundAmbient], system: System) -> list[str]:
    """What the readings say of ambients that were not recorded, a sentence each.

    Parameters
    ----------
    found : sequence of FoundAmbient
        One per ambient and record.
    system : System
        System whose unit of temperature is used.
    """
    said = []
    for name in dict.fromkeys(one.ambient for one in found):
        own = [one for one in found if one.ambient == name]
        values = ", ".join(f"{_shown(one.value, system)} ± {one.std:.2g} K in {one.record!r}" for one in own[:_LISTED])
        if len(own) > _LISTED:
            values = (f"{_shown(min(one.value for one in own), system)} to "
                      f"{_shown(max(one.value for one in own), system)} in {len(own)} records")
        said.append(f"The temperature of {name} was not recorded, and is an unknown of every record: {values}; the "
                    f"system says {_shown(own[0].declared, system)}.")
    return said


def held_ambients(nominal: Refit) -> list[str]:
    """What was assumed of ambients that readings would put above what a heated machine allows, a sentence each.

    Parameters
    ----------
    nominal : Refit
        Fit of the nominal system that was diagnosed.
    """
    if not nominal.structure.only_heated:
        return []
    warmest: dict[str, float] = {}
    for one in found_ambients(nominal):
        warmest[one.ambient] = min(one.warmest, warmest.get(one.ambient, one.warmest))
    return [f"Left free, {room} came out warmer than the machine's coolest readings, though it is only heated; this "
            f"answer assumes that {room} stood still, at no more than {_shown(most, nominal.system)}: the coolest "
            f"reading and 1 K. A machine brought in from the cold is another matter: record {room}."
            for room, most in warmest.items()]


def may_drift(nominal: Refit) -> list[str]:
    """Where nothing explains the records: ambients that may be what is missing, a sentence each.

    Parameters
    ----------
    nominal : Refit
        Fit of the nominal system that was diagnosed.
    """
    return [f"The temperature of {room} was not recorded: that it swings, drifts or jumps may be part of what is "
            "missing. Record it." for room in nominal.unrecorded]


def far_ambients(found: Sequence[FoundAmbient], system: System) -> list[str]:
    """Ambients that come out so far from what the system says that something else may be the cause, a sentence each.

    Parameters
    ----------
    found : sequence of FoundAmbient
        One per ambient and record.
    system : System
        System with the links of the ambients.
    """
    said = []
    for name in dict.fromkeys(one.ambient for one in found):
        differences = [one.value - one.declared for one in found if one.ambient == name
                       and abs(one.value - one.declared) > max(_FAR, _SURE * one.std)]
        if differences:
            most = max(differences, key=abs)
            joined = sorted({end for link in system.links if name in link.between for end in link.between} - {name})
            warmer = "warmer" if most > 0 else "colder"
            said.append(f"The readings ask for a {name} {abs(most):.2g} K {warmer} than the system says. A constant "
                        f"heat into {' or '.join(joined)}, or an offset of the sensors, may be the cause as well: "
                        f"record {name}.")
    return said


def _shown(kelvin: float, system: System) -> str:
    if system.temperature_unit == "degC":
        return f"{kelvin - ZERO_CELSIUS:.4g} °C"
    return f"{kelvin:.5g} K"
