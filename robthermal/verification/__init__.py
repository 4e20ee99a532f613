"""The trusted kernel: a certificate is a claim with its exact data, and every kind has a checker that proves it again.

Imports the standard library, numpy and python-flint, and no solver: nothing a solver says is evidence.
"""

from __future__ import annotations

from ._certificate import Certificate as Certificate
from ._kinds import KINDS as KINDS
from ._machine import machine_hash as machine_hash
from ._machine import same_system as same_system
from ._verify import Verdict as Verdict
from ._verify import claim_sentence as claim_sentence
from ._verify import establish as establish
from ._verify import not_certified as not_certified
from ._verify import verify as verify

__all__ = ["Certificate", "Verdict", "claim_sentence", "establish", "machine_hash", "not_certified", "same_system",
           "verify"]
