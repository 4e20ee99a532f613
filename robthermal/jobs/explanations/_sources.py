"""What the packages say of their effects, certificates, codes and reasons: the source of `known.json`."""

from __future__ import annotations

import inspect
import sys

from ...errors import OutcomeCode
from ...verification import KINDS
from ..claims import ARITHMETIC, GateCode, kind_assumptions
from ._codes import outcome_codes, package_of
from ._effect_words import explained_effects
from ._explanation import Explanation

_PAGES = {"loop": "loops", **dict.fromkeys(("stability", "hinf", "peak", "frequency", "closed_loop",
                                            "polytope", "ellipsoid"),
                                           "linear_certificates")}
_ANSWER = {True: "the answer is yes", False: "the answer is no", None: "the answer depends"}


def collected() -> tuple[Explanation, ...]:
    """Explanations of every effect, kind of certificate, code and reason, as the packages say them now.

    Returns
    -------
    tuple of Explanation
        Kept in `known.json`, because asking every package imports all of them.

    Examples
    --------
    >>> from robthermal.jobs.explanations import collected
    >>> {one.what for one in collected()} == {"effect", "certificate", "outcome", "reason"}
    True
    """
    return (*explained_effects().values(), *map(_certificate, KINDS),
            *(_outcome(name, codes) for name, codes in outcome_codes().items()),
            *(Explanation(code.code, "reason", (code.meaning,), {"What to do": (code.remedy,)},
                          "docs/explanations/report.md") for code in GateCode))


def _certificate(name: str) -> Explanation:
    text = inspect.cleandoc(sys.modules[KINDS[name].claim.__module__].__doc__ or "")
    paragraphs = [" ".join(part.split()) for part in text.split("\n\n")]
    first = paragraphs[0].removeprefix(f'Kind "{name}": ')
    return Explanation(name, "certificate", (first[0].upper() + first[1:], *paragraphs[1:]),
                       {"Assumed, not proven": (*kind_assumptions(name), ARITHMETIC)},
                       f"docs/explanations/{_PAGES.get(name, 'certificates')}.md")


def _outcome(name: str, codes: tuple[OutcomeCode, ...]) -> Explanation:
    told = tuple(f"{package_of(code)}, {_ANSWER[code.ok]}: {code.meaning} {code.remedy}".rstrip() for code in codes)
    return Explanation(name, "outcome", ("How a computation ended; its text has the numbers.",), {"Said by": told},
                       "docs/explanations/outcomes.md")
