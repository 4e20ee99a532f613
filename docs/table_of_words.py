"""Write docs/explanations/words.md, the words of the reports, from robthermal.jobs.explanations.

    python docs/table_of_words.py
"""

from __future__ import annotations

from pathlib import Path

from robthermal.jobs.explanations import GLOSSARY

PAGE = Path(__file__).resolve().parent / "explanations" / "words.md"


def text() -> str:
    """The page."""
    rows = [f"| {word} | {meaning} | []({page}.md) |" for word, (meaning, page)
            in sorted(GLOSSARY.items(), key=lambda item: item[0].lower())]
    head = "What the words in reports, tables and answers say. `robthermal explain WORD` prints a row of this table."
    return "\n".join(["# Words of the reports", "", head, "", "| word | says | page |", "|---|---|---|", *rows, ""])


if __name__ == "__main__":
    PAGE.write_text(text(), encoding="utf-8")
