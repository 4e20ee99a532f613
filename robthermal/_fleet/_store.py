"""Results of a fleet in a file: one line of JSON per case, appended whole, keyed by a hash of the case."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..errors import InputError

FORMAT = "robthermal-fleet/1"


@dataclass(frozen=True)
class Answer:
    """What became of a case.

    Parameters
    ----------
    result : Any
        What the function returned.
    error : mapping
        Parts of the message, empty if there was none.
    again : bool
        Whether a restarted run tries again: the error may be the machine's.
    """

    result: Any
    error: Mapping[str, str] = field(default_factory=dict)
    again: bool = False


def key_of(case: Any) -> str:
    """Hash of a case.

    Parameters
    ----------
    case : Any
        One case, of plain values.
    """
    return hashlib.sha256(_text(case, "a case", "argument cases", sort_keys=True).encode()).hexdigest()[:32]


class Store:
    """File of answers; any number of runs may append to it, one after the other or at once.

    Parameters
    ----------
    path : str or path
        The file; made with the first answer.
    title : str
        Function and setting; a file with another one is refused.
    """

    def __init__(self, path: str | Path, title: str):
        self.path, self.title = Path(path), title

    def read(self) -> dict[Any, Answer]:
        """Answers so far. A last line that was cut short by a crash is dropped."""
        try:
            lines = self.path.read_bytes().split(b"\n")
        except FileNotFoundError:
            return {}
        except OSError as error:
            raise InputError(f"cannot be read ({error.strerror})", where=str(self.path)) from None
        entries = [self._entry(line, number) for number, line in enumerate(lines[:-1], start=1) if line.strip()]
        if lines[-1]:
            self._end_torn_line(whole=len(lines) == 1)
        if entries and entries[0].get("title") != self.title:
            raise InputError("holds the results of another function or setting", where=str(self.path),
                             expected=self.title, remedy="Choose another store.")
        # a later line wins: an error that was tried again
        return {entry["key"]: Answer(entry.get("result"), entry.get("error", {}))
                for entry in entries[1:] if "key" in entry and not entry.get("again")}

    def add(self, key: str, answer: Answer) -> Answer:
        """Append an answer; returns it as it will be read back.

        Parameters
        ----------
        key : str
            Of the case.
        answer : Answer
            What became of it.
        """
        entry = {"key": key, "result": answer.result, **({"error": dict(answer.error)} if answer.error else {}),
                 **({"again": True} if answer.again else {})}
        line = _text(entry, "a result", "argument function")
        self._append(line)
        return Answer(json.loads(line)["result"], answer.error)

    def _append(self, line: str) -> None:
        """In one write: a line is there whole or not at all, also beside another run."""
        try:
            handle = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
            try:
                head = "" if os.fstat(handle).st_size else json.dumps({"format": FORMAT, "title": self.title}) + "\n"
                os.write(handle, f"{head}{line}\n".encode())
                os.fsync(handle)
            finally:
                os.close(handle)
        except OSError as error:
            raise InputError(f"cannot be written ({error.strerror})", where=str(self.path)) from None

    def _end_torn_line(self, whole: bool) -> None:
        """A crash cut the last line short: the next answer starts on a line of its own."""
        with self.path.open("ab") as file:
            if whole:  # not even the first line is there
                file.truncate(0)
            else:
                file.write(b"\n")

    def _entry(self, line: bytes, number: int) -> dict[str, Any]:
        try:
            entry = json.loads(line)
        except ValueError:
            entry = None if number == 1 else {}  # cut short by a crash, and ended by the run after it
        if not isinstance(entry, dict) or (number == 1 and entry.get("format") != FORMAT):
            raise InputError(f"line {number} is not of a store", where=str(self.path), expected=f"a file of {FORMAT}",
                             remedy="Choose another store.")
        return entry


def _text(value: Any, what: str, where: str, sort_keys: bool = False) -> str:
    """JSON on one line, NaN and infinity as Python reads them; with sorted keys the same for equal values."""
    try:
        return json.dumps(value, sort_keys=sort_keys)
    except (TypeError, ValueError) as error:
        raise InputError(f"{what} cannot be stored: {error}", where=where, expected="numbers, texts, lists and "
                         "dictionaries with text keys", remedy="Convert arrays with .tolist(), or leave out the store."
                         ) from None
