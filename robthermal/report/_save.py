"""Text to files: characters that neither HTML nor XML may hold become visible marks."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from .._write import write

_UNPRINTABLE = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\ud800-\udfff\ufffe\uffff]")


def printable(text: str) -> str:
    """Text with the replacement character for every control character and half surrogate pair."""
    return _UNPRINTABLE.sub("\ufffd", text)


def save_text(text: str, path: str | Path) -> Path:
    """Write UTF-8, whole or not at all; one message if the place cannot be written."""
    write(path, text.encode("utf-8"))
    return Path(path)


def save_json(content: Any, path: str | Path) -> Path:
    """Write JSON in UTF-8; half surrogate pairs, which no other program could read, become visible marks."""
    return save_text(printable(json.dumps(content, indent=1, allow_nan=False, ensure_ascii=False)) + "\n", path)
