"""`diagnose`: all stages in a row."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from .._fitting import Choice
from ..errors import Outcome
from ..thermal import System
from .data import Measured, as_measured, noise_floor
from .diagnosis import Diagnosis, Found, Verdict
from .effects import candidates
from .evidence import (
    Adequacy,
    Gap,
    HoldOut,
    Scores,
    adequacy,
    expected_rms,
    explains,
    hold_out,
    locate,
    promising,
    refuse_seen,
    score,
    unknown_heat,
    unseen_data,
)
from .fit import Refit, SessionGain, Whitened, refit
from .plan import NextExperiment, next_experiment, rivals, setting_of
from .search import (
    Decision,
    checked_jointly,
    decide,
    flails,
    needed,
    quantities_of,
    refit_short_list,
    revised,
    ruled_out,
    supported,
    told_apart,
    with_wider_noise,
)

MOST_EFFECTS = 3
_LARGE = 1.5  # whitened variance
_LEAST = 0.3  # share of a large misfit that the last effect allowed must promise: it has to explain all of it


@threadpool_limits.wrap(limits=1, user_api="blas")  # products are small: threads only wait for each other
def diagnose(system: System, records: Measured | Sequence[Measured], *,
             validation: Measured | Sequence[Measured] | None = None,
             parameters: Choice = None, effects: Iterable[str] | None = None,
             noise: Mapping[str, float] | float | None = None, operating_point: Mapping[str, float] | None = None,
             session_gain: SessionGain = False,
             progress: Callable[[str], None] = lambda stage: None) -> Diagnosis:
    """Find where records and simulation part, name the missing effect, add it, and test it on unseen records.

    Parameters
    ----------
    system : System
        Nominal: `noise` of its sensors, `disturbance` of its lumps, `sigma` of its fit table say what is known.
    records : Record, FrequencyResponse, or list of them
        Measured. Records may come from a closed loop. Of a frequency response (from `rt.identify`, with its covariance)
        the linearisation at `operating_point` is compared.
    validation : Record, FrequencyResponse, or list of them, optional
        Not seen by any fit. They test the prediction, may take a name back, and may tell names of a set apart.
    parameters : iterable or mapping, optional
        Nominal parameters to refit, as in `rt.calibrate`. Default: the fit table; without one they are taken as known.
    effects : iterable of str, optional
        Names of the catalogue to try; default all, your own registered ones included.
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
    effects = None if effects is None else list(effects)
    if validation is not None:
        refuse_seen(as_measured(system, records, "records"), as_measured(system, validation, "validation"))
    progress("reading the noise off the records")
    floor = noise_floor(system, records, noise=noise, operating_point=operating_point)
    progress("refitting the nominal system")
    nominal = refit(system, records, floor, parameters=parameters, operating_point=operating_point,
                    session_gain=session_gain)
    progress("trying every effect of the catalogue at every place")
    scores = score(nominal, effects)
    rounds, fit, hopeless = _accepted(nominal, scores, effects, progress)
    joint = None
    if len(rounds) > 1 and not hopeless:
        progress("selecting all effects at once, to compare")
        rounds, fit, joint = checked_jointly(rounds, fit, nominal, scores, effects)
    if rounds and validation is not None and not hopeless:
        progress("asking the unseen records whether they speak against an effect")
        data = unseen_data(fit, validation, operating_point)
        for _ in rounds:  # a name that takes another's place may leave nothing of a third
            rounds, fit = told_apart(*supported(rounds, fit, nominal, data), data)
            fewer, less = needed(rounds, fit, nominal)
            if len(fewer) == len(rounds):
                break
            rounds, fit = revised(fewer, nominal, effects) if fewer else (fewer, less)
    progress("testing whether anything is left")
    checks = adequacy(fit)
    if validation is not None:
        progress("predicting the unseen records")
    unseen = None if validation is None else hold_out(nominal, fit, validation, operating_point=operating_point)
    progress("locating the misfit and planning the next experiment")
    verdict, outcome = _verdict(rounds, fit, checks, unseen, hopeless)
    doubtful = verdict == "unexplained" or (rounds and fit.levels.exhausted)  # a name that asks for more noise besides
    if doubtful and (wider := with_wider_noise(nominal, effects, verdict == "unexplained")) is not None:
        predicts = None if validation is None else hold_out(wider[0], wider[0], validation,
                                                            operating_point=operating_point)
        if predicts is None or predicts.outcome.ok:
            (nominal, scores, checks), unseen, rounds, fit, joint = wider, predicts, (), wider[0], None
            verdict, outcome = "consistent", Outcome(True, "consistent", "Nothing but noise is missing: the records "
                                                     f"agree with the model if {nominal.levels}."
                                                     + ("" if nominal.levels.share else " Declare it."))
    if fit.contradictions:
        outcome = replace(outcome, text=" ".join([outcome.text, *fit.contradictions]))
    found = tuple(_found(fit, i, round_) for i, round_ in enumerate(rounds))
    named = verdict in ("named", "ambiguous")
    gap = {"train": Gap(nominal.rms, fit.rms, expected_rms(fit), fit.unit)}
    tested = {c.key for c in scores.candidates}
    hidden = {c.key: why for c in candidates(nominal.system, effects)
              if c.key not in tested and (why := nominal.structure.hides(c))}
    where = locate(nominal)
    return Diagnosis(
        verdict=verdict, effects=found if named else (), alternatives=tuple(map(_others, rounds)) if named else (),
        system=fit.system if named else nominal.system,
        gap=gap | ({} if unseen is None else {"validation": unseen.gap}),
        located=where, not_testable=hidden | scores.not_testable,
        next_experiment=_plan(rounds) if named else None,
        outcome=outcome, provisional=() if named else found, noise_floor=floor, nominal=nominal, fit=fit, scores=scores,
        rounds=rounds, adequacy=checks, hold_out=unseen, joint=joint,
        unknown_heat=unknown_heat(nominal, where.lump) if verdict == "unexplained" and nominal.along else None)


