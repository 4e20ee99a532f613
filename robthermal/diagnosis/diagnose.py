"""`diagnose`: all stages in a row."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from threadpoolctl import threadpool_limits

from ..fitting import Choice
from ..thermal import System
from ._judge import Judged, Name, Progress, Validation, alternatives, judge, reconsider_noise
from .data import Measured, as_measured, noise_floor
from .diagnosis import Diagnosis, Found
from .effects import candidates
from .evidence import Gap, expected_rms, locate, refuse_seen, unknown_heat, validation_data
from .fit import Refit, SessionGain, refit
from .plan import NextExperiment, next_experiment, rivals, trial_conditions
from .search import (
    Accepted,
    SearchState,
    accept,
    begin,
    compare,
    quantities_of,
    refit_candidates,
    revise,
    shortlist,
    validate,
)


@threadpool_limits.wrap(limits=1, user_api="blas")  # products are small: threads only wait for each other
def diagnose(system: System, records: Measured | Sequence[Measured], *,
             validation: Measured | Sequence[Measured] | None = None,
             parameters: Choice = None, effects: Iterable[str] | None = None,
             noise: Mapping[str, float] | float | None = None, operating_point: Mapping[str, float] | None = None,
             session_gain: SessionGain = False,
             progress: Progress = lambda stage: None) -> Diagnosis:
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
    progress : callable, optional
        Called with a sentence before every stage.

    Returns
    -------
    Diagnosis

    Raises
    ------
    InputError
        Records too short, validation on the training data, no noise declared and none visible, a nominal model that
        runs away, an unknown effect.

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
    checked = Validation(validation, operating_point)
    if validation is not None:
        refuse_seen(as_measured(system, records, "records"), as_measured(system, validation, "validation"))
    progress("reading the noise off the records")
    floor = noise_floor(system, records, noise=noise, operating_point=operating_point)
    progress("refitting the nominal system")
    nominal = refit(system, records, floor, parameters=parameters, operating_point=operating_point,
                    session_gain=session_gain)
    progress("trying every effect of the catalog at every place")
    state = revised_search(accepted_effects(begin(nominal, names), progress), progress)
    if state.rounds and validation is not None and not state.misfit_left:
        progress("testing on the validation data whether any effect is contradicted")
        state = validate(state, validation_data(state.fit, validation, operating_point))
    judged = judge(state, checked, progress)
    progress("locating the misfit and planning the next experiment")
    return concluded(reconsider_noise(judged, checked))


def accepted_effects(state: SearchState, progress: Progress) -> SearchState:
    """Add effects one by one while any is beyond doubt.

    Parameters
    ----------
    state : SearchState
        State from `begin`.
    progress : callable
        Called with a sentence before every stage.
    """
    while not state.complete:
        if state.rounds:
            progress(f"trying every effect again beside {len(state.rounds)} accepted")
        state = shortlist(state)
        if not state.complete:
            progress("refitting the best candidates")
            state = accept(refit_candidates(state))
    return state


def revised_search(state: SearchState, progress: Progress) -> SearchState:
    """Revise the effects that were added before others were known, and compare with all selected at once.

    Parameters
    ----------
    state : SearchState
        Complete state of the search.
    progress : callable
        Called with a sentence before every stage.
    """
    if len(state.rounds) > 1 and not state.misfit_left:
        progress(f"choosing each of {len(state.rounds)} effects again beside the others")
    state = revise(state)
    if len(state.rounds) > 1 and not state.misfit_left:
        progress("selecting all effects at once, to compare")
    return compare(state)


def concluded(judged: Judged) -> Diagnosis:
    """The answer: names, values, gaps, what could not be tested, and the next experiment.

    Parameters
    ----------
    judged : Judged
        State of the search with its tests and verdict.
    """
    state, fit, nominal = judged.state, judged.state.fit, judged.state.nominal
    found = tuple(_found(fit, i, round_) for i, round_ in enumerate(state.rounds))
    named = judged.verdict in ("named", "ambiguous")
    gap = {"train": Gap(nominal.rms, fit.rms, expected_rms(fit), fit.unit)}
    if judged.hold_out is not None:
        gap["validation"] = judged.hold_out.gap
    where = locate(nominal)
    unexplained = judged.verdict == "unexplained" and bool(nominal.records)
    return Diagnosis(
        verdict=judged.verdict, effects=found if named else (), provisional=() if named else found,
        alternatives=tuple(map(alternatives, state.rounds)) if named else (),
        system=fit.system if named else nominal.system, gap=gap, located=where,
        not_testable=_hidden(state) | state.scores.not_testable,
        next_experiment=_plan(state.rounds) if named else None,
        outcome=replace(judged.outcome, text=" ".join([judged.outcome.text, *fit.contradictions])),
        noise_floor=nominal.floor, nominal=nominal, fit=fit, scores=state.scores, rounds=state.rounds,
        adequacy=judged.adequacy, hold_out=judged.hold_out, joint=state.joint,
        unknown_heat=unknown_heat(nominal, where.lump) if unexplained else None)


def _hidden(state: SearchState) -> dict[Name, str]:
    """Candidates that were not tried, with the reason."""
    tested = {c.key for c in state.scores.candidates}
    return {c.key: why for c in candidates(state.nominal.system, state.names)
            if c.key not in tested and (why := state.nominal.structure.hides(c))}


def _found(fit: Refit, place: int, round_: Accepted) -> Found:
    best = round_.best
    units = {q.name: q.unit for q in best.candidate.effect.quantities}
    values = {name: (value, std, units[name]) for name, (value, std) in quantities_of(fit, place).items()}
    return Found(best.candidate.effect.name, best.candidate.where, values, best.p_value, best.delta_bic)


def _plan(rounds: tuple[Accepted, ...]) -> NextExperiment | None:
    """Experiment for the first effect that has rivals."""
    for round_ in rounds:
        entries = rivals(round_)
        if len(entries) > 1:
            return next_experiment(entries) if trial_conditions(entries[0].fit) is not None else None
    return None
