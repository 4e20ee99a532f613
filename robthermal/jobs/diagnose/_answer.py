"""The answer of a diagnosis in words that need no statistics."""

from __future__ import annotations

from ...diagnosis import Diagnosis, Found, Gap
from ...thermal import System
from ._change_words import change_in_words, gain_in_words, nothing_changed
from ._effect_words import at_place, labels_in_words

_SHRUNK = 0.9  # of the error: where more is left, free runs beside a room that was not recorded show no gain


def answer_sentence(found: Diagnosis) -> str:
    """What the model lacks or what has changed, and what adding it does to the error.

    Parameters
    ----------
    found : Diagnosis
        What was found.
    """
    gap, records = _shown(found)
    if found.effects:
        log = ", or the log is to be read otherwise" if found.means.startswith("The log may") else ""  # not beside it
        said = f"Since the reference records: {accepted_in_words(found)}" if found.reference else (
            f"The model lacks {accepted_in_words(found)}{log}")
        both = f"{gap.before:.2g} to {gap.after:.2g} {gap.unit}"
        beside = f"With {'it' if len(found.effects) == 1 else 'them'} the error on {records}"
        falls = f"{beside} falls from {both}."
        if found.fit.levels.wander and gap.after > _SHRUNK * gap.before:
            falls = f"{beside} goes from {both}: what a room that wanders does is in both."
        return " ".join([f"{said}. {falls}", *_finer(found), *map(labels_in_words, found.caveats)])
    if found.verdict == "consistent":
        if found.reference:
            return " ".join([nothing_changed(found), *found.caveats])
        text = "The model explains the records: its error is no larger than the noise of the sensors allows."
        return " ".join([text, *found.noise_floor.remarks[:1], *found.caveats])
    remarks = found.noise_floor.remarks[:1]
    if found.noise_floor.quiet:
        return " ".join(["The model moves and the readings do not.", *remarks])
    unfitted = found.nominal.takes_all_as_right
    parameter = "" if unfitted else "no parameter and "
    what = (f"Something has changed that {parameter}no effect of the catalog explains" if found.reference else
            "Something is missing in the model that no effect of the catalog explains")
    untried = "No change of a parameter was tried, for none is fitted: put what may have changed under [fit]." if (
        found.reference) else "Every number of the system was taken as right, for none is under [fit]."
    differ = found.differing
    first = str(differ) if differ is not None and not differ.needed else (
        f"{what}: the error on {records} is {gap.before:.2g} {gap.unit}, noise alone would give {gap.noise:.2g} "
        f"{gap.unit}.")
    last = str(differ) if differ is not None and differ.needed else ""
    return " ".join([first, *_finer(found), *([untried] if unfitted else []), *remarks,
                     *filter(None, [found.means, labels_in_words(found.nearest), last])])


def _finer(found: Diagnosis) -> list[str]:
    """What a lump split in two does to what is left, where that was asked for and helps."""
    finer = found.refinement
    if finer is None or not finer.outcome.ok:
        return []
    kind = "validation" if "validation" in finer.before else "train"
    named = [effect.label for effect in found.effects]
    beside = "" if list(finer.effects) == named else f" and {' and '.join(finer.effects) or 'without any effect'}"
    return [labels_in_words(f"With {finer.best}{beside}, the remainder falls from {finer.before[kind]:.2g} to "
                            f"{finer.after[kind]:.2g} K.")]


def number_that_matters(found: Diagnosis) -> tuple[str, str, str]:
    """The error of the model, before and after, and that of noise alone.

    Parameters
    ----------
    found : Diagnosis
        What was found.
    """
    gap, records = _shown(found)
    size = f"{gap.before:.2g} → {gap.after:.2g} {gap.unit}" if found.effects else f"{gap.before:.2g} {gap.unit}"
    cause = "Noise and a room that wanders" if found.fit.levels.wander else "Noise alone"
    return f"Error of the model on {records}, root mean square", size, f"{cause} would give {gap.noise:.2g} {gap.unit}."


def accepted_in_words(found: Diagnosis) -> str:
    """The accepted effects at their places, each with what the records cannot distinguish from it.

    Parameters
    ----------
    found : Diagnosis
        What was found.
    """
    system = found.nominal.system
    sets = [[_accepted(system, effect, bool(found.reference)), *(at_place(system, *other) for other in others)]
            for effect, others in zip(found.effects, found.alternatives, strict=True)]
    between = "; and " if any(len(names) > 2 for names in sets) and len(sets) > 1 else ", and "
    return between.join(map(_one_of, sets))


def _one_of(names: list[str]) -> str:
    return " or ".join(filter(None, (", ".join(names[:-1]), names[-1])))


def _shown(found: Diagnosis) -> tuple[Gap, str]:
    """The gap that counts: on records that no fit has seen, if there are any."""
    if "validation" in found.gap:
        return found.gap["validation"], "validation data"
    return found.gap["train"], "the new records" if found.reference else "the training data"


def _accepted(system: System, effect: Found, changed: bool) -> str:
    if changed and effect.effect == "parameter_change":
        return change_in_words(effect)
    if changed and effect.effect == "input_gain":
        return gain_in_words(effect)
    return at_place(system, effect.effect, effect.where)
