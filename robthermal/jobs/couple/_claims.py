"""Claims of a coupling, for the first screen of its report, and what they rest on."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...report import Claim
from ..claims import ARITHMETIC, Checked
from ._couple import LIMITED, Coupling

_HOW = {
    "stability": "A Lyapunov function of the whole loop; re-derived in ball arithmetic.",
    "frequency": "Multipliers on intervals that cover every frequency; re-derived in ball arithmetic.",
    "hinf": "Bounded real lemma; re-derived in ball arithmetic.",
}


def coupling_claims(result: Coupling) -> Iterator[Claim]:
    """The failure first, where there is one; then everything required that is proven.

    Parameters
    ----------
    result : Coupling
        Coupling, as `couple_subsystems` returns it.
    """
    filters = result.filters
    if not filters.holds:
        yield Claim("What was asked for", "The filters do everything that was asked for.", False, None,
                    box=_about("robust", result), margin="none", how="Every number computed again from the filters.",
                    reason=filters.outcome.text)
    for one in result.checked:
        if one.required and result.found:
            yield _claim(one, result)


def coupling_assumptions(result: Coupling) -> Iterator[str]:
    """What the claims rest on.

    Parameters
    ----------
    result : Coupling
        Coupling, as `couple_subsystems` returns it.
    """
    yield "Subsystems, controllers and filters are linear and do not vary with time; no actuator saturates."
    yield ("Certificates speak of the floating-point numbers of models, controllers and filters in their files. MA, "
           "MSD, H2 norms, the small-gain number, spectra and worst cases are computed, not proven.")
    yield "The disturbances are as stated in the file; without any, white noise of variance 1 (continuous: PSD 1)."
    if result.job.measured:
        yield ("Between two measured frequencies the larger of the two envelope values holds, below the first and "
               "above the last the end value; the measured plants have as many unstable poles as the model.")
        yield from (remark.text for remark in result.remarks)
        uncertainty = result.filters.problem.uncertainty
        if uncertainty is not None and uncertainty.confidence is not None and result.job.circles:
            yield (f"The envelope includes the confidence circles of the measured values. All true values are in their "
                   f"circles at once with a probability of {100 * uncertainty.confidence:g} % at least (Bonferroni's "
                   "inequality over every plant, entry and frequency), for estimates without bias.")
        if result.job.measured_in_closed_loop:
            yield ("The controllers stabilize the measured plants: they were measured while these controllers ran "
                   "and stayed bounded. The file states it (measured_in_closed_loop = true); no encirclement was "
                   "counted, no record examined.")
    yield ARITHMETIC


def _claim(one: Checked, result: Coupling) -> Claim:
    sentence, margin = _words(one.key, result)
    reason = "" if one.good or one.verdict is None else one.verdict.reason
    return Claim(one.title, sentence, one.certificate.holds, one.good, _about(one.key, result),
                 margin if one.good else "none", _HOW[one.certificate.kind], reason, f"certificates/{one.key}.json",
                 one.certificate.kind, one.verdict.seconds if one.verdict else 0.0)


def _words(key: str, result: Coupling) -> tuple[str, str]:
    """Sentence and margin."""
    norms = result.filters.norms
    if key == "stability":
        return "The two loops with the coupling are internally stable.", "yes or no: no number is stated"
    if key == "robust":
        factor = f"{1 / norms['robust']:.4g} times the envelope" if norms["robust"] else "an envelope of any size"
        return (f"The coupled loops are stable for every plant whose Δp stays under the envelope: ρ(|Δk| R) is at most "
                f"{norms['robust']:.4g} at every frequency.", f"stable up to {factor}")
    norm = LIMITED[key]
    asked, reached = result.filters.asked[norm.key], norms[norm.key]
    meaning = ": the coupled controller has no unstable mode that C1 and C2 have not" if norm.key == "XY" else ""
    return f"{norm.symbol} is at most {reached:.4g}{meaning}.", f"{asked - reached:.3g} below the limit {asked:.4g}"


def _about(key: str, result: Coupling) -> str:
    uncertainty = result.filters.problem.uncertainty
    if key != "robust" or uncertainty is None:
        return "the models of the file"
    first, last = uncertainty.omega[[0, -1]] / (2 * np.pi)
    return (f"the models of the file; envelope of {len(uncertainty.samples)} measured plants, {first:.4g} to "
            f"{last:.4g} Hz")
