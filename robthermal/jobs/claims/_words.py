"""A claim of the report in words, made from its certificate alone: title, sentence, box, margin, proof."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from math import log
from typing import Any

from ..._celsius import ZERO_CELSIUS
from ..._digits import downwards, inward, outward, upwards
from ...report import Claim, Parameters
from ...verification import Certificate, Verdict
from ._linear_words import is_of_synthesis, loop_margin, loop_proof, loop_sentence, loop_title

_ENDING = "_ranges"
_LISTED = 3  # parameters named in the box of a claim; the exact claim names all
_TITLES = {  # by key; the first is the one of a job
    "contraction": ("Contraction in the stated box", "Contraction at the current limits"),
    "box": ("The box is never left",), "box_contraction": ("Contraction in the box that is never left",),
    "observer": ("The observer's error shrinks",),
}
_SENTENCES = {  # the exact sentences, with all numbers, are in the appendix, "Exact claims"
    "contraction": "For every lump temperature and module current in the box, however the currents change, any two "
                   "temperature histories approach each other. That the temperatures stay in this box is not part of "
                   "this claim.",
    "box": "A machine that starts inside the ranges of its lumps stays inside them, whatever the currents, heats and "
           "ambients do within theirs.",
    "box_contraction": "Inside those ranges any two temperature histories approach each other too.",
    "observer": "For every temperature, estimate and current in the box the error of the observer shrinks from sample "
                "to sample, however the currents change.",
}
_WITHOUT_MODULES = {
    "contraction": "For every lump temperature in the box any two temperature histories under the same inputs "
                   "approach each other. That the temperatures stay in this box is not part of this claim.",
    "box": "A machine that starts inside the ranges of its lumps stays inside them, whatever the heats and ambients do "
           "within theirs.",
}
NO_RUNAWAY = " Together with the claim that the box is never left: no thermal runaway from there."
_ROW_OF_MAP = re.compile(r"map_(\d+)_(never_left|contraction)")
_HOW = {
    "contraction": "One norm in which the Jacobian contracts everywhere in the box; re-derived in ball arithmetic.",
    "invariance": "On every face of the box the heat flows inwards (Nagumo); re-derived in ball arithmetic.",
    "observer": "One norm in which the sampled error shrinks everywhere in the box; re-derived in ball arithmetic.",
}


def claim_of(file: str, certificate: Certificate, verdict: Verdict | None, *, title: str = "", breaks: str = "",
             usable: bool = False, seconds: float | None = None) -> Claim:
    """What a report says of a certificate; nothing of it comes from anywhere else.

    Parameters
    ----------
    file : str
        Place of the certificate in the results folder; its name says which claim of a report it is.
    certificate : Certificate
        What is claimed.
    verdict : Verdict or None
        What the check said.
    title : str, optional
        Title that is wanted, if it is one of those this claim may have.
    breaks : str, optional
        What makes it fail for the parameter ranges.
    usable : bool, optional
        Whether the box is never left for the same currents, all of them inside the usable range: only then is
        "no thermal runaway" said.
    seconds : float, optional
        Duration of the check, if another than that of `verdict` is to be shown [s].
    """
    stem = file.rpartition("/")[2].removesuffix(".json")
    if is_of_synthesis(stem):
        return _of_synthesis(file, certificate, verdict, seconds)
    ranges = stem.endswith(_ENDING)
    key = stem.removesuffix(_ENDING)
    row = _ROW_OF_MAP.fullmatch(key)
    titles = _TITLES.get(key, (key.replace("_", " ").capitalize(),))
    if row:
        key = "box" if row[2] == "never_left" else "box_contraction"
        titles = (f"Condition {row[1]}: {_TITLES[key][0][0].lower()}{_TITLES[key][0][1:]}",)
    good = certificate.holds and verdict is not None and verdict.valid
    reason = certificate.reason if not certificate.holds else "" if good else verdict.reason if verdict else (
        "not verified")
    if breaks and not certificate.holds:
        reason = f"{breaks}; {reason}"
    parameters: Parameters = "ranges" if ranges else "nominal" if key in _JOB else ""
    return Claim(title=title if title in titles else titles[0], sentence=_sentence(key, certificate, usable and good),
                 holds=certificate.holds, verified=good, box=box_of(certificate),
                 margin=_margin(certificate, verdict) if good and verdict else "none",
                 how=_HOW.get(certificate.kind, "re-derived in ball arithmetic"), reason=reason, file=file,
                 kind=certificate.kind, parameters=parameters,
                 seconds=seconds if seconds is not None else verdict.seconds if verdict else 0.0)


_JOB = ("contraction", "box", "box_contraction", "observer")


def _of_synthesis(file: str, certificate: Certificate, verdict: Verdict | None, seconds: float | None) -> Claim:
    good = certificate.holds and verdict is not None and verdict.valid
    reason = certificate.reason if not certificate.holds else "" if good else verdict.reason if verdict else (
        "not verified")
    box = box_of(certificate) if certificate.kind == "scheduled" else "the plant of the file"
    return Claim(loop_title(certificate), loop_sentence(certificate), certificate.holds, good, box,
                 loop_margin(certificate) if good else "none", loop_proof(certificate), reason, file, certificate.kind,
                 seconds if seconds is not None else verdict.seconds if verdict else 0.0)


def _sentence(key: str, certificate: Certificate, usable: bool) -> str:
    modules = certificate.system.get("modules") or certificate.region.get("current")
    found = (_SENTENCES if modules else _SENTENCES | _WITHOUT_MODULES).get(key)
    if found is None:
        return certificate.claim
    return found + NO_RUNAWAY if key == "box_contraction" and usable else found


def box_of(certificate: Certificate) -> str:
    """Ranges of a claim, separated by semicolons: never wider than they are, of a box that is kept never narrower.
    """
    region = certificate.region
    parts = [f"{name}: {_range(pair)} A" for name, pair in _pairs(region, "current")]
    box = region.get("temperature")
    if isinstance(box, Mapping):
        ends = [float(value) - ZERO_CELSIUS for pair in box.values() for value in pair]
        overall = outward if certificate.kind == "invariance" else inward
        parts.append(f"every lump in its own range, overall {overall(min(ends), max(ends), 3)} °C")
    elif isinstance(box, (list, tuple)):
        parts.append(f"all lumps {_celsius(box)} °C")
    parts += [f"{name}: {_celsius(pair)} °C" for name, pair in _pairs(region, "ambient")]
    parts += [f"heat into {name}: {_range(pair)} W" for name, pair in _pairs(region, "heat")]
    heaters = dict(_pairs(certificate.system, "inputs"))
    for name, pair in _pairs(region, "power"):
        if name in heaters:
            at = float(heaters[name]["reference_temperature"]) - ZERO_CELSIUS
            parts.append(f"heater {name}: {_range(pair)} W at {at:.6g} °C, linear in its temperature")
    uncertain = [f"{name} {_range(pair)}" for name, pair in _pairs(region, "parameters")]
    if uncertain:
        listed = f": {', '.join(uncertain)}" if len(uncertain) <= _LISTED else ", as the file states them"
        parts.append(f"{len(uncertain)} parameters in their ranges{listed}" if len(uncertain) > 1 else
                     f"1 parameter in its range{listed}")
    return "; ".join(parts)


def _celsius(pair: Any) -> str:
    return _range([float(end) - ZERO_CELSIUS for end in pair])


def _range(pair: Sequence[float]) -> str:
    """Ends rounded inward; one number to the nearest where they are equal."""
    low, high = pair
    return f"{float(low):.6g}" if low == high else inward(low, high)


def _pairs(region: Mapping[str, Any], key: str) -> list[tuple[str, Any]]:
    found = region.get(key)
    return list(found.items()) if isinstance(found, Mapping) else []


def _margin(certificate: Certificate, verdict: Verdict) -> str:
    if certificate.kind == "observer":
        factor = float(certificate.evidence["contraction"])
        tau = -float(certificate.region["sample_time"]) / log(factor)
        return (f"errors die out with a time constant of at most {upwards(tau, 4)} s (factor "
                f"{upwards(factor, 6)} per sample)")
    if certificate.kind == "contraction":
        rate = float(certificate.evidence["rate"])
        if rate > 0.0:
            return (f"differences die out with a time constant of at most {upwards(1 / rate, 4)} s "
                    f"(rate {downwards(rate, 4)} 1/s)")
    return ", ".join(f"at least {downwards(value, 3)} W flow inwards on every face" if key == "heat"
                     else f"{key} {value:.3g}" for key, value in verdict.margins.items())
