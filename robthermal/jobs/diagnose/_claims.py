"""What a diagnosis says on the first screen of its report: tests on data, never proofs."""

from __future__ import annotations

from collections.abc import Iterator

from ..._digits import probability
from ...diagnosis import Diagnosis
from ...report import Claim
from ._answer import accepted_in_words
from ._diagnose import Diagnosed
from ._effect_words import in_words

_SENTENCE = {
    "named": "One set of effects explains the records: {names}.",
    "named_with_remainder": "One set of effects is reproducibly better than every other: {names}. What is left beyond "
                            "the noise is stated, and has no name.",
    "ambiguous": "Effects explain the records, but other ones do as well: {names}.",
    "consistent": "The system as it is explains the records; nothing is missing that they could show.",
    "unexplained": "None of the known effects explains the records.",
}
_CHANGED = {
    "named": "One set of changes explains the new records: {names}.",
    "named_with_remainder": "One set of changes explains what is outside the scatter of the reference records: "
                            "{names}. What is left beyond the noise is stated, and has no name.",
    "ambiguous": "Changes explain the new records, but other ones do as well: {names}.",
    "consistent": "The new records are within the scatter of the reference records: nothing has changed that they "
                  "would show.",
    "unexplained": "Something has changed, and nothing that was tried explains it.",
}
_HOW_CHANGED = ("A change is accepted where healthy records exceed it with a chance below 0.03 for all parameters "
                "together, 0.01 for the effects of the catalog (F test with the scatter among the reference records).")
_WHY_NOT = {"ambiguous": "see the next experiment for what separates them",
            "unexplained": "a misfit beyond the noise stays with every one that was tried"}


def diagnosis_claims(result: Diagnosed) -> Iterator[Claim]:
    """Verdict, whiteness of what is left, prediction of validation records.

    Parameters
    ----------
    result : Diagnosed
        Diagnosis, as `diagnose_records` returns it.
    """
    found = result.diagnosis
    names = accepted_in_words(found)
    ruled_out = ", ".join(in_words(one.effect.name, one.where) for one in found.ruled_out)
    said = _SENTENCE if found.reference is None else _CHANGED
    title = f"Verdict: {found.verdict.replace('_', ' ')}"
    yield _claim(title, said[found.verdict].format(names=names), found.outcome.ok,
                 _WHY_NOT.get(found.verdict, found.outcome.text), _records(result, "train"), _margin(found),
                 _HOW_CHANGED if found.reference else
                 "An effect is accepted with p < 0.01 for all candidates together (F test) and ΔBIC > 10; effects "
                 "within ΔBIC 10 of it are alternatives"
                 + (f", but {ruled_out}: more than 10 behind with the density of the validation records added."
                    if ruled_out else "."))
    if found.reference is not None or found.verdict == "named_with_remainder":  # a remark states what is left
        return
    yield _claim("Nothing is left in the training records", "What the model leaves is white, and no lump has a heat "
                 "left over.", found.adequacy.outcome.ok, found.adequacy.outcome.text, _records(result, "train"),
                 f"{probability(found.adequacy.p_value)}, must be above 0.001",
                 "Portmanteau tests of the innovations, and a spline of heat into every lump.")
    if found.hold_out is not None:
        outcome = found.hold_out.outcome
        yield _claim("Unseen records are predicted", "Records that no fit has seen are predicted as well as the "
                     "training records are fitted, give or take the uncertainty of the parameters.", outcome.ok,
                     outcome.text, _records(result, "validation"),
                     f"{probability(found.hold_out.p_value)}, must be above 0.0001",
                     "F test of the whitened prediction errors against those of the training records."
                     + (f" The same records ruled out {ruled_out}; p is not corrected for that." if ruled_out else ""))


def diagnosis_assumptions(found: Diagnosis) -> Iterator[str]:
    """What the claims rest on.

    Parameters
    ----------
    found : Diagnosis
        What was found.
    """
    yield "A name is the best explanation among the effects of the catalog; a cause outside it has no name here."
    if found.reference is not None:
        yield (f"The {found.reference.records} reference records are of a healthy machine, and scatter as healthy days "
               "do; before any record is seen the scatter of a parameter is taken to be 3 %, which counts as much as "
               "four records.")
    if found.reference is not None or found.ambients:
        yield "An ambient that a record does not hold, and initial temperatures, are unknowns of each record."
    yield "Nothing is proven: all numbers are estimates, and all answers are tests on these records."
    units = found.system.sensor_units
    yield ("Noise of the sensors and random heats are white and Gaussian, with levels near the declared ones: "
           + ", ".join(f"{name} {level:.3g} {units.get(name, 'K')}"
                       for name, level in found.noise_floor.noise.items()) + ".")
    yield "Inputs and ambients are held between samples; sensors are read at the samples."
    if found.hold_out is None:
        yield "No validation record was given: that validation records are predicted was not tested."


def _claim(title: str, sentence: str, holds: bool, reason: str, box: str, margin: str, how: str) -> Claim:
    return Claim(title, sentence, bool(holds), None, box, margin, how, "" if holds else reason, kind="diagnosis",
                 tested=True)


def _records(result: Diagnosed, kind: str) -> str:
    called = "new" if kind == "train" and result.diagnosis.reference is not None else kind
    own = [one for one in result.residuals if one.kind == kind]
    kelvin = {one.name for one in own if one.unit == "K"}  # what a record leaves in volts is listed beside it
    said = [f"{called}: {one.name}, {len(one.time)} samples" for one in own
            if one.unit == "K" or one.name not in kelvin]
    said += [f"{kind}: {one.name}, {one.frequency.size} bins" for one in result.responses if kind == "train"]
    return "; ".join(said)


def _margin(found: Diagnosis) -> str:
    said = [f"{in_words(effect.effect, effect.where)}: ΔBIC {effect.delta_bic:.0f}" for effect in found.effects]
    return "; ".join(said) or "no effect accepted"
