"""What changed between two days: stages and verdict."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from .._digits import downwards
from ..errors import Diverged, InputError, Outcome
from ..fitting import Choice
from ..thermal import System
from ._augment import Augmented
from ._judge import Judged, Progress, Validation, Verdict, alternatives
from ._outcomes import DiagnosisCode
from .change import (
    NAME,
    SIZE,
    Convection,
    Excess,
    Reference,
    Search,
    convection_of,
    excess_of,
    held,
    other_inputs,
    pinned,
    place_of,
    reference_of,
    searched,
    unsteady,
    visible_changes,
)
from .data import DataSet, Measured, as_measured, noise_floor, records_of, refuse_constant, without_outliers
from .evidence import Gap, adequacy, expected_rms, left, square_beyond_noise
from .fit import Refit, SessionGain, exact, refit, too_warm
from .search import SearchState, ShortList

Augment = Callable[[System], Augmented]
_NOISE_ONLY = 1.5  # whitened variance
_MOST = 0.95  # of what is outside the scatter, that changes must remove where they leave some of it
_NAMING: tuple[Verdict, ...] = ("named", "named_with_remainder", "ambiguous")
_COARSE = 5.0  # of the noise, that the model leaves of the reference records
_FARTHER = 3.0  # times what the unchanged model leaves of any reference record: more than those show
_CLOSED = 0.3  # of the excess rms of the validation records


@dataclass(frozen=True)
class Compared:
    """What the reference records say, as in ``diagnosis.json``.

    Parameters
    ----------
    records : int
        Number of reference records.
    rms : float
        Free-run residual of the common fit to them [K].
    remainder : float
        Part of it that is not noise [K].
    scatter : dict
        Standard deviation of every parameter of the fit from record to record, relative to it [-].
    deviation : dict
        How far every parameter of the new records is from the mean of the reference records, relative to it [-].
    visible : dict
        Where nothing has changed: the smallest relative decrease ("lower") and increase ("higher") of every parameter
        of the fit, and of the gain of every heater and module, that the new records would have shown with a chance of
        0.9 [-]; infinite where not even a large one.
    unchanged : dict
        Where nothing has changed: what the model of the reference records leaves of the "new" ones with its parameters
        as they are, and at most of one of the "reference" records [K].
    convection : Convection or None
        Losses taken as natural convection, as the reference records ask for; None where conductances are constant.
    augmented : Augmented or None
        What the reference records alone have added to the model, if that was asked for.
    other_inputs : tuple of str
        Columns that nothing in the model follows and that were elsewhere on the days of reference, a sentence each.

    Examples
    --------
    >>> import robthermal as rt
    >>> compared = rt.diagnosis.Compared(records=3, rms=0.12, remainder=0.08, deviation={"links.sink-room.conductance":
    ...     -0.5}, scatter={"links.sink-room.conductance": 0.03})
    >>> compared.deviation["links.sink-room.conductance"] / compared.scatter["links.sink-room.conductance"] < -4.0
    True
    """

    records: int
    rms: float
    remainder: float
    scatter: dict[str, float]
    deviation: dict[str, float]
    visible: dict[str, dict[str, float]] = field(default_factory=dict)
    unchanged: dict[str, float] = field(default_factory=dict)
    convection: Convection | None = None
    augmented: Augmented | None = None
    other_inputs: tuple[str, ...] = ()

    @property
    def caveats(self) -> tuple[str, ...]:
        """What the remainder of the reference records says against an answer, a sentence; none if it is small."""
        noise = math.sqrt(max(self.rms**2 - self.remainder**2, 0.0))
        if not self.remainder > _COARSE * noise:
            return self.other_inputs
        first = "" if self.augmented else (
            ": compare with the model that has what they name by themselves (augment), or diagnose one of them alone")
        return (f"The model leaves {self.remainder:.2g} K of the reference records together, noise would leave "
                f"{noise:.2g} K. Until it is better, effects at the same lump may stand for each other, a heat into it "
                f"for a weaker path out of it{first}.", *self.other_inputs)

    @property
    def beyond_reference(self) -> tuple[str, ...]:
        """That new records within the scatter are farther from the model than any reference record, a sentence."""
        new, most = self.unchanged.get("new", 0.0), self.unchanged.get("reference", math.inf)
        if not new > _FARTHER * most:
            return self.other_inputs
        return (*self.other_inputs, (
            f"The model of the reference records leaves {new:.2g} K of the new records and at most {most:.2g} K of a "
            "reference record: numbers that differ by a few per cent from day to day would do that, and that they do "
            f"is assumed beside no more than {self.records} reference record{'s' * (self.records > 1)}, which show "
            "less. More of them would tell whether something has changed."))

    def to_dict(self) -> dict[str, Any]:
        """What ``diagnosis.json`` holds under "reference"; null for a change that is not seen at all.

        Returns
        -------
        dict
        """
        visible = {name: {way: size if math.isfinite(size) else None for way, size in sizes.items()}
                   for name, sizes in self.visible.items()}
        model = {key: one.to_dict() for key, one in (("convection", self.convection), ("augmented", self.augmented))
                 if one is not None}
        known = {key: value for key, value in vars(self).items()
                 if key not in ("visible", "unchanged", "convection", "augmented", "other_inputs")}
        where_seen = {"visible": visible} if visible else {}
        return {**known, **where_seen, **({"unchanged": self.unchanged} if self.unchanged else {}), **model}


def changed(system: System, records: Measured | Sequence[Measured], reference: Measured | Sequence[Measured], *,
            validation: Validation, parameters: Choice, names: Iterable[str] | None,
            noise: Mapping[str, float] | float | None, session_gain: SessionGain, augment: Augment | None,
            progress: Progress) -> tuple[Judged, Compared]:
    """Compare new records with those of a healthy machine.

    Parameters
    ----------
    system : System
        Nominal system of all records.
    records, reference : Record or list of them
        The new ones, and those of the healthy machine.
    validation : Validation
        Data of the new day that no fit has seen.
    parameters, noise, session_gain
        As in `rt.diagnose`.
    names : iterable of str, optional
        Effects of the catalog to try; default all.
    augment : callable, optional
        ``augment(system)`` adds what the reference records alone name.
    progress : callable
        Called with a sentence before every stage.
    """
    later = as_measured(system, records, "records")
    _refuse_same(as_measured(system, reference, "reference"), later)
    refuse_constant(system, records_of(later))
    floor = noise_floor(system, records, noise=noise)
    elsewhere = other_inputs(system, records_of(later), records_of(as_measured(system, reference, "reference")))

    def losses(of: System) -> Convection | None:
        if parameters is not None or not system.fit:
            return None
        progress("asking the reference records whether losses are by natural convection")
        return _losses(of, reference, noise, session_gain)

    law = losses(system)
    model, added, chosen = system if law is None else law.system, None, parameters
    if augment is not None:
        added = augment(model)
        model, chosen = added.system, added.parameters
        if law is None and added.effects and (law := losses(model)) is not None:
            model = law.system

    def compared(warmest: bool) -> tuple[Judged, Compared]:
        progress("fitting the reference records, and measuring how they differ")
        healthy = reference_of(model, reference, [one.record for one in records_of(later)], parameters=chosen,
                               noise=noise, session_gain=session_gain, warmest=warmest)
        progress("comparing the new records with them")
        new = held(healthy.fit, healthy.scatter, without_outliers(system, later, floor.noise), floor)
        progress("trying every change of a parameter, and every effect of the catalog")
        found = searched(new, healthy, names)
        judged = _judged(found, new, healthy, validation)
        said = replace(_compared(healthy, found.fit), convection=law, augmented=added, other_inputs=elsewhere)
        if judged.verdict != "consistent":
            return judged, said
        seen = visible_changes(new, healthy, found)
        most = max(pinned(one).rms for one in healthy.each)
        return judged, replace(said, visible={one.name: {"lower": one.lower, "higher": one.higher} for one in seen},
                               unchanged={"new": judged.state.nominal.rms, "reference": most})

    answer = compared(warmest=False)
    if not too_warm(answer[0].state.fit):
        return answer
    progress("once more, with rooms no warmer than beside a machine that is only heated")
    return compared(warmest=True)


def _losses(system: System, reference: Measured | Sequence[Measured], noise: Mapping[str, float] | float | None,
            session_gain: SessionGain) -> Convection | None:
    """Losses by natural convection, where the reference records ask for them and can be fitted at all."""
    try:
        floor = noise_floor(system, reference, noise=noise)
        return convection_of(system, lambda other: refit(other, reference, floor, session_gain=session_gain))
    except (Diverged, InputError):  # conductances stay; records that cannot be compared, either, are refused there
        return None


def _compared(healthy: Reference, new: Refit) -> Compared:
    fit, ranges = exact(healthy.fit), healthy.listed
    moved = new.v[:new.structure.n_parameters] - healthy.scatter.center
    for candidate, values in zip(new.structure.effects, new.structure.quantities(new.v), strict=True):
        if candidate.effect.name == NAME:
            place = place_of(candidate.where, ranges)
            number = new.v[place]  # itself where its coordinate is linear, and a change a factor on it
            moved[place] += values[SIZE] if ranges.logarithmic[place] else number * np.expm1(values[SIZE])
    moved = moved[:len(ranges.names)]
    deviation = np.where(ranges.logarithmic, np.expm1(moved), moved / healthy.whole)
    return Compared(len(healthy.each), fit.rms, float(np.sqrt(square_beyond_noise(fit))), healthy.relative,
                    dict(zip(ranges.names, map(float, deviation), strict=True)))


def _judged(found: Search, new: Refit, healthy: Reference, validation: Validation) -> Judged:
    before, fit = pinned(new), found.fit
    state = SearchState(nominal=before, names=None, scores=found.scores, fit=fit if found.rounds else exact(before),
                        current=found.scores, short=ShortList(fit, (), {}), rounds=found.rounds, complete=True)
    held_out = validation.predicted(before, state.fit)
    excess = excess_of(fit, healthy)
    gaps = [Gap(before.rms, fit.rms, expected_rms(exact(fit)))] + ([] if held_out is None else [held_out.gap])
    listed = all(round_.best.candidate.effect.name == NAME for round_ in found.rounds)
    why = _short_of(excess, excess.removed(excess_of(before if listed else new, healthy)), gaps[1:])
    verdict, outcome = _verdict(found, excess, gaps, bool(why), healthy, _bare(fit, healthy))
    moving = unsteady(fit, found.rounds, healthy) if verdict in _NAMING else []
    if moving:
        verdict, outcome = "unexplained", DiagnosisCode.UNEXPLAINED.outcome(_nothing_explains(healthy))
        why = (f"{' and '.join(moving)} {'has' if len(moving) == 1 else 'have'} another size in every part of the "
               "record, where the same on healthy records stays: something drifts or comes and goes")
    return Judged(state=state, adequacy=adequacy(state.fit), hold_out=held_out, verdict=verdict, outcome=outcome,
                  plain=exact(fit) if verdict in _NAMING else None, compared=True,
                  why=why if verdict == "unexplained" else "")


def _short_of(excess: Excess, removed: float, validation: Sequence[Gap]) -> str:
    """What keeps accepted changes from being an answer, in words that follow "because"; empty if nothing does."""
    if excess.reasons and removed < _MOST:
        share = downwards(100.0 * max(removed, 0.0), 3)
        return (f"{share} % of what is outside the scatter of the reference records is gone, less than "
                f"{100.0 * _MOST:.0f} %, and what is left is still outside")
    if not all(left(gap).share_explained >= 1.0 - (1.0 - _CLOSED) ** 2 for gap in validation):
        return f"on the validation records less than {100.0 * _CLOSED:.0f} % of the error beyond noise is gone"
    return ""


def _refuse_same(reference: Sequence[DataSet], new: Sequence[DataSet]) -> None:
    for one in new:
        if any(np.array_equal(one.readings, old.readings) for old in reference):
            raise InputError(f"the new record {one.label!r} is among the reference records", where="argument reference",
                             expected="records of the healthy machine, from other days",
                             remedy="Leave it out there: it would be compared with itself.")


def _bare(fit: Refit, healthy: Reference) -> bool:
    """Whether the noise alone is left, on the reference records and on the new ones."""
    return (healthy.scatter.inflation < _NOISE_ONLY and fit.variance < _NOISE_ONLY and adequacy(fit).outcome.ok
            and all(one.variance < _NOISE_ONLY for one in healthy.each))


def _verdict(found: Search, excess: Excess, gaps: Sequence[Gap], short: bool,
             healthy: Reference, bare: bool) -> tuple[Verdict, Outcome]:
    reasons = " ".join(excess.reasons)
    if not found.rounds and not reasons:
        text = ("Nothing has changed that the new records would show: they are within the scatter of the reference "
                "records.")
        return "consistent", DiagnosisCode.CONSISTENT.outcome(text)
    if not found.rounds or short:
        text = " ".join(filter(None, [_nothing_explains(healthy), reasons, "" if found.rounds else found.nearest]))
        return "unexplained", DiagnosisCode.UNEXPLAINED.outcome(text)
    if any(map(alternatives, found.rounds)):
        return "ambiguous", DiagnosisCode.AMBIGUOUS.outcome("The new records cannot distinguish some changes.")
    if (reasons or not bare) and any(left(gap).rms for gap in gaps):
        return "named_with_remainder", DiagnosisCode.NAMED_WITH_REMAINDER.outcome(
            "One set of changes explains what is outside the scatter of the reference records; what is left beyond the "
            f"noise is stated, and has no name. {reasons}".rstrip())
    return "named", DiagnosisCode.NAMED.outcome("One set of changes explains the new records.")


def _nothing_explains(healthy: Reference) -> str:
    """What was tried; without parameters of a fit table no change of one was."""
    if healthy.listed.names:
        return "Something has changed; no change of a parameter and no effect of the catalog explains it."
    return ("Something has changed; no effect of the catalog explains it, and no change of a parameter was tried: none "
            "is fitted.")

