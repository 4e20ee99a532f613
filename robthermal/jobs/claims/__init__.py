"""What a report says of certificates: checked claims, their words, codes of reasons, assumptions."""

from ._assumptions import ARITHMETIC as ARITHMETIC
from ._assumptions import kind_assumptions as kind_assumptions
from ._assumptions import machine_assumptions as machine_assumptions
from ._checked import Certification as Certification
from ._checked import Checked as Checked
from ._codes import GateCode as GateCode
from ._linear_words import loop_margin as loop_margin
from ._linear_words import loop_title as loop_title
from ._linear_words import measure_of as measure_of
from ._required import required_claims as required_claims
from ._words import claim_of as claim_of

__all__ = ["ARITHMETIC", "Certification", "Checked", "GateCode", "claim_of", "kind_assumptions", "loop_margin",
           "loop_title",
           "machine_assumptions", "measure_of", "required_claims"]
