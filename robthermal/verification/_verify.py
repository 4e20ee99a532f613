"""Check a certificate from its data alone, or make one that has passed this check."""

from __future__ import annotations

import re
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from robthermal.errors import InputError

from ._certificate import Certificate
from ._kind import Proof
from ._kinds import KINDS
from ._machine import machine_hash
from ._numbers import name_of

_NOT_CERTIFIED = "Not certified: "
_MACHINE = re.compile(r"machine [0-9a-f]{12}\b")


@dataclass(frozen=True)
class Verdict:
    """What the checker found.

    Parameters
    ----------
    valid : bool
        Whether the claim was proven from the certificate's data.
    margins : dict
        Margins that the checker computed [unit of each margin].
    reason : str
        The inequality that fails, or how it was proven; never empty when not valid.
    seconds : float
        Time the check took [s].
    claim : str
        The sentence that was proven; empty when not valid.
    """

    valid: bool
    margins: dict[str, float]
    reason: str
    seconds: float
    claim: str = ""

    def __bool__(self) -> bool:
        return self.valid

    def __str__(self) -> str:
        return f"valid: {self.claim}\nProof: {self.reason}" if self.valid else f"not valid: {self.reason}"


def verify(certificate: Certificate) -> Verdict:
    """Prove the claim of a certificate again, from its own numbers, in exact or ball arithmetic.

    Parameters
    ----------
    certificate : Certificate
        Loaded from a file or just made.

    Returns
    -------
    Verdict
        Valid only if every inequality of the claim is proven.

    Raises
    ------
    InputError
        If the content is malformed.

    Examples
    --------
    >>> rod = {"lumps": {"rod": {"capacity": 10.0}}, "ambients": ["room"], "modules": {},
    ...        "links": [{"between": ["rod", "room"], "conductance": 0.5}]}
    >>> box = {"temperature": [250.0, 400.0], "current": {}}
    >>> c = establish("contraction", system=rod, region=box, evidence={"method": "energy", "rate": 0.06}, made_by={})
    >>> c.holds, verify(c).valid
    (False, False)
    """
    start = time.perf_counter()
    if not isinstance(certificate, Certificate):
        raise InputError(f"{type(certificate).__name__} is not a certificate", where="certificate",
                         expected="a Certificate", remedy="Read the file with Certificate.load.")
    problem = certificate.check_form()
    if certificate.holds:
        proof = _check(certificate, problem)
    else:
        proof = Proof(False, certificate.reason or "the certificate itself says that its claim does not hold")
    return Verdict(proof.valid, dict(proof.margins), proof.reason, time.perf_counter() - start,
                   certificate.claim if proof.valid else "")


def establish(kind: str, *, system: Mapping[str, Any], region: Mapping[str, Any], evidence: Mapping[str, Any],
              made_by: Mapping[str, Any], margin: Mapping[str, float] | None = None) -> Certificate:
    """Make a certificate that holds only if the checker proves it.

    Parameters
    ----------
    kind : str
        Kind of claim.
    system, region, evidence : mapping
        Sections of the certificate file, SI units; numpy arrays are allowed.
    made_by : mapping
        Versions, solver and its status.
    margin : mapping, optional
        Margin to store and prove; by default the checker looks for one. ``{}`` stores none and is fastest.

    Returns
    -------
    Certificate
        With ``holds`` False and the failing inequality as ``reason`` where the claim is not proven.

    Raises
    ------
    InputError
        If a section is malformed.

    Examples
    --------
    >>> rod = {"lumps": {"rod": {"capacity": 10.0}}, "ambients": ["room"], "modules": {},
    ...        "links": [{"between": ["rod", "room"], "conductance": 0.5}]}
    >>> box = {"temperature": [250.0, 400.0], "current": {}}
    >>> c = establish("contraction", system=rod, region=box, made_by={},
    ...               evidence={"method": "sum", "rate": 0.04, "weights": [1.0]})
    >>> c.holds, c.margin
    (True, {'rate': 0.00999})
    """
    if kind not in KINDS:
        raise InputError(f"kind {name_of(kind)}", where="kind", expected=f"one of {sorted(KINDS)}")
    certificate = Certificate(kind=kind, claim=claim_sentence(kind, system, region, evidence), system=plain(system),
                              region=plain(region), evidence=plain(evidence), margin=plain(margin or {}),
                              made_by=plain(made_by))
    problem = certificate.check_form()
    proof = KINDS[kind].prove(problem)
    if not proof.valid:
        return replace(certificate, claim=_NOT_CERTIFIED + certificate.claim, holds=False, reason=proof.reason)
    if margin is None:
        certificate = replace(certificate, margin=KINDS[kind].find_margin(problem))
    return certificate


def not_certified(kind: str, *, system: Mapping[str, Any], region: Mapping[str, Any], evidence: Mapping[str, Any],
                  reason: str, made_by: Mapping[str, Any], claim: str = "") -> Certificate:
    """Make the certificate of a claim that is not proven: there is no evidence that could be checked.

    Parameters
    ----------
    kind : str
        Kind of claim.
    system, region, evidence : mapping
        Sections of the certificate file, SI units; the evidence may be incomplete.
    reason : str
        Why nothing is certified.
    made_by : mapping
        Versions, solver and its status.
    claim : str
        What was asked for, in one sentence.

    Returns
    -------
    Certificate
        With ``holds`` False.

    Examples
    --------
    >>> not_certified("contraction", system={}, region={}, evidence={}, made_by={},
    ...               reason="no weights exist", claim="The rod contracts.").claim
    'Not certified: The rod contracts.'
    """
    return Certificate(kind=kind, claim=_NOT_CERTIFIED + (claim or kind), system=plain(system), region=plain(region),
                       evidence=plain(evidence), margin={}, made_by=plain(made_by), holds=False,
                       reason=reason or "not certified")


def claim_sentence(kind: str, system: Mapping[str, Any], region: Mapping[str, Any],
                   evidence: Mapping[str, Any]) -> str:
    """Return the one sentence that a certificate's data give.

    Parameters
    ----------
    kind : str
        Kind of claim.
    system, region, evidence : mapping
        Sections of the certificate file, SI units.

    Returns
    -------
    str
        The claim; a certificate with any other sentence is rejected.

    Raises
    ------
    InputError
        If the kind is unknown or a section is malformed.

    Examples
    --------
    >>> system = {"capacity": [10.0], "rows": [0], "cols": [0], "values": [-0.5]}
    >>> claim_sentence("network", system, {}, {"rate": 0.04, "weights": [1.0]})
    'The thermal network of 1 lumps and 1 entries (machine ...), continuous plant, nominal parameters, is stable: ...'
    """
    if kind not in KINDS:
        raise InputError(f"kind {name_of(kind)}", where="kind", expected=f"one of {sorted(KINDS)}")
    return KINDS[kind].claim(KINDS[kind].read(system, region, evidence, {}), machine_hash(system))


def _check(certificate: Certificate, problem: Any) -> Proof:
    kind = KINDS[certificate.kind]
    sentence = kind.claim(problem, machine_hash(certificate.system))
    if certificate.claim == sentence:
        return kind.prove(problem)
    if not _MACHINE.search(certificate.claim):
        return Proof(False, "the claim names no machine: an earlier version made this file. Make the certificate again "
                            f"from the machine itself. Its data give the sentence: {sentence}")
    return Proof(False, f"the claim is not the one the data give, which is: {sentence}")


def plain(value: Any) -> Any:
    """Return a copy of plain objects, lists and numbers; long arrays stay arrays (large networks are not listed)."""
    if isinstance(value, Mapping):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return value.copy() if value.size > 100_000 else value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    return value
