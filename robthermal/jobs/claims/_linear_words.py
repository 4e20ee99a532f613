"""A claim about a designed loop in words, made from its certificate alone: title, sentence, margin, proof."""

from __future__ import annotations

import re

from ..._digits import downwards, upwards
from ...verification import Certificate

_TITLES = {"frequency": "Structured singular value", "hinf": "H-infinity norm", "h2": "H2 norm",
           "region": "Region of the eigenvalues", "stability": "Stability", "peak": "Peak gain",
           "scheduled": "From every start in the ellipsoid", "ellipsoid": "The ellipsoid is never left"}
_FORMED = "Loop formed from plant and controller in rational numbers; re-derived in ball arithmetic."
_HOW = {"frequency": "About the loop's matrices in floating-point numbers, as in the file; re-derived in ball "
                     "arithmetic at every frequency.",
        "polytope": "Loops at the vertices formed in rational numbers; one form for all, decided in ball arithmetic.",
        "ellipsoid": "Loop formed in rational numbers; set, limits and cost decided in ball arithmetic.",
        "scheduled": "Hull of all slopes of the box built by the checker in rational numbers; decided in balls."}
_DIGITS = 6  # of a number on the first screen; the exact claim has them all
_BOUND = re.compile(r"(?<= below )\d+\.\d+(?:e[+-]\d+)?")


def is_of_synthesis(stem: str) -> bool:
    """Whether a file of this name holds a claim about a designed loop: the files of a synthesis are numbered.

    Parameters
    ----------
    stem : str
        Name of the certificate file, without folder and ending.
    """
    return re.match(r"\d+_", stem) is not None


def measure_of(certificate: Certificate) -> str:
    """What is claimed of the loop, in one word, for the name of the file.

    Parameters
    ----------
    certificate : Certificate
        Of a synthesis.
    """
    return str(certificate.region.get("measure", certificate.kind))


def loop_title(certificate: Certificate) -> str:
    """Short name of the claim.

    Parameters
    ----------
    certificate : Certificate
        Of a synthesis.
    """
    if certificate.kind == "ellipsoid" and "bound" in certificate.region:
        return "L2 gain from rest, for disturbances of limited energy"
    measure = measure_of(certificate)
    return _TITLES.get(measure, measure)


def loop_sentence(certificate: Certificate) -> str:
    """The claim with bounds of six digits, rounded to the weaker side.

    Parameters
    ----------
    certificate : Certificate
        Of a synthesis.
    """
    return _BOUND.sub(lambda found: upwards(float(found.group()), _DIGITS), certificate.claim)


def loop_margin(certificate: Certificate) -> str:
    """The number of the claim, never stronger than it is.

    Parameters
    ----------
    certificate : Certificate
        Of a synthesis.
    """
    region = certificate.region
    if "bound" in region:
        return f"below {upwards(region['bound'], _DIGITS)}"
    if certificate.kind == "frequency":
        return f"below {upwards(max(region['bounds']), _DIGITS)} at every frequency"
    if region.get("rate"):
        unit = "" if certificate.system.get("sample_time") else " 1/s"
        return f"rate at least {downwards(region['rate'], _DIGITS)}{unit}"
    if "level" in region:
        return f"all starts up to level {downwards(region['level'], _DIGITS)}"
    return "yes or no: no number is stated"


def loop_proof(certificate: Certificate) -> str:
    """How it was proven.

    Parameters
    ----------
    certificate : Certificate
        Of a synthesis.
    """
    return _HOW.get(certificate.kind, _FORMED)
