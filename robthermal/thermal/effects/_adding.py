"""`add_effect`: one effect of the catalog added to a system, checked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ...errors import InputError
from .._parameters import parts_of
from .._system import System
from ._builders import Builder
from ._catalog import effects
from ._effect import Effect
from ._response import Values, Where

_TABLES = {"module": ("modules",), "lump": ("lumps",), "ambient": ("ambients",), "link": ("links",),
           "sensor": ("sensors",), "input": ("inputs",), "input or module": ("inputs", "modules"),
           "lump or ambient": ("lumps", "ambients")}


@dataclass(frozen=True)
class AddedEffect:
    """A system with one more effect.

    Parameters
    ----------
    system : System
        System with the effect.
    parameters : mapping of str to str
        Parameter of the effect to the name of the number in the system.

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.thermal.add_effect(rt.systems.two_module(), "thomson", ["m1"]).parameters
    {'coefficient': 'modules.m1.thomson'}
    """

    system: System
    parameters: Mapping[str, str]


def add_effect(system: System, effect: str, where: Sequence[str], values: Values | None = None) -> AddedEffect:
    """Add one effect to a system.

    Parameters
    ----------
    system : System
        System without the effect; it is not changed.
    effect : str
        A name of `effects`.
    where : sequence of str
        Parts that it names, in the order of `EffectKind.where`.
    values : mapping, optional
        Parameters; what is left out is zero, or for a shape a usual value (exponent 0.25, time constant 60 s, period
        600 s, dew point 283.15 K). A hidden mass cannot be zero: it starts at a millionth of its lump's capacity.

    Returns
    -------
    AddedEffect
        The parameter "time_constant" of a hidden mass is set by its link's conductance, capacity / time_constant.

    Raises
    ------
    InputError
        Unknown names; a place that has this effect already; a value that the system refuses.

    Examples
    --------
    >>> import robthermal as rt
    >>> added = rt.thermal.add_effect(rt.systems.two_module(), "lead_heating", ["x6", "m1"], {"resistance": 0.02})
    >>> added.parameters, added.system.parameter("leads.m1-x6.resistance")
    ({'resistance': 'leads.m1-x6.resistance'}, 0.02)
    """
    place, given = tuple(where), {name: float(value) for name, value in (values or {}).items()}
    kind = _checked(system, effect, place, given)
    parameters: dict[str, str] = {}
    for form in _forms(kind, given):
        system, names = _with_form(system, form, place, given)
        parameters |= names
    return AddedEffect(system, parameters)


def _forms(kind: Effect, given: Values) -> list[Effect]:
    """Forms that the values name; the first by default."""
    named = [form for form in kind.all_forms if any(quantity.name in given for quantity in form.quantities)]
    return named or [kind]


def _with_form(system: System, form: Effect, where: Where, given: Values) -> tuple[System, dict[str, str]]:
    wanted = {quantity.name: 0.0 for quantity in form.quantities}
    if not isinstance(form.add, Builder):  # a user's own: it alone knows where its numbers are
        return form.add(system, where, wanted | {name: given[name] for name in wanted if name in given}), {}
    if form.add.present(system, where):
        raise InputError(f"the system has {form.name} at {', '.join(where)} already", where="argument where",
                         remedy="Change its parameters with system.with_parameters.")
    wanted |= {name: value for name, value in given.items() if name in wanted}
    usual = {name: value for name, value in form.add.defaults(system, where).items()
             if name not in given or (name == form.size.name and not given[name])}
    new = form.add(system, where, wanted | usual)
    return new, dict(form.add.names(new, where))


def _checked(system: System, effect: str, where: Where, values: Values) -> Effect:
    known = effects()
    if effect not in known:
        raise InputError(f"there is no effect {effect!r}", where="argument effect",
                         expected="one of " + ", ".join(known))
    kind = known[effect]
    if kind.where and len(where) != len(kind.where):
        raise InputError(f"{effect} at {list(where)}", where="argument where", expected=", ".join(kind.where))
    for name, what in zip(where, kind.where, strict=False):
        parts = [part for table in _TABLES[what] for part in parts_of(system, table)]
        if name not in parts:
            raise InputError(f"there is no {what} {name!r}", where="argument where",
                             expected="one of " + (", ".join(parts) or "none"))
    for name in values:
        if name not in kind.parameters:
            raise InputError(f"{effect} has no parameter {name!r}", where="argument values",
                             expected="some of " + ", ".join(kind.parameters))
    return kind
