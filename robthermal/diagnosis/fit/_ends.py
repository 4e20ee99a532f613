"""A table of where descents ended, beside the structure that they are of."""

from __future__ import annotations

from typing import Any


class Ends:
    """Ends of descents by what they depend on; a copy, and another process, begin with none."""

    def __init__(self) -> None:
        self.of: dict[tuple[Any, ...], Any] = {}

    def __reduce__(self) -> tuple[type[Ends], tuple[()]]:
        return Ends, ()
