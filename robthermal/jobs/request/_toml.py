"""TOML files read into checked tables: unknown keys, wrong types and files that cannot be read are refused."""

from __future__ import annotations

import tomllib
from collections.abc import Collection, Iterator
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ...errors import InputError

_MAX_BYTES = 10_000_000
Number = Annotated[float, Field(allow_inf_nan=False, strict=True)]
T = TypeVar("T", bound=BaseModel)
_NEAR = 0.7  # likeness of a key that is offered for an unknown one
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
        raise refusal(error, path, remedy, set(_keys(schema))) from None


def refusal(error: ValidationError, path: Path, remedy: str, known: Collection[str] = ()) -> InputError:
    """One clear message for a table that does not fit; unknown keys come first.

    Parameters
    ----------
    error : ValidationError
        Validation error that pydantic raised.
    path : Path
        File that the table comes from.
    remedy : str
        Where the user finds the keys.
    known : collection of str, optional
        Keys of the file's tables, for the nearest one to an unknown key.
    """
    faults: list[Any] = error.errors(include_url=False)
    fault = next((f for f in faults if f["type"] == "extra_forbidden"), faults[0])
    place = ".".join(str(word) for word in fault["loc"] if word not in _OF_UNIONS)
    what = {"missing": f"key {place!r} is missing", "extra_forbidden": f"unknown key {place!r}"}.get(
        fault["type"], f"{place} = {str(fault['input'])[:60]!r}: {fault['msg']}")
    last = str(fault["loc"][-1])
    if fault["type"] == "extra_forbidden" and last in known:
        remedy = f"{last!r} is a key of another table: is this the right file, and the right table? {remedy}"
    elif fault["type"] == "extra_forbidden" and (near := get_close_matches(last, known, n=1, cutoff=_NEAR)):
        remedy = f"Did you mean {near[0]!r}? {remedy}"
    return InputError(what, where=str(path), remedy=remedy)


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
