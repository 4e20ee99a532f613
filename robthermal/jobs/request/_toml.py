"""TOML files read into checked tables: unknown keys, wrong types and files that cannot be read are refused."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ...errors import InputError

_MAX_BYTES = 10_000_000
Number = Annotated[float, Field(allow_inf_nan=False, strict=True)]
T = TypeVar("T", bound=BaseModel)
_NEAR = 0.7  # likeness of a key that is offered for an unknown one
_LISTED = 5  # further places in a message
_OF_UNIONS = ("float", "constrained-float", "str", "list[str]")  # where pydantic says which of several types it tried


class Table(BaseModel):
    """A table whose keys are all known."""

    model_config = ConfigDict(frozen=True, extra="forbid")


def read_text(path: Path, kind: str, largest: int = _MAX_BYTES) -> str:
    """Text of a file; one message where it cannot be read, or is too large.

    Parameters
    ----------
    path : Path
        File, UTF-8 with or without a byte-order mark.
    kind : str
        What it should be, for the message.
    largest : int
        Largest accepted size [bytes].
    """
    try:
        if path.stat().st_size > largest:
            raise InputError(f"is larger than {largest / 1e6:g} MB", where=str(path), remedy="Is this the right file?")
        return path.read_bytes().decode("utf-8-sig")
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", where=str(path), remedy="Check the path.") from None
    except UnicodeDecodeError:
        raise InputError("is not a text file in UTF-8", where=str(path), expected=f"a {kind} file",
                         remedy="Is this the right file?") from None


def read_toml(path: Path, schema: type[T], remedy: str) -> T:
    """A TOML file as a checked table.

    Parameters
    ----------
    path : Path
        TOML file to read.
    schema : type
        What it must look like.
    remedy : str
        Where the user finds the keys.
    """
    try:
        return schema(**tomllib.loads(read_text(path, "TOML")))
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise InputError(f"is not valid TOML: {error}", where=str(path), remedy="Correct the line it names.") from None
    except ValidationError as error:
        raise refusal(error, path, remedy, schema) from None


def refusal(error: ValidationError, path: Path, remedy: str, schema: type[BaseModel] | None = None) -> InputError:
    """One clear message for a table that does not fit; unknown keys come first.

    Parameters
    ----------
    error : ValidationError
        Validation error that pydantic raised.
    path : Path
        File that the table comes from.
    remedy : str
        Where the user finds the keys.
    schema : type, optional
        Of the file, for the nearest key to an unknown one and the keys of its table.
    """
    faults: list[Any] = error.errors(include_url=False)
    fault = next((f for f in faults if f["type"] == "extra_forbidden"), faults[0])
    place = _place(fault)
    what = {"missing": f"key {place!r} is missing", "extra_forbidden": f"unknown key {place!r}"}.get(
        fault["type"], f"{place} = {str(fault['input'])[:60]!r}: {fault['msg']}")
    if fault["type"] == "extra_forbidden" and schema is not None:
        remedy = f"{_hint(fault['loc'], schema)}{remedy}"
    others = [one for one in dict.fromkeys(map(_place, faults)) if one != place]
    more = f"; and {len(others) - _LISTED} more" if len(others) > _LISTED else ""
    also = f" Not right either: {'; '.join(others[:_LISTED])}{more}." if others else ""
    return InputError(what, where=str(path), remedy=remedy + also)


def _place(fault: Any) -> str:
    return ".".join(str(word) for word in fault["loc"] if word not in _OF_UNIONS and "[" not in str(word))


def _hint(place: tuple[int | str, ...], schema: type[BaseModel]) -> str:
    """What an unknown key may have been meant to be: a key of its own table first."""
    *above, last = (str(word) for word in place)
    own = list(_own_keys(schema, above))
    near = get_close_matches(last, own, n=1, cutoff=_NEAR)
    if near:
        return f"Did you mean {near[0]!r}? "
    listed = f"Keys of [{'.'.join(above)}]: {', '.join(own)}. " if above and own else ""
    if last in (known := set(_keys(schema))):
        return f"{last!r} is a key of another table: is this the right file, and the right table? {listed}"
    near = get_close_matches(last, known, n=1, cutoff=_NEAR)
    return listed or (f"Did you mean {near[0]!r}? " if near else "")


def _own_keys(schema: type[BaseModel], above: Sequence[str]) -> Iterator[str]:
    """Keys of the table below these names; a name that the user chose, as in [identify.NAME], is no key."""
    tables: list[type[BaseModel]] = [schema]
    for word in above:
        inner = [table for own in tables for name, field in own.model_fields.items() if word in (name, field.alias)
                 for table in _tables(field.annotation)]
        tables = inner or tables
    for table in tables:
        yield from (field.alias or name for name, field in table.model_fields.items())


def _keys(schema: type[BaseModel]) -> Iterator[str]:
    """Keys of a table and of the tables in it."""
    for name, field in schema.model_fields.items():
        yield field.alias or name
        for table in _tables(field.annotation):
            yield from _keys(table)


def _tables(annotation: Any) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for inner in get_args(annotation):
        yield from _tables(inner)
