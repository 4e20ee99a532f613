"""The answer of a diagnosis in words that need no statistics."""

from __future__ import annotations

from ...diagnosis import Diagnosis, Found, Gap
from ...thermal import parameter_in_words
from ._change_words import change_in_words, nothing_changed

_PATHS = {"missing_link": "a heat path between {0} and {1}", "missing_ambient_link": "a heat path from {0} to {1}",
          "radiation": "radiation from {0} to {1}", "natural_convection": "natural convection from {0} to {1}",
          "hidden_mass": "a mass that hangs on {0}", "sensor_lag": "the lag of sensor {0}",
          "heat_source": "a constant heat into {0}", "sensor_offset": "an offset of sensor {0}",
          "sensor_gain": "a gain error of sensor {0}", "input_lag": "the lag of input {0}",
          "input_delay": "the delay of input {0}", "periodic_load": "a periodic heat into {0}",
          "input_feedthrough": "a share of the heat of {0} that goes to {1}",
          "heater_power_slope": "that the power of {0} depends on its temperature",
          "conductance_step": "a change of the conductance {0} during the record"}


def answer_sentence(found: Diagnosis) -> str:
    """What the model lacks or what has changed, and what adding it does to the error.

    Parameters
    ----------
    found : Diagnosis
        What was found.
    """
    gap, records = _shown(found)
    if found.effects:
        said = f"Since the reference records: {accepted_in_words(found)}" if found.reference else (
            f"The model lacks {accepted_in_words(found)}")
        falls = f"With it the error on {records} falls from {gap.before:.2g} to {gap.after:.2g} {gap.unit}."
        return " ".join([f"{said}. {falls}", *found.caveats])
    if found.verdict == "consistent":
        if found.reference:
            return nothing_changed(found)
        text = "The model explains the records: its error is no larger than the noise of the sensors allows."
        return " ".join([text, *found.noise_floor.remarks[:1]])
    what = ("Something has changed that no parameter and no effect of the catalog explains" if found.reference else
            "Something is missing in the model that no effect of the catalog explains")
    return (f"{what}: the error on {records} is {gap.before:.2g} {gap.unit}, noise alone would give {gap.noise:.2g} "
            f"{gap.unit}.")


def number_that_matters(found: Diagnosis) -> tuple[str, str, str]:
    """The error of the model, before and after, and that of noise alone.

    Parameters
    ----------
    found : Diagnosis
        What was found.
    """
    gap, records = _shown(found)
    size = f"{gap.before:.2g} → {gap.after:.2g} {gap.unit}" if found.effects else f"{gap.before:.2g} {gap.unit}"
    return (f"Error of the model on {records}, root mean square", size,
            f"Noise alone would give {gap.noise:.2g} {gap.unit}.")


def accepted_in_words(found: Diagnosis) -> str:
    """The accepted effects at their places, each with what the records cannot distinguish from it.

    Parameters
    ----------
    found : Diagnosis
        What was found.
    """
    sets = [[_accepted(effect, bool(found.reference)), *(in_words(name, where) for name, where in others)]
            for effect, others in zip(found.effects, found.alternatives, strict=True)]
    return ", and ".join(" or ".join(names) for names in sets)


def _shown(found: Diagnosis) -> tuple[Gap, str]:
    """The gap that counts: on records that no fit has seen, if there are any."""
    if "validation" in found.gap:
        return found.gap["validation"], "validation data"
    return found.gap["train"], "the new records" if found.reference else "the training data"


def _accepted(effect: Found, changed: bool) -> str:
    if changed and effect.effect == "parameter_change":
        return change_in_words(effect)
    return in_words(effect.effect, effect.where)


def in_words(name: str, where: tuple[str, ...]) -> str:
    """An effect at its place.

    Parameters
    ----------
    name : str
        Of the catalog, or your own.
    where : tuple of str
        Parts of the system it acts on.
    """
    if name == "parameter_change":
        return f"a change of {' and '.join(map(parameter_in_words, where))}"
    if name in _PATHS:
        return _PATHS[name].format(*where)
    return f"{name.replace('_', ' ')} at {', '.join(where)}"
