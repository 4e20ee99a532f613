"""What one name means, as a user reads it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Explanation:
    """What one name means.

    Parameters
    ----------
    name : str
        As it stands in files, tables and messages.
    what : str
        "effect", "certificate", "outcome", "reason", "error" or "word".
    meaning : tuple of str
        Paragraphs that say what it means.
    details : dict of str to tuple of str
        By heading: assumptions, confusable partners, what separates them.
    page : str
        Page of the documentation; of a word its list, and the page that derives it.
    """

    name: str
    what: str
    meaning: tuple[str, ...]
    details: dict[str, tuple[str, ...]]
    page: str

    def __str__(self) -> str:
        lines = [f"{self.name}: {self.what}", *self.meaning]
        for heading, texts in self.details.items():
            lines += [f"{heading}:", *(f"  - {text}" for text in texts)]
        return "\n".join([*lines, f"Documentation: {self.page}"])
