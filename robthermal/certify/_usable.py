"""The usable current: the smallest of the bounds by contraction, an invariant box, thermal runaway and the rating."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from ..errors import InputError, Outcome
from ..thermal import System
from ..verification import Certificate
from ._contraction import METHODS, Method, contraction
from ._limits import DIRECTIONS, Direction, current_range
from ._outcomes import CertifyCode
from ._own_heat import driven, of_leads
from ._regulated import SetPoints
from ._sections import Interval, Temperatures, parameter_box, refuse_effects
from ._surroundings import ambient_ranges, heat_ranges
from ._usable_bounds import Lower, Question, contraction_bound, largest_box_current, rating_bound
from ._usable_result import CurrentBound, UsableCurrent
from ._usable_runaway import runaway_bound

_BACK_OFF = (0.0, 1e-3, 1e-2, 0.05, 0.2)
_Proven = TypeVar("_Proven", bound=tuple[Any, ...])
_FINE = 2e-4  # share of a bound within which its largest proven current is found


def usable_current(system: System, *, direction: Direction = "cooling", temperature: Temperatures,
                   ambient: Mapping[str, Interval] | None = None, heat: Mapping[str, Interval] | None = None,
                   setpoint: SetPoints | None = None, parameters: Mapping[str, Interval] | None = None,
                   lower: Lower = "inside", method: Method = "energy") -> UsableCurrent:
    """Find the current that every module may have: the smallest of four bounds.

    - *contraction*: up to it the stated box contracts (proven, `largest_current`).
    - *box*: up to it a box inside the stated one is never left and contracts (proven).
    - *runaway*: 0.98 I* of the network at the set-points; for modules without set-point, the current at which the cold
      face is coldest in steady state. Computed, not proven.
    - *rating*: the least of the declared `current_limits`.

    At the smallest one the box is certified: a machine that starts in it stays in it, and forgets where it started,
    whatever the currents do within the range, and ambients and heats in theirs.

    Parameters
    ----------
    system : System
        Network with at least one module.
    direction : {"cooling", "heating", "symmetric"}
        Range [0, c], [-c, 0] or [-c, c], for every module.
    temperature : tuple or mapping
        The stated box, which the machine must not leave: (lower, upper) of every lump, or {lump: (lower, upper)} [K].
    ambient : mapping, optional
        {ambient: (lower, upper)} [K]; default nominal.
    heat : mapping, optional
        {lump: (lower, upper)} [W], heaters and loads; default the declared limits of the heaters. Constant and periodic
        heats of the system and the heat of leads are added.
    setpoint : mapping, optional
        {module: temperature, or (lower, upper), at which its cold face is held} [K].
    parameters : mapping, optional
        Ranges of uncertain numbers of the system {parameter name: (lower, upper)}: all four bounds and the certificates
        then hold for all of them. What sensors alone know is ignored; gains of heaters widen `heat` where it is not
        given.
    lower : {"inside", "reported"}
        Whether the lower ends must lie inside the stated box too, or are only reported.
    method : {"energy", "sum", "max", "lyapunov"}
        Norm of the contraction.

    Returns
    -------
    UsableCurrent

    Raises
    ------
    InputError
        A system without modules, a stated box that excludes the ambients, a heater without limits when `heat` is not
        given, ranges of parameters that no checker covers, unknown names.

    Examples
    --------
    >>> import robthermal as rt
    >>> found = rt.certify.usable_current(rt.systems.two_module(), temperature=(278.15, 358.15), lower="reported")
    >>> round(found.current, 2), found.limited_by, found.invariance.holds, found.contraction.holds
    (1.48, 'runaway', True, True)
    """
    question = question_of(system, direction=direction, temperature=temperature, ambient=ambient, heat=heat,
                           parameters=parameters, lower=lower, method=method)
    runaway, costly = runaway_bound(question, setpoint)
    limits = {"contraction": contraction_bound(question), "box": box_bound(question), "runaway": runaway,
              "rating": rating_bound(question)}
    return headline(question, limits, costly)


def question_of(system: System, *, direction: Direction = "cooling", temperature: Temperatures,
                ambient: Mapping[str, Interval] | None, heat: Mapping[str, Interval] | None,
                parameters: Mapping[str, Interval] | None, lower: Lower, method: Method) -> Question:
    """Arguments of `usable_current`, checked."""
    around = ambient_ranges(system, ambient, parameters)
    plain = driven(system, heat_ranges(system, heat, parameters), parameters)
    _check(plain.system, direction, method, lower)
    ranges = parameter_box(plain.system, plain.parameters, ("leads",)) | of_leads(plain.parameters)
    question = Question(plain.system, direction, temperature, around, plain.heat, ranges, lower, method)
    question.check_box()
    return question


def headline(question: Question, limits: dict[str, CurrentBound], costly: str | None = None) -> UsableCurrent:
    """The smallest bound with its certificates; `costly` is the parameter that costs most of the runaway bound."""
    q = question
    limited_by = min(limits, key=lambda name: limits[name].current)

    def prove(c: float) -> tuple[dict[str, Interval], Certificate, Certificate]:
        box, stays = q.certified_box(c)
        return box, stays, stays if not box else contraction(
            q.system, current=current_range(q.system, q.direction, c), temperature=box, method=q.method,
            parameters=q.parameters)

    c, (box, stays, shrinks) = _largest_proven(limits[limited_by].current, prove)
    if limited_by != "runaway":
        costly = _limiting_parameter(q, limited_by, limits[limited_by].current)
    return UsableCurrent(c, q.direction, limited_by, limits, current_range(q.system, q.direction, c), box, stays,
                         shrinks, _outcome(c, limited_by, limits, stays, shrinks), costly)


def box_bound(question: Question) -> CurrentBound:
    """Largest current with an invariant box inside the stated one, in which the network contracts."""
    c, (_, stays) = _largest_proven(largest_box_current(question), question.certified_box)
    if stays.holds:
        where = ("a box inside the stated one is never left" if question.lower == "inside" else
                 "a box is never left whose upper ends are inside the stated one (its lower ends may be below)")
        return CurrentBound(c, stays, "proven", f"Up to it {where}, for all ambients and heats.")
    return CurrentBound(0.0, stays, "proven", "Not even without current is a box inside the stated one proven.")


def _largest_proven(limit: float, prove: Callable[[float], _Proven]) -> tuple[float, _Proven]:
    """Largest current up to a limit for which all certificates of `prove` hold, and these; 0 where there is none."""
    failed = limit
    for back_off in _BACK_OFF:
        c = limit * (1 - back_off)
        found = prove(c)
        if _all_hold(found) or not limit:
            break
        failed = c
    if not _all_hold(found):
        return 0.0, found
    while failed - c > _FINE * limit:  # back-off steps alone would put ranges of parameters above their own numbers
        middle = 0.5 * (failed + c)
        trial = prove(middle)
        if _all_hold(trial):
            c, found = middle, trial
        else:
            failed = middle
    return c, found


def _all_hold(found: tuple[Any, ...]) -> bool:
    return all(part.holds for part in found if isinstance(part, Certificate))


def _limiting_parameter(question: Question, limited_by: str, current: float) -> str | None:
    """The parameter without whose range the binding bound would be largest."""
    if not question.parameters or limited_by == "rating":
        return None
    find: Any = largest_box_current if limited_by == "box" else lambda q: contraction_bound(q).current
    found = {name: find(question.without(name)) for name in question.parameters}
    best = max(found, key=lambda name: found[name])
    return best if found[best] > current * 1.0001 else None


def _check(system: System, direction: str, method: str, lower: str) -> None:
    refuse_effects(system, ("leads",))
    for argument, value, choices in (("direction", direction, DIRECTIONS), ("method", method, METHODS),
                                     ("lower", lower, ("inside", "reported"))):
        if value not in choices:
            raise InputError(f"{argument} = {value!r}", where=f"argument {argument}",
                             expected="one of " + ", ".join(f'"{choice}"' for choice in choices))
    if not system.modules:
        raise InputError("the system has no thermoelectric module", where="argument system",
                         remedy="Without modules use rt.certify.runaway_free with current={}.")


def _outcome(current: float, limited_by: str, limits: Mapping[str, CurrentBound], stays: Certificate,
             shrinks: Certificate) -> Outcome:
    bound = limits[limited_by]
    if current > 0:
        return CertifyCode.USABLE.outcome(f"Usable current {current:.4g} A in every module, limited by {limited_by}: "
                                          f"{bound.text}")
    why = bound.text if bound.current == 0 else (shrinks if stays.holds else stays).reason
    return CertifyCode.NONE.outcome(f"No current is usable, limited by {limited_by}: {why}")
