"""Turn a schema refusal into one clear message: table, key, value, what was expected, what to do."""

from __future__ import annotations

import difflib
from typing import Any

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from ..errors import InputError
from ._parameters import LISTED
from ._parts import (
    Ambient,
    Condensation,
    Drive,
    Feedthrough,
    FitRange,
    Flow,
    Follow,
    Hysteresis,
    Input,
    Lead,
    Linear,
    Link,
    Lump,
    Module,
    Natural,
    Part,
    Periodic,
    Sensor,
    Step,
    TemperatureLaw,
)

_PARTS: dict[str, type[Part]] = {"ambients": Ambient, "lumps": Lump, "links": Link, "inputs": Input,
                                 "modules": Module, "leads": Lead, "flows": Flow, "sensors": Sensor, "fit": FitRange}
_INNER: dict[str, type[Part]] = {"natural": Natural, "seebeck": Linear, "resistance": Linear, "conductance": Linear,
                                 "drive": Drive, "hysteresis": Hysteresis, "periodic": Periodic, "step": Step,
                                 "condensation": Condensation, "feedthrough": Feedthrough, "follow": Follow,
                                 "temperature_law": TemperatureLaw}
_TOP = ("system", "ambients", "lumps", "links", "inputs", "modules", "leads", "flows", "sensors", "fit")

_LISTED = 5  # further places in a message
_EXPECTED = {
    "missing": "this key to be present", "greater_than": "a number above {gt}", "greater_than_equal": "at least {ge}",
    "less_than_equal": "at most {le}",
    "finite_number": "a finite number", "float_type": "a number", "string_type": "text", "dict_type": "a table",
    "model_type": "a table", "tuple_type": "a list", "too_short": "two values", "too_long": "two values",
    "string_too_short": "a name", "literal_error": "{expected}", "model_attributes_type": "a table",
}


def refusal(error: ValidationError) -> InputError:
    """First fault of a pydantic error as an `InputError`, whose remedy says where the others are."""
    faults = error.errors(include_url=False)
    # a misspelt key explains a missing one
    fault = next((f for f in faults if f["type"] == "extra_forbidden"), faults[0])
    first, own = _of(fault), _place(fault["loc"])
    others = [place for place in dict.fromkeys(_place(one["loc"]) for one in faults) if place != own]
    if not others:
        return first
    listed = "; ".join(f"{place} {key}".strip() for place, key in others[:_LISTED])
    more = f"; and {len(others) - _LISTED} more" if len(others) > _LISTED else ""
    return InputError(first.what, where=first.where, expected=first.expected,
                      remedy=f"{first.remedy} Not right either: {listed}{more}.")


def _of(fault: ErrorDetails) -> InputError:
    """One fault as a message of its own."""
    place, key = _place(fault["loc"])
    kind = fault["type"]
    if kind == "extra_forbidden":
        return InputError(f"unknown key {key!r}", where=place, expected="one of " + ", ".join(_known(fault["loc"])),
                          remedy=_suggestion(key, _known(fault["loc"])))
    if kind == "missing":
        return InputError(f"key {key!r} is missing", where=place, remedy=f"Add {key} = … to {place}.")
    shown = _shown(fault["input"])
    if kind == "value_error":
        text = str(fault["ctx"]["error"])
        return InputError(f"{key} = {shown}: {text}" if key else text, where=place,
                          remedy="Correct this entry.")
    expected = _EXPECTED.get(kind, fault["msg"]).format(**fault.get("ctx", {}))
    if expected == "a table" and len(fault["loc"]) > 1:
        expected = "a table with the keys " + ", ".join(_known(fault["loc"]))
    return InputError(f"{key} = {shown}" if key else f"it is {shown}", where=place, expected=expected,
                      remedy=_remedy(kind, key, fault))


def _place(loc: tuple[int | str, ...]) -> tuple[str, str]:
    """('[lumps.x1]', 'capacity') from ('lumps', 'x1', 'capacity')."""
    words = [str(word) for word in loc if word != "[key]"]
    if len(words) <= 1:
        return "[system]", words[0] if words else ""
    if words[0] in LISTED:
        return f"[[{words[0]}]] number {int(words[1]) + 1}", ".".join(words[2:])
    if words[0] == "fit":
        return f'[fit] "{words[1]}"', ".".join(words[2:])
    return f"[{words[0]}.{words[1]}]", ".".join(words[2:])


def _known(loc: tuple[int | str, ...]) -> list[str]:
    if len(loc) <= 1:
        return list(_TOP)
    inner = _INNER.get(str(loc[2])) if len(loc) > 3 else None
    part = inner or _PARTS[str(loc[0])]
    return list(part.model_fields)


def _suggestion(key: str, known: list[str]) -> str:
    close = difflib.get_close_matches(key.split(".")[-1], known, n=1)
    return f"Did you mean {close[0]!r}?" if close else "Remove it, or correct its spelling."


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _remedy(kind: str, key: str, fault: ErrorDetails) -> str:
    if kind == "greater_than_equal" and fault["ctx"].get("ge") == 150.0:
        return ("This is below 150 K: it looks like degrees Celsius declared as kelvin; check temperature_unit. "
                "Machines that cold are not modelled.")
    if kind in ("greater_than", "greater_than_equal"):
        return "Check the sign and the unit."
    return "Correct this value."