def _accepted(nominal: Refit, scores: Scores, effects: list[str] | None, progress: Callable[[str], None]
              ) -> tuple[tuple[Decision, ...], Refit, bool]:
    """Add effects one by one while any is beyond doubt, then revise those added before others were known.

    Also returned: whether a large misfit is left that choosing again, or together, will not remove.
    """
    rounds: tuple[Decision, ...] = ()
    fit = nominal
    while len(rounds) < MOST_EFFECTS:
        if rounds:
            progress(f"trying every effect again beside {len(rounds)} accepted")
            scores = score(fit, effects)
        if not promising(fit, scores):
            break
        if len(rounds) == MOST_EFFECTS - 1 and _too_much_left(fit, scores):
            return rounds, fit, True
        progress("refitting the best candidates")
        decision = decide(refit_short_list(fit, scores))
        if decision.best is None:
            break
        hopeless = flails(fit, decision.best)
        rounds, fit = (*rounds, decision), decision.best.fit
        if hopeless or (len(rounds) == MOST_EFFECTS and fit.variance > _LARGE):
            return rounds, fit, True
    if len(rounds) < 2:
        return *needed(rounds, fit, nominal), False
    progress(f"choosing each of {len(rounds)} effects again beside the others")
    return *revised(rounds, nominal, effects, last_is_new=True), False


def _too_much_left(fit: Refit, scores: Scores) -> bool:
    """Whether the last effect allowed cannot be what is missing: a large misfit would be left, most of this one."""
    if fit.variance <= _LARGE:
        return False
    share = explains(fit, scores)
    return share < _LEAST and 1.0 + (1.0 - share) * (fit.variance - 1.0) > _LARGE


def _verdict(rounds: tuple[Decision, ...], fit: Refit, checks: Adequacy, unseen: HoldOut | None, hopeless: bool
             ) -> tuple[Verdict, Outcome]:
    faults = [] if checks.outcome.ok else [checks.outcome.text]
    if hopeless:
        faults.append(f"A large misfit stays (whitened variance {fit.variance:.3g}).")
    if unseen is not None and not unseen.outcome.ok:
        faults.append(unseen.outcome.text)
    if rounds and not _still(fit):
        faults.append("An effect moves when the integration is refined: it may be the solver's own error.")
    if rounds and not fit.outcome.ok:
        faults.append(fit.outcome.text)
    if faults:
        helped = "; ".join(str(round_) for round_ in rounds)
        text = "None of the known effects explains the records. " + " ".join(faults)
        text += f" Provisional, no name: {helped}." if helped else ""
        return "unexplained", Outcome(False, "unexplained", text + " Look at `located`: lump, sensor and conditions.")
    if not rounds:
        return "consistent", Outcome(True, "consistent", "Nothing is missing that these records could show: see "
                                     "not_testable and the detection limits in scores.")
    labels = ", ".join(candidate.label for candidate in ruled_out(rounds))
    by_unseen = f" The unseen records rule out {labels}, which the others could not." if labels else ""
    if any(_others(round_) for round_ in rounds):
        return "ambiguous", Outcome(False, "ambiguous", "The records cannot tell some effects apart: see alternatives, "
                                    f"and next_experiment for what separates them.{by_unseen}")
    return "named", Outcome(True, "named", f"One set of effects explains the records.{by_unseen}")


def _still(fit: Refit) -> bool:
    """Whether the sizes stay within a standard deviation when the simulation is ten times finer."""
    structure = replace(fit.structure, tolerance=fit.structure.tolerance / 10.0)
    finer = Whitened(structure, fit.whiteners).residual(fit.v)
    scale = np.linalg.norm(fit.J, axis=0)
    scale[scale == 0] = 1.0
    step = np.linalg.lstsq(fit.J / scale, finer - fit.z, rcond=1e-10)[0] / scale
    place = slice(structure.n_parameters, structure.n_parameters + structure.n_effects)
    return bool(np.all(np.abs(step[place]) <= 1e-12 + np.sqrt(np.maximum(np.diag(fit.covariance)[place], 0.0))))


def _others(round_: Decision) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Everything the records cannot tell from the accepted effect."""
    assert round_.best is not None
    listed = [*round_.best.aliases]
    for entry in round_.contenders:
        listed += [entry.candidate, *entry.aliases]
    return tuple(dict.fromkeys(c.key for c in listed if c.key != round_.best.candidate.key))


def _found(fit: Refit, place: int, round_: Decision) -> Found:
    best = round_.best
    assert best is not None
    units = {q.name: q.unit for q in best.candidate.effect.quantities}
    values = {name: (value, std, units[name]) for name, (value, std) in quantities_of(fit, place).items()}
    return Found(best.candidate.effect.name, best.candidate.where, values, best.p_value, best.delta_bic)


def _plan(rounds: tuple[Decision, ...]) -> NextExperiment | None:
    """Experiment for the first effect that has rivals."""
    for round_ in rounds:
        entries = rivals(round_)
        if len(entries) > 1:
            return next_experiment(entries) if setting_of(entries[0].fit) is not None else None
    return None
