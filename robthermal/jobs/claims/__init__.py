"""What a report says of certificates: checked claims, their words, codes of reasons, assumptions.

What needs the checker loads on first use (PEP 562), as in `robthermal.jobs`: a diagnosis certifies nothing.
"""

from typing import TYPE_CHECKING

from ..._first_use import names_on_first_use
from ._assumptions import ARITHMETIC as ARITHMETIC
from ._assumptions import kind_assumptions as kind_assumptions
from ._assumptions import machine_assumptions as machine_assumptions
from ._codes import GateCode as GateCode

if TYPE_CHECKING:  # what type checkers and editors see of the table below
    from ._checked import Certification as Certification
    from ._checked import Checked as Checked
    from ._linear_words import loop_margin as loop_margin
    from ._linear_words import loop_title as loop_title
    from ._linear_words import measure_of as measure_of
    from ._required import required_claims as required_claims
    from ._words import claim_of as claim_of

_HOME = {  # name: the module it lives in
    **dict.fromkeys(("Certification", "Checked"), "_checked"),
    **dict.fromkeys(("loop_margin", "loop_title", "measure_of"), "_linear_words"),
    "claim_of": "_words",
    "required_claims": "_required",
}

__all__ = ["ARITHMETIC", "Certification", "Checked", "GateCode", "claim_of", "kind_assumptions", "loop_margin",
           "loop_title", "machine_assumptions", "measure_of", "required_claims"]

__getattr__ = names_on_first_use(__name__, _HOME)


def __dir__() -> list[str]:
    return __all__
