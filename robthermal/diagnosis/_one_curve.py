"""Several things that follow one recorded column: a system has one curve of it for all of them."""

from __future__ import annotations

from .fit import Refit

_SHAPES = ("input_gain_slope", "input_saturation", "input_lag", "input_delay")


def share_one_curve(fit: Refit) -> list[str]:
    """What follows the same column by one curve, though it may follow it by several, a sentence each.

    Parameters
    ----------
    fit : Refit
        With the effects.
    """
    said, system = [], fit.system
    for name, where in (one.key for one in fit.structure.effects):
        if name in _SHAPES and where[0] in system.inputs:
            column, heater = where[0], system.inputs[where[0]]
            paths = [f"the conductance of {link.name}" for link in system.links
                     if link.follow is not None and link.follow.column == column]
            heats = [f"the heat into {heater.lump}"] if heater.gain else []
            if paths and len(paths + heats) > 1:
                said.append(f"{' and '.join(paths + heats)} follow {column} by one curve here, "
                            f"{name}({column}): where the machine has another for each, their sizes stand for both.")
    return [one[0].upper() + one[1:] for one in said]
