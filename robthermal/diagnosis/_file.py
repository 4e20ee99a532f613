"""diagnosis.json: numbers that JSON knows."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from .._write import write


def write_json(path: str | Path, content: dict[str, Any]) -> None:
    """Write a dictionary; infinities and nan become null."""
    write(path, (json.dumps(_finite(content), indent=1, ensure_ascii=False) + "\n").encode("utf-8"))


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    return value
