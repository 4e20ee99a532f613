"""What a file states of its own values: that readings are means over the step before their stamp."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any, Literal, get_args

Averaged = Literal["before", "after", "readings"]
MEANS = get_args(Averaged)
KEY = "averaged"
_LINE = re.compile(rf'\s*#\s*{KEY}\s*=\s*["\']?({"|".join(MEANS)})["\']?\s*')


def comment(word: str) -> str:
    """Comment line of a text file: the key of [record] that it stands for.

    Parameters
    ----------
    word : str
        One of "before", "after", "readings".
    """
    return f'# {KEY} = "{word}"\n'


def of_comments(lines: Iterable[str]) -> str:
    """Word that the comment lines of a text file state; empty without one.

    Parameters
    ----------
    lines : iterable of str
        First lines of the file.
    """
    return next((found[1] for line in lines if (found := _LINE.fullmatch(line))), "")


def of_value(value: Any) -> str:
    """Word that a file or table of typed columns holds under the key; empty where it is none.

    Parameters
    ----------
    value : object
        What stands under the key, a text or bytes in most files.
    """
    word = value.decode("utf-8", "replace") if isinstance(value, bytes) else value
    return word if isinstance(word, str) and word in MEANS else ""
