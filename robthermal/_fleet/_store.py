"""Results of a fleet in a file: one line of JSON per case, appended whole, keyed by a hash of the case."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import InputError

FORMAT = "robthermal-fleet/1"
Key = int | str  # of a case: its number, or its hash where there is a store
_START = json.dumps({"format": FORMAT})[:-1].encode()  # of the first line


@dataclass(frozen=True, slots=True)
class Answer:
    """What became of a case.

    Parameters
    ----------
    result : Any
        What the function returned.
    error : mapping, optional
        Parts of the message, if there was one.
    again : bool
        Whether a restarted run tries again: the error may be the machine's.
    """

    result: Any
    error: Mapping[str, str] | None = None
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
        answers: dict[Any, Answer] = {}
        number, line = 0, b""
        try:
            with self.path.open("rb") as lines:
                for number, line in enumerate(lines, start=1):
                    entry = self._entry(line, number)
                    if "key" in entry and not entry.get("again"):  # a later line wins: an error that was tried again
                        answers[entry["key"]] = Answer(entry.get("result"), entry.get("error"))
        except FileNotFoundError:
            return {}
        except OSError as error:
            raise InputError(f"cannot be read ({error.strerror})", where=str(self.path)) from None
        if line and not line.endswith(b"\n"):
            self._end_torn_line(whole=number == 1)
        return answers

    def add(self, answers: Sequence[tuple[Key, Answer]]) -> list[tuple[Key, Answer]]:
        """Append answers, a line each; returns them as they will be read back.

        Parameters
        ----------
        answers : sequence of tuple
            Keys of cases, and what became of them.
        """
        lines = [_text({"key": key, "result": answer.result, **({"error": dict(answer.error)} if answer.error else {}),
                        **({"again": True} if answer.again else {})}, "a result", "argument function")
                 for key, answer in answers]
        self._append("".join(f"{line}\n" for line in lines))
        return [(key, Answer(json.loads(line)["result"], answer.error))
                for (key, answer), line in zip(answers, lines, strict=True)]

    def _append(self, lines: str) -> None:
        """In one write, flushed to the disk: whole lines, also beside another run."""
        try:
            handle = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
            try:
                head = "" if os.fstat(handle).st_size else json.dumps({"format": FORMAT, "title": self.title}) + "\n"
                content = f"{head}{lines}".encode()
                while content:  # a disk that is nearly full takes a part, and says so when asked again
                    content = content[os.write(handle, content):]
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
        """What a line says; nothing of one that a crash cut short, whether or not the run after it ended it."""
        if number == 1 and not line.endswith(b"\n") and (line.startswith(_START) or _START.startswith(line)):
            return {}
        try:
            entry = json.loads(line) if line.endswith(b"\n") else {}
        except ValueError:
            entry = {}
        if number == 1 and (not isinstance(entry, dict) or entry.get("format") != FORMAT):
            raise InputError("line 1 is not of a store", where=str(self.path), expected=f"a file of {FORMAT}",
                             remedy="Choose another store.")
        if number == 1 and entry.get("title") != self.title:
            raise InputError("holds the results of another function or setting", where=str(self.path),
                             expected=self.title, remedy="Choose another store.")
        return entry if isinstance(entry, dict) else {}


def _text(value: Any, what: str, where: str, sort_keys: bool = False) -> str:
    """JSON on one line, NaN and infinity as Python reads them; with sorted keys the same for equal values."""
    try:
        return json.dumps(value, sort_keys=sort_keys)
    except (TypeError, ValueError) as error:
        raise InputError(f"{what} cannot be stored: {error}", where=where, expected="numbers, texts, lists and "
                         "dictionaries with text keys", remedy="Convert arrays with .tolist(), or leave out the store."
                         ) from None
