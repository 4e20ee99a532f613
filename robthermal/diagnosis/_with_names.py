"""A nominal system with the effects that a diagnosis has named, ready to be fitted again."""

from __future__ import annotations

import math
from collections.abc import Iterable

from ..errors import InputError
from ..fitting import Choice, chosen_ranges
from ..thermal import FitRange, System, add_effect
from ._found import Found
from .effects import effects

_FACTOR = 10.0  # of the value that the diagnosis found: wide enough never to bind, where its effect is needed at all


def with_named_effects(system: System, named: Iterable[Found]) -> System:
    """Add effects to a nominal system, their numbers with a range in its fit table.

    Parameters
    ----------
    system : System
        Nominal system of the diagnosis; it is not changed.
    named : iterable of Found
        `Diagnosis.effects`. Numbers that were found may change by a factor of 10 in a fit.

    Returns
    -------
    System

    Raises
    ------
    InputError
        If the system has one of the effects already.

    Examples
    --------
    >>> import robthermal as rt
    >>> bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 100.0}},
    ...                 links=[{"between": ("bar", "room"), "conductance": 0.5}], sensors={"T": {"lump": "bar"}})
    >>> late = rt.diagnosis.Found("sensor_lag", ("T",), {"time_constant": (30.0, 1.0, "s")}, 1e-9, 400.0)
    >>> augmented = rt.diagnosis.with_named_effects(bar, [late])
    >>> augmented.sensors["T"].time_constant, augmented.fit["sensors.T.time_constant"].upper
    (30.0, 330.0)
    """
    known, fit = effects(), dict(system.fit)
    for one in named:
        values = {name: value for name, (value, _, _) in one.values.items()}
        added = add_effect(system, one.effect, one.where, values)
        system = added.system
        quantities = {quantity.name: quantity for form in known[one.effect].all_forms for quantity in form.quantities}
        for name, parameter in added.parameters.items():
            quantity, value = quantities.get(name), system.parameter(parameter)
            if parameter.startswith("flows."):  # those of one coolant belong together
                continue
            if value and quantity is not None and quantity.lower < quantity.upper:
                fit[parameter] = FitRange(lower=min(value / _FACTOR, value * _FACTOR) if quantity.lower >= 0.0 else
                                          value - _FACTOR * abs(value), upper=value + _FACTOR * abs(value))
    return System(**{**dict(system), "fit": fit})


def ranged(system: System, nominal: System, named: Iterable[Found]) -> System:
    """A system that has the named effects, their numbers with a range in its fit table as in `with_named_effects`.

    Parameters
    ----------
    system : System
        Refitted system with the effects.
    nominal : System
        The same without them. Where it has no fit table all its numbers are taken as right, and so are those.
    named : iterable of Found
        `Diagnosis.effects`; what is no effect of the catalog has no number of its own.
    """
    if not nominal.fit:
        return system
    try:
        more = with_named_effects(nominal, [one for one in named if one.effect in effects()]).fit
    except InputError:  # the system had a number of the effect already, and may fit it
        return system
    new = {name: more[name] for name in more if name not in nominal.fit and name in system.parameters}
    own = {name: system.parameter(name) for name in new}
    return System(**{**dict(system), "fit": {**system.fit, **{
        name: FitRange(lower=min(limits.lower, own[name]), upper=max(limits.upper, own[name]))
        for name, limits in new.items()}}})


def with_fitted(system: System, named: Iterable[Found], parameters: Choice) -> tuple[System, Choice]:
    """The system with effects and what is fitted in it: the numbers of effects beside those that were.

    Without a fit table and without `parameters` all numbers are taken as right, those of effects as they were found.

    Parameters
    ----------
    system : System
        Nominal system, which gets the effects.
    named : iterable of Found
        Effects of a diagnosis.
    parameters : iterable or mapping, optional
        Nominal parameters that were refitted in it.
    """
    more = with_named_effects(system, named)
    if parameters is None:
        return (more if system.fit else System(**{**dict(more), "fit": {}})), None
    ranges = chosen_ranges(system, parameters)
    chosen: dict[str | tuple[str, ...], FitRange] = {
        group if len(group) > 1 else group[0]: FitRange(lower=lower, upper=upper,
                                                        sigma=sigma if math.isfinite(sigma) else None)
        for group, lower, upper, sigma in zip(ranges.members, map(float, ranges.lower), map(float, ranges.upper),
                                              map(float, ranges.sigma), strict=True)}
    chosen.update((name, limits) for name, limits in more.fit.items() if name not in system.fit)
    return more, chosen
