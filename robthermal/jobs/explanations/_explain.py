"""What a name means: an effect, a kind of certificate, the code of an outcome, an error, a word of a report."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from difflib import get_close_matches

from ... import errors
from ...diagnosis import Effect, Quantity, effects
from ...errors import InputError, OutcomeCode
from ...verification import KINDS
from ..claims import ARITHMETIC, GateCode, kind_assumptions
from ._codes import outcome_codes, package_of
from ._glossary import GLOSSARY, WORDS_PAGE

_PAGES = {"loop": "loops", **dict.fromkeys(("stability", "hinf", "peak", "frequency", "closed_loop",
                                            "polytope", "ellipsoid"),
                                           "linear_certificates")}
_ERRORS = {cls.__name__: cls for cls in (errors.InputError, errors.Diverged)}
_REASONS = {code.code: code for code in GateCode}
_ANSWER = {True: "the answer is yes", False: "the answer is no", None: "the answer depends"}


@dataclass(frozen=True)
class Explanation:
    """What one name means.

    Parameters
    ----------
    name : str
        As it stands in files, tables and messages.
    what : str
        "effect", "certificate", "outcome", "reason", "error" or "word".
    meaning : tuple of str
        Paragraphs that say what it means.
    details : dict of str to tuple of str
        By heading: assumptions, confusable partners, what separates them.
    page : str
        Page of the documentation; of a word its list, and the page that derives it.
    """

    name: str
    what: str
    meaning: tuple[str, ...]
    details: dict[str, tuple[str, ...]]
    page: str

    def __str__(self) -> str:
        lines = [f"{self.name}: {self.what}", *self.meaning]
        for heading, texts in self.details.items():
            lines += [f"{heading}:", *(f"  - {text}" for text in texts)]
        return "\n".join([*lines, f"Documentation: {self.page}"])


_CHANGE = Explanation("parameter_change", "effect",
                      ("A parameter of [fit] has another value on the new records than on the reference records, by "
                       "more than healthy records scatter.",),
                      {"Acts on": ("parameter of [fit]; tied parameters together",),
                       "Quantities": ("relative [-], the change over the value on a healthy day",)},
                      "docs/explanations/diagnosis_change.md")
_DRIFT = Explanation("ambient_drift", "effect",
                     ("An ambient that a record does not hold is not the constant of the system: it swings or drifts. "
                      "Tried wherever a periodic heat is, and only where the ambient is not recorded.",),
                     {"Acts on": ("ambient",),
                      "Quantities": ("difference [K], half of the swing", "period [s]", "phase [rad]"),
                      "Confused with": ("periodic_load",), "Told apart by": ("a record of the ambient",)},
                     "docs/explanations/diagnosis_data.md")
_OTHERS = {one.name: one for one in (_CHANGE, _DRIFT)}  # effects of a diagnosis that are not in the catalog


def explainable() -> dict[str, tuple[str, ...]]:
    """Every name that `explain` knows, by what it is.

    Returns
    -------
    dict of str to tuple of str

    Examples
    --------
    >>> import robthermal as rt
    >>> "sensor_lag" in rt.jobs.explainable()["effect"]
    True
    """
    return {"effect": (*effects(), *_OTHERS), "certificate": tuple(KINDS), "outcome": tuple(outcome_codes()),
            "reason": tuple(_REASONS), "error": tuple(_ERRORS), "word": tuple(GLOSSARY)}


def explain(name: str) -> tuple[Explanation, ...]:
    """Explain a name that stands in a report, a message, a certificate or a diagnosis.

    Parameters
    ----------
    name : str
        Of an effect, a kind of certificate, the code of an outcome, the reason of a verdict, an error, or a word of
        a report, its first letter small or large.

    Returns
    -------
    tuple of Explanation
        More than one where a name has several meanings.

    Raises
    ------
    InputError
        Nothing has this name; the nearest are listed.

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.jobs.explain("radiation")[0].details["Confused with"]
    ('natural_convection', 'missing_ambient_link')
    """
    found = tuple(_all(name))
    if not found:
        known = list(dict.fromkeys(one for names in explainable().values() for one in names))
        near = get_close_matches(name, known, n=4, cutoff=0.5)
        raise InputError(f"nothing is called {name!r}", where="explain",
                         expected=f"one of {', '.join(near)}" if near else "",
                         remedy="`robthermal explain` without a name lists all.")
    return found


def _all(name: str) -> Iterator[Explanation]:
    if name in effects():
        yield _effect(effects()[name])
    if name in _OTHERS:
        yield _OTHERS[name]
    if name in KINDS:
        yield _certificate(name)
    if name in outcome_codes():
        yield _outcome(name, outcome_codes()[name])
    if name in _REASONS:
        yield Explanation(name, "reason", (_REASONS[name].meaning,), {"What to do": (_REASONS[name].remedy,)},
                          "docs/explanations/report.md")
    if name in _ERRORS:
        text = inspect.getdoc(_ERRORS[name]) or ""
        yield Explanation(name, "error", (text.split("\n\n")[0],), {}, "docs/api/errors.md")
    word = name if name in GLOSSARY else name[:1].lower() + name[1:]
    if word in GLOSSARY:
        meaning, page = GLOSSARY[word]
        yield Explanation(word, "word", (meaning,), {}, f"{WORDS_PAGE} docs/explanations/{page}.md")


def _effect(effect: Effect) -> Explanation:
    details = {"Acts on": effect.where, "Quantities": tuple(map(_quantity, effect.quantities)),
               "Confused with": tuple(f"{name}, at another place" if name == effect.name else name
                                      for name in effect.confused_with),
               "Told apart by": (effect.separated_by,) if effect.separated_by else ()}
    return Explanation(effect.name, "effect", (effect.meaning,),
                       {heading: texts for heading, texts in details.items() if texts},
                       "docs/explanations/effects.md")


def _quantity(quantity: Quantity) -> str:
    limits = (f"known, {quantity.lower:g}" if quantity.lower == quantity.upper else
              f"{quantity.lower:g} to {quantity.upper:g}")
    return f"{quantity.name} [{quantity.unit}], {limits}"


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
