"""`diagnose`: all stages in a row."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial

from threadpoolctl import threadpool_limits

from ..errors import InputError
from ..fitting import Choice, measured_of
from ..thermal import System
from ._alone import predicting_best
from ._augment import augmented
from ._changed import Compared, changed
from ._doubts import (
    ambients_in_words,
    at_bounds,
    confirmed,
    doubts,
    far_ambients,
    held_ambients,
    may_be_a_coolant,
    may_be_the_room,
    may_be_the_supply,
    may_drift,
    noise_above_declared,
    nothing_fitted,
    periods_undecided,
    place_undecided,
    surfaces,
    which_is_off,
    within_the_body,
)
from ._each_record import asked_of_each
from ._either_way import either_way, either_way_in_words
from ._finer_network import unless_finer
from ._found import Found
from ._graded import graded, lasting_beyond_steps
from ._held_room import asks_for_a_held_room, held_alike, unless_worse
from ._judge import Judged, Name, Progress, Validation, alternatives, judge, reconsider_noise, without_names_of_noise
from ._lasting import evidence_of
from ._late_commands import late_by_rows
from ._misread_inputs import MisreadRows
from ._nearest import nearest
from ._one_curve import share_one_curve
from ._other_log import asked_of_log
from ._own_names import in_own_names
from ._refine import refine as refined
from ._searching import searched
from ._steep_power import falling_powers, steep_powers
from ._visible_words import visible_in_words
from ._wandering_room import beside_a_wandering_room
from ._with_names import ranged
from ._wrong_columns import asked_of_columns
from .change import NAME, relative
from .data import Measured, as_measured, noise_floor, refuse_constant, refuse_long, with_recorded_units
from .diagnosis import Diagnosis
from .effects import candidates
from .evidence import (
    Evidence,
    Gap,
    Remainder,
    deviations,
    expected_rms,
    left,
    locate,
    refuse_seen,
    remainder,
    unknown_heat,
)
from .fit import Refit, SessionGain, exact, found_ambients, lag_name, only_heated, refit, too_warm
from .plan import NextExperiment, next_experiment, resolving, rivals, trial_conditions
from .search import Accepted, SearchState, quantities_of


@threadpool_limits.wrap(limits=1, user_api="blas")  # products are small: threads only wait for each other
def diagnose(system: System, records: Measured | Sequence[Measured], *,
             validation: Measured | Sequence[Measured] | None = None,
             parameters: Choice = None, effects: Iterable[str] | None = None,
             noise: Mapping[str, float] | float | None = None, operating_point: Mapping[str, float] | None = None,
             session_gain: SessionGain = False, reference: Measured | Sequence[Measured] | None = None,
             augment: bool = False, refine: bool = False, progress: Progress = lambda stage: None) -> Diagnosis:
    """Find where records and simulation part, name the missing effect, add it, and test it on validation records.

    Parameters
    ----------
    system : System
        Nominal: `noise` of its sensors, `disturbance` of its lumps, `sigma` of its fit table say what is known.
    records : Record, FrequencyResponse, or list of them
        Measured. Records may come from a closed loop. Of a frequency response (from `rt.identify`, with its covariance)
        the linearization at `operating_point` is compared.
    validation : Record, FrequencyResponse, or list of them, optional
        Not seen by any fit. They test the prediction, may take a name back, and may resolve sets of alternatives.
    parameters : iterable or mapping, optional
        Nominal parameters to refit, as in `rt.calibrate`. Default: the fit table; without one they are taken as known.
    effects : iterable of str, optional
        Names of the catalog to try; default all, your own registered ones included.
    noise : mapping or float, optional
        Overrides the declared noise of the sensors [K].
    operating_point : mapping, optional
        For frequency responses: mean heaters [unit], module currents [A] and ambients [K] of the experiment; default
        off and nominal.
    session_gain : bool or mapping
        Records from several days: every record has a gain of its own of every heater and module. True: with a prior of
        5 %; a mapping from input to the standard deviation of its gain [-].
    reference : Record or list of them, optional
        Of the healthy machine, on days of their own. Then the question is what has changed since: every parameter of
        the fit table may have another value (`parameter_change`), and a change counts beyond the scatter among these
        records.
    augment : bool
        With `reference`: diagnose the reference records alone first, and compare with the model that has what they
        name: the first is fitted, the others are held out. Takes about twice as long.
    refine : bool
        Where something is left beyond the noise, split the lump in which it sits in two, and diagnose again: what that
        does is `refinement`. Takes about twice as long, and some seconds for every way to split.
    progress : callable, optional
        Called with a sentence before every stage.

    Returns
    -------
    Diagnosis

    Raises
    ------
    InputError
        Records too short or of more than 400 000 readings, readings that never change, validation on the training
        data, no noise declared and none visible, a nominal model that runs away, an unknown effect.

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 100.0}},
    ...                 links=[{"between": ("bar", "room"), "conductance": 0.5}], inputs={"heater": {"lump": "bar"}},
    ...                 sensors={"T": {"lump": "bar", "noise": 0.05}})
    >>> late = bar.with_parameters({"sensors.T.time_constant": 30.0})
    >>> def measured(seed):
    ...     rng = np.random.default_rng(seed)
    ...     drive = rt.Record(sample_time=10.0, inputs=np.repeat(rng.uniform(0.0, 6.0, 12), 25),
    ...                       outputs=np.zeros((300, 0)), input_names=["heater"], output_names=[])
    ...     run = rt.thermal.simulate(late, drive)
    ...     return run.with_outputs(run.outputs + 0.05 * rng.standard_normal((300, 1)))
    >>> found = rt.diagnose(bar, measured(1), validation=measured(2), effects=["sensor_lag", "sensor_offset"])
    >>> found.verdict, found.effects[0].label
    ('named', 'sensor_lag(T)')
    """
    names = None if effects is None else tuple(effects)
    refuse_long(records, "records")
    system = with_recorded_units(system, records)
    checked = Validation(validation, operating_point)
    _refuse_training_data(system, records, validation)
    again = partial(diagnose, parameters=parameters, effects=names, noise=noise, progress=progress)
    _refuse_mixed(reference, augment=augment, refine=refine, operating_point=operating_point)
    rows = MisreadRows(system, records, validation, reference, partial(
        again, operating_point=operating_point, session_gain=session_gain, augment=augment, refine=refine))
    without_rows = rows.left_out(lambda held: refit(system, held, noise_floor(system, held, noise=noise),
                                                    parameters=parameters, session_gain=session_gain).system)
    if without_rows is not None:
        return without_rows
    if reference is not None:
        refuse_long(reference, "reference")
        healthy, _ = measured_of(reference, "reference")
        judged, compared = changed(
            system, records, reference, validation=checked, parameters=parameters, names=names, noise=noise,
            session_gain=session_gain, progress=progress, augment=None if not augment else lambda model: augmented(
                model, healthy, parameters, partial(again, session_gain=session_gain)))
        return _with_reference(concluded(judged, "new records"), compared)
    progress("reading the noise off the records")
    floor = noise_floor(system, records, noise=noise, operating_point=operating_point)
    progress("refitting the nominal system")
    nominal = refit(system, records, floor, parameters=parameters, operating_point=operating_point,
                    session_gain=session_gain)
    refuse_constant(nominal.system, [path.one for path in nominal.records])
    judged, moved = _answers(nominal, names, checked, progress)
    judged = asked_of_log(judged, lambda others: held_alike(judged, refit(
        system, others, floor, parameters=parameters, session_gain=session_gain, near=nominal)), checked)
    judged = asked_of_columns(judged, system, floor.noise, lambda others: refit(
        system, others, floor, parameters=parameters, session_gain=session_gain))
    progress("locating the misfit and planning the next experiment")
    found, fitted_to, held_out = concluded(judged), records, validation
    every, responses = measured_of(records, "records")
    if len(every) > 1 and not responses:
        progress("asking whether the records differ from each other")
        first, others = every[:1], [*every[1:], *_listed(validation)]
        found = asked_of_each(
            judged, found, concluded, system, parameters,
            fits=lambda model, chosen: [refit(model, one, floor, parameters=chosen, session_gain=session_gain)
                                        for one in every],
            alone=lambda: again(system, first, validation=others, session_gain=session_gain))
        if len(found.nominal.records) == 1:
            fitted_to, held_out = first, others
    found = rows.left_out_beside(_unless_it_wanders(found, moved))
    if not refine or rows.replaced:
        return found
    progress("splitting the lump in which the remainder sits")
    return replace(found, refinement=refined(
        found, system, parameters,
        fitted=lambda split, chosen: refit(split, fitted_to, floor, parameters=chosen, operating_point=operating_point,
                                           session_gain=session_gain),
        again=lambda split, chosen: again(split, fitted_to, validation=held_out, parameters=chosen,
                                          operating_point=operating_point, session_gain=session_gain)))


def _refuse_training_data(system: System, records: Measured | Sequence[Measured],
                          validation: Measured | Sequence[Measured] | None) -> None:
    """Refuse validation on the data of the fit."""
    if validation is not None:
        refuse_seen(as_measured(system, records, "records"), as_measured(system, validation, "validation"))


def _refuse_mixed(reference: Measured | Sequence[Measured] | None, *, augment: bool, refine: bool,
                  operating_point: Mapping[str, float] | None) -> None:
    """Refuse what is asked of a comparison of days, or of a diagnosis, and belongs to the other."""
    if reference is None:
        if augment:
            raise InputError("augment is given without reference records", where="argument augment",
                             remedy="Leave it out: a diagnosis adds what it names to its system anyway.")
        return
    if refine:
        raise InputError("refine is given with reference records", where="argument refine",
                         remedy="Refine the network on the reference records alone first.")
    if operating_point is not None:
        raise InputError("operating_point is given with reference records", where="argument operating_point",
                         remedy="Leave it out: a record brings its own inputs.")


def _listed(data: Measured | Sequence[Measured] | None) -> list[Measured]:
    """Data of an argument as a list."""
    if data is None:
        return []
    records, responses = measured_of(data, "validation")
    return [*records, *responses]


def _answers(nominal: Refit, names: tuple[str, ...] | None, validation: Validation, progress: Progress
             ) -> tuple[Judged, Judged | None]:
    """The answer, and where it names nothing that beside a room that wanders, if more is said then."""
    judged = _judged(nominal, names, validation, progress)
    moved = beside_a_wandering_room(judged, lambda moving: unless_finer(lasting_beyond_steps(
        judge(searched(moving, names, validation, progress), validation, progress))), validation, progress)
    if moved is None and too_warm(nominal) and asks_for_a_held_room(judged):
        progress("once more, with a room no warmer than beside a machine that is only heated")
        judged = unless_worse(judged, _judged(only_heated(nominal), names, validation, progress))
    return judged, moved


def _unless_it_wanders(found: Diagnosis, moved: Judged | None) -> Diagnosis:
    """The answer, or where it names nothing and the log is read as it stands that beside a room that wanders."""
    return found if moved is None or found.verdict != "unexplained" or found.means else concluded(moved)


def _judged(nominal: Refit, names: tuple[str, ...] | None, validation: Validation, progress: Progress) -> Judged:
    """Search, verdict, and where something is left beyond the noise the graded verdict."""
    judged = lasting_beyond_steps(judge(searched(nominal, names, validation, progress), validation, progress))
    judged = unless_finer(judged)
    return predicting_best(graded(reconsider_noise(judged, validation), validation, progress), validation)


def concluded(judged: Judged, trained: str = "training records") -> Diagnosis:
    """The answer: names, values, gaps, what could not be tested, and the next experiment.

    Parameters
    ----------
    judged : Judged
        State of the search with its tests and verdict.
    trained : str
        What the records of the fit are called.
    """
    judged = without_names_of_noise(judged)
    state, nominal = judged.state, judged.state.nominal
    named = judged.verdict in ("named", "named_with_remainder", "ambiguous")
    unexplained = judged.verdict == "unexplained" and bool(nominal.records)
    fit = judged.plain or (exact(state.fit) if unexplained else state.fit)
    others = either_way(state.fit, judged.verdict)
    found = _all_found(judged, named, others)
    gap = {"train": Gap(nominal.rms, fit.rms, expected_rms(fit), fit.unit)}
    if judged.hold_out is not None:
        gap["validation"] = judged.hold_out.gap
    where = locate(nominal)
    with_rest = unexplained or (judged.plain is not None and judged.verdict != "named")
    rest = _beyond_noise(fit, gap, trained) if with_rest else None
    resolves = None if rest is None else resolving(rest, nominal.system)
    diagnosis = Diagnosis(
        verdict=judged.verdict, effects=found if named else (), provisional=() if named else found,
        alternatives=tuple(map(alternatives, state.rounds)) if named else (),
        system=ranged(fit.system, nominal.structure.base, found) if named else nominal.system, gap=gap, located=where,
        not_testable=_hidden(state) | state.scores.not_testable,
        next_experiment=_plan(state.rounds) if named else None, outcome=judged.outcome,
        noise_floor=nominal.floor, nominal=nominal, fit=fit, scores=state.scores, rounds=state.rounds,
        adequacy=judged.adequacy, hold_out=judged.hold_out, joint=state.joint,
        nearest=nearest(judged, gap),
        unknown_heat=unknown_heat(nominal, where.lump) if unexplained else None, remainder=rest, resolving=resolves,
        ambients=found_ambients(fit), means=judged.means)
    caveats = (*either_way_in_words(state.fit, others), *_caveats(judged, diagnosis))
    return replace(diagnosis, caveats=caveats, outcome=replace(judged.outcome, text=_text(diagnosis, caveats)))


def _with_reference(found: Diagnosis, compared: Compared) -> Diagnosis:
    """With what the reference records say: how large a change would have been seen, or how good the model is."""
    said = ((*compared.beyond_reference, *visible_in_words(compared.visible)) if found.verdict == "consistent" else
            compared.caveats)
    law = compared.convection
    said = (*(str(one) for one in (compared.augmented, law) if one is not None), *said)
    answer = replace(found, reference=compared, caveats=(*found.caveats, *said),
                     outcome=replace(found.outcome, text=" ".join([found.outcome.text, *said])))
    return answer if law is None else in_own_names(answer, law)


def _text(found: Diagnosis, caveats: tuple[str, ...]) -> str:
    """All that is to be said of an answer."""
    rooms = [] if found.verdict == "unexplained" else ambients_in_words(found.ambients, found.nominal.system)
    left_over = map(str, filter(None, (found.remainder, found.resolving)))
    others = [one for one in caveats if one != found.means]  # what is wrong with the log comes first
    return " ".join(filter(None, [found.outcome.text, found.means, found.nearest, *found.nominal.floor.remarks, *rooms,
                                  *left_over, *found.fit.contradictions, *others]))


def _caveats(judged: Judged, found: Diagnosis) -> tuple[str, ...]:
    """What to hold against the answer."""
    state, nominal, verdict = judged.state, judged.state.nominal, judged.verdict
    said = [one for one in (judged.means, judged.finer, judged.room) if one]
    said += [*nothing_fitted(nominal, verdict), *confirmed(found.effects)]
    if verdict == "named_with_remainder":
        said += place_undecided([one.key for one in found.effects], found.alternatives)
    if verdict in ("named", "named_with_remainder", "ambiguous"):
        said += [*periods_undecided(state.rounds, verdict != "named"), *late_by_rows(state.fit)]
        said += [*share_one_curve(state.fit), *surfaces(found.effects), *steep_powers(found.effects)]
    if verdict in ("named_with_remainder", "ambiguous"):
        said += falling_powers(found.effects, nominal.span)
    said += at_bounds(state.fit, verdict)
    said += held_ambients(nominal)
    said += may_drift(nominal) if verdict == "unexplained" else far_ambients(found.ambients, nominal.system)
    said += may_be_a_coolant(nominal.system, state.fit.structure.effects)
    said += may_be_the_supply(nominal.system, state.fit.structure.effects)
    if judged.plain is None:
        said += noise_above_declared(state.fit, verdict)
        return (*said, *may_be_the_room(nominal, state.fit.structure.effects))
    listed = [name for one, others in zip(found.effects, found.alternatives, strict=True)
              for name in (one.key, *others)]
    return (*said, *may_be_the_room(nominal, state.fit.structure.effects), *within_the_body(nominal.system, listed),
            *which_is_off(nominal.system, [one.key for one in found.effects]),
            *doubts(nominal.system, remainder=True))


def _beyond_noise(fit: Refit, gap: dict[str, Gap], trained: str) -> Remainder | None:
    """The remainder; None if all is within the noise."""
    return remainder(fit, gap, trained) if any(left(one).rms for one in gap.values()) else None


def _all_found(judged: Judged, named: bool, others: Mapping[str, float]) -> tuple[Found, ...]:
    """Accepted effects; named ones with the evidence for each."""
    state, evidence = judged.state, judged.evidence
    if named and not evidence:
        evidence = evidence_of(state.rounds, state.fit, state.nominal)
    return tuple(_found(judged, i, evidence[i] if named else None, others) for i in range(len(state.rounds)))


def _hidden(state: SearchState) -> dict[Name, str]:
    """Candidates that were not tried, with the reason."""
    tested = {c.key for c in state.scores.candidates}
    return {c.key: why for c in candidates(state.nominal.system, state.names)
            if c.key not in tested and (why := state.nominal.structure.hides(c))}


def _found(judged: Judged, place: int, evidence: Evidence | None, others: Mapping[str, float]) -> Found:
    fit, plain, best = judged.state.fit, judged.plain, judged.state.rounds[place].best
    values, augmented = quantities_of(fit, place), {}
    if plain is not None:
        values = _with_remainder(fit, None if judged.compared else plain, place, values)
        if fit.structure.coarse:
            augmented = {name: value for name, (value, _) in quantities_of(plain, place).items()}
    units, lag = {q.name: q.unit for q in best.candidate.effect.quantities}, lag_name(*best.candidate.key)
    said = {name: (value, std, units[name]) for name, (value, std) in values.items()}
    if best.candidate.effect.name == NAME:
        said = relative(said)
    return Found(best.candidate.effect.name, best.candidate.where, said, best.p_value, best.delta_bic, evidence,
                 augmented, {"time_constant": others[lag]} if lag in others else {})


def _with_remainder(fit: Refit, plain: Refit | None, place: int, values: dict[str, tuple[float, float]]
                    ) -> dict[str, tuple[float, float]]:
    """Values with standard deviations that include the remainder."""
    structure = fit.structure
    free = structure.effects[place].effect.free
    at = structure.column_of(place)
    out = dict(values)
    for quantity, std in zip(free, deviations(fit, plain, range(at, at + len(free))), strict=True):
        value = values[quantity.name][0]
        out[quantity.name] = value, float(std * value if quantity.lower > 0 else std)
    return out


def _plan(rounds: tuple[Accepted, ...]) -> NextExperiment | None:
    """Experiment for the first effect that has rivals."""
    for round_ in rounds:
        entries = rivals(round_)
        if len(entries) > 1:
            return next_experiment(entries) if trial_conditions(entries[0].fit) is not None else None
    return None
