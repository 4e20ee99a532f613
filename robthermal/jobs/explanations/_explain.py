"""What a name means: an effect, a kind of certificate, the code of an outcome, an error, a word of a report."""

from __future__ import annotations

import inspect
import json
import sys
from collections.abc import Iterator
from difflib import get_close_matches
from functools import cache
from pathlib import Path

from ... import errors
from ..._first_use import OnFirstUse
from ...errors import InputError
from ._explanation import Explanation
from ._glossary import GLOSSARY, WORDS_PAGE

KNOWN = Path(__file__).with_name("known.json")  # what `collected` says; docs/table_of_outcomes.py writes it
_effect_words = OnFirstUse(f"{__package__}._effect_words")  # imports the network and scipy
_ERRORS = {cls.__name__: cls for cls in (errors.InputError, errors.Diverged)}
_CHANGE = Explanation("parameter_change", "effect",
                      ("A parameter of [fit] has another value on the new records than on the reference records, by "
                       "more than healthy records scatter.",),
                      {"Acts on": ("parameter of [fit]; tied parameters together",),
                       "Quantities": ("relative [-], the change over the value on a healthy day",
                                      "exponent [-], where a conductance to an ambient has become that of still air: "
                                      "it grows with this power of the difference, and the change is that at 10 K")},
                      "docs/explanations/diagnosis_change.md")
_DRIFT = Explanation("ambient_drift", "effect",
                     ("An ambient that a record does not hold is not the constant of the system: it swings or drifts. "
                      "Tried wherever a periodic heat is, and only where the ambient is not recorded.",),
                     {"Acts on": ("ambient",),
                      "Quantities": ("difference [K], half of the swing", "period [s]", "phase [rad]"),
                      "Confused with": ("periodic_load",), "Told apart by": ("a record of the ambient",)},
                     "docs/explanations/diagnosis_data.md")
_OTHERS = {one.name: one for one in (_CHANGE, _DRIFT)}  # effects of a diagnosis that are not in the catalog
_KEPT = ("effect", "certificate", "outcome", "reason")  # kinds of names in the file


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
    known = _known()
    return {"effect": (*known["effect"], *_OTHERS), **{what: tuple(known[what]) for what in _KEPT[1:]},
            "error": tuple(_ERRORS), "word": tuple(GLOSSARY)}


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
    known = _known()
    if name in known["effect"]:
        yield known["effect"][name]
    if name in _OTHERS:
        yield _OTHERS[name]
    for what in _KEPT[1:]:
        if name in known[what]:
            yield known[what][name]
    if name in _ERRORS:
        text = inspect.getdoc(_ERRORS[name]) or ""
        yield Explanation(name, "error", (text.split("\n\n")[0],), {}, "docs/api/errors.md")
    word = name if name in GLOSSARY else name[:1].lower() + name[1:]
    if word in GLOSSARY:
        meaning, page = GLOSSARY[word]
        yield Explanation(word, "word", (meaning,), {}, f"{WORDS_PAGE} docs/explanations/{page}.md")


def _known() -> dict[str, dict[str, Explanation]]:
    """By what they are and by name; effects as they are registered now, which they can only be in a loaded catalog."""
    if "robthermal.thermal.effects" not in sys.modules:
        return _read()
    return {**_read(), "effect": _effect_words.explained_effects()}


@cache
def _read() -> dict[str, dict[str, Explanation]]:
    found: dict[str, dict[str, Explanation]] = {what: {} for what in _KEPT}
    for one in json.loads(KNOWN.read_text(encoding="utf-8")):
        details = {heading: tuple(texts) for heading, texts in one["details"].items()}
        found[one["what"]][one["name"]] = Explanation(one["name"], one["what"], tuple(one["meaning"]), details,
                                                      one["page"])
    return found
