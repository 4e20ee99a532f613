"""The catalog: every effect that a file of this package defines, and those a user registers."""

from __future__ import annotations

import copyreg
from dataclasses import fields, replace
from importlib import import_module
from pkgutil import iter_modules
from typing import Any

from ...errors import InputError
from ._effect import Effect, check_effect


def _built_in() -> dict[str, Effect]:
    """Effects of all files here without an underscore, in the order of their rank."""
    names = [module.name for module in iter_modules(import_module(__package__ or "").__path__)
             if not module.name.startswith("_")]
    found = [import_module(f"{__package__}.{name}").EFFECT for name in names]
    return {effect.name: effect for effect in sorted(found, key=lambda effect: effect.rank)}


_BUILT_IN: dict[str, Effect] = {}
_OWN: dict[str, Effect] = {}


def effects() -> dict[str, Effect]:
    """Every known effect by name, the user's own last.

    Returns
    -------
    dict of str to Effect

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.thermal.effects()["hidden_mass"].size.unit
    'J/K'
    >>> rt.thermal.effects()["thomson"].parameters
    {'coefficient': 'V/K'}
    """
    return {**_built_in_once(), **_OWN}


def _built_in_once() -> dict[str, Effect]:
    if not _BUILT_IN:
        _BUILT_IN.update(_built_in())
    return _BUILT_IN


def register_effect(effect: Effect) -> None:
    """Add an effect of your own to the catalog of this process.

    Parameters
    ----------
    effect : Effect
        A name that is already the user's own is replaced; a built-in one is refused.

    Raises
    ------
    InputError
        Not an effect, a quantity without a grid, a built-in name.

    Examples
    --------
    >>> import robthermal as rt
    >>> glue = rt.diagnosis.Effect(
    ...     name="glued_sensor", places=lambda system: [(name,) for name in system.sensors],
    ...     quantities=(rt.diagnosis.Quantity("offset", "K", -5.0, 5.0),),
    ...     add=lambda system, where, q: system.with_parameters({f"sensors.{where[0]}.offset": q["offset"]}))
    >>> rt.diagnosis.register_effect(glue)
    >>> "glued_sensor" in rt.diagnosis.effects()
    True
    >>> rt.diagnosis.forget_effect("glued_sensor")
    """
    check_effect(effect)
    if effect.name in _built_in_once():
        raise InputError(f"effect {effect.name!r} is built in", where="argument effect", remedy="Choose another name.")
    _OWN[effect.name] = effect


def forget_effect(name: str) -> None:
    """Take a registered effect out again.

    Parameters
    ----------
    name : str
        Name of an effect given to `register_effect`.

    Raises
    ------
    InputError
        Not registered.

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.diagnosis.forget_effect("nonsense")
    Traceback (most recent call last):
    ...
    robthermal.errors.InputError: argument name: no effect 'nonsense' is registered.
    """
    if name not in _OWN:
        raise InputError(f"no effect {name!r} is registered", where="argument name")
    del _OWN[name]


def _of_catalog(name: str, form: int, changes: dict[str, Any]) -> Effect:
    if name not in effects():
        raise InputError(f"no effect {name!r} is registered", where="pickled effect",
                         remedy="Call rt.diagnosis.register_effect with it first.")
    found = tuple(effects()[name].all_forms)[form]
    return replace(found, **changes) if changes else found


def _reduced(effect: Effect) -> tuple[Any, ...]:
    """Pickled by name, with what differs: an effect holds functions. One in no catalog is pickled if its functions can.
    """
    known = effects().get(effect.name)
    for place, form in enumerate(() if known is None else known.all_forms):
        changes = {field.name: getattr(effect, field.name) for field in fields(Effect)
                   if getattr(effect, field.name) is not getattr(form, field.name)}
        if not any(map(callable, changes.values())):
            return _of_catalog, (effect.name, place, changes)
    plain: Any = object.__reduce_ex__(effect, 2)
    return tuple(plain)


copyreg.pickle(Effect, _reduced)
