"""The catalogue: every effect the package knows, and those the user registers."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from ...errors import InputError
from ...thermal import System
from ._catalogue_links import LINK_EFFECTS
from ._catalogue_lumps import LUMP_EFFECTS
from ._catalogue_modules import MODULE_EFFECTS
from ._catalogue_sensors import CLIP, INPUT_EFFECTS, SENSOR_EFFECTS
from ._effect import Candidate, Effect, check_effect

_BUILT_IN = {effect.name: effect for effect in
             (*MODULE_EFFECTS, *LINK_EFFECTS, *LUMP_EFFECTS, *INPUT_EFFECTS, *SENSOR_EFFECTS)}
_FORMS = {CLIP.name: (CLIP,)}  # further laws under the same name
_OWN: dict[str, Effect] = {}


def effects() -> dict[str, Effect]:
    """Every known effect by name, the user's own last.

    Returns
    -------
    dict of str to Effect

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.diagnosis.effects()["hidden_mass"].size.unit
    'J/K'
    """
    return {**_BUILT_IN, **_OWN}


def register_effect(effect: Effect) -> None:
    """Add an effect of your own to the catalogue of this process.

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
    if effect.name in _BUILT_IN:
        raise InputError(f"effect {effect.name!r} is built in", where="argument effect", remedy="Choose another name.")
    _OWN[effect.name] = effect


def forget_effect(name: str) -> None:
    """Take a registered effect out again.

    Parameters
    ----------
    name : str
        Of an effect given to `register_effect`.

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


def chosen_effects(names: Iterable[str] | None) -> list[Effect]:
    """Effects by name in all their forms; all of them by default."""
    known = effects()
    names = list(known) if names is None else list(names)
    unknown = [name for name in names if name not in known]
    if unknown:
        raise InputError(f"there is no effect {unknown[0]!r}", where="argument effects",
                         expected="some of " + ", ".join(known),
                         remedy="Register your own with robthermal.diagnosis.register_effect.")
    return [form for name in names for form in (known[name], *_FORMS.get(name, ()))]


def candidates(system: System, names: Iterable[str] | None = None) -> list[Candidate]:
    """Every effect at every place where it is possible.

    Parameters
    ----------
    system : System
        Nominal.
    names : iterable of str, optional
        Effects; default all.

    Returns
    -------
    list of Candidate
        Without trial values; scoring tries the grid of each.

    Examples
    --------
    >>> import robthermal as rt
    >>> found = rt.diagnosis.candidates(rt.systems.two_module(), ["thomson", "seebeck_slope"])
    >>> [candidate.label for candidate in found if candidate.effect.name == "seebeck_slope"]
    ['seebeck_slope(m1)', 'seebeck_slope(m2)']
    """
    return [Candidate(_with_units(effect, system, tuple(where)), tuple(where))
            for effect in chosen_effects(names) for where in effect.places(system)]


def _with_units(effect: Effect, system: System, where: tuple[str, ...]) -> Effect:
    """With the unit of the column it acts on, where that is known: A of a module, W of a heater with gain 1."""
    heater = system.inputs.get(where[0]) if where else None
    unit = "A" if where and where[0] in system.modules else "W" if heater is not None and heater.gain == 1.0 else "unit"
    if unit == "unit" or not any("unit" in quantity.unit for quantity in effect.quantities):
        return effect
    return replace(effect, quantities=tuple(replace(quantity, unit=quantity.unit.replace("unit", unit))
                                            for quantity in effect.quantities))

