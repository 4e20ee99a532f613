"""A heater whose power changes more with temperature than the resistance of a metal does: more likely a loss."""

from __future__ import annotations

from collections.abc import Sequence

from ._found import Found

_NAME = "heater_power_slope"
_STEEPEST = 0.0065  # 1/K: iron; of pure metals, at room temperature
_WIDE = 80.0  # K: over which paths that conduct better when hot bend as much as a power that falls
_LOSSES = ("natural_convection", "radiation", "missing_ambient_link")


def beyond_metals(effect: str, slope: float) -> bool:
    """Whether an effect is a power that no wire of a pure metal makes, at a fixed voltage or current.

    Parameters
    ----------
    effect : str
        Name of the effect.
    slope : float
        Its first quantity, of a power the relative change per kelvin [1/K].
    """
    return effect == _NAME and abs(slope) > _STEEPEST


def loses_heat(effect: str) -> bool:
    """Whether an effect is a loss that a power which falls with temperature may stand for.

    Parameters
    ----------
    effect : str
        Name of the effect.
    """
    return effect in _LOSSES


def steep_powers(effects: Sequence[Found]) -> list[str]:
    """Named powers that change more with temperature than the resistance of any pure metal makes, a sentence each.

    Parameters
    ----------
    effects : sequence of Found
        Named effects with their sizes.
    """
    return [f"A power that {'falls' if slope < 0 else 'grows'} by {100.0 * abs(slope):.2g} % per kelvin is more than "
            f"the resistance of a pure metal makes (0.39 % copper, {100.0 * _STEEPEST:.2g} % iron): unless "
            f"{one.where[0]} is a PTC or NTC element or a transistor, {'a loss' if slope < 0 else 'a heat'} that grows "
            "faster than those of the model is more likely."
            for one in effects if one.effect == _NAME and beyond_metals(one.effect, slope := one.values["slope"][0])]


def falling_powers(effects: Sequence[Found], span: float) -> list[str]:
    """Named powers that fall, as a path that conducts better when hot makes it look over a wide range, a sentence each.

    Of nine simulated furnaces in fibre two had such a power among their names, and it was not there.

    Parameters
    ----------
    effects : sequence of Found
        Named effects with their sizes.
    span : float
        Range of the readings [K].
    """
    return [f"Over {span:.0f} K a path that conducts better when it is hot, as fibre does, looks much like a heater "
            f"whose power falls by {100.0 * abs(slope):.2g} % per kelvin: measure voltage and current of "
            f"{one.where[0]} before you believe it." for one in effects if one.effect == _NAME and span >= _WIDE
            and (slope := one.values["slope"][0]) < 0.0 and not beyond_metals(one.effect, slope)]
