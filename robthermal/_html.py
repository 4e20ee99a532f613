"""Short tables for notebooks: a result in a few rows, everything escaped."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape

ROWS = 30  # of a short table
_LONGEST = 200  # characters of a cell


def short_table(title: str, rows: Iterable[tuple[str, str]], note: str = "") -> str:
    """HTML of a table with two columns, as `_repr_html_` returns it.

    Parameters
    ----------
    title : str
        Heading of the table.
    rows : iterable of (str, str)
        What it is, and its value with unit; beyond 30 rows their number is said.
    note : str
        Sentence below the table, for example what an outcome says.

    Examples
    --------
    >>> short_table("<bar>", [("lumps", "a & b")])
    '<table><caption>&lt;bar&gt;</caption><tr><th>lumps</th><td>a &amp; b</td></tr></table>'
    """
    listed = list(rows)
    shown = listed if len(listed) <= ROWS else [*listed[:ROWS], ("…", f"{len(listed) - ROWS} more")]
    body = "".join(f"<tr><th>{_cell(name)}</th><td>{_cell(value)}</td></tr>" for name, value in shown)
    return f"<table><caption>{_cell(title)}</caption>{body}</table>" + (f"<p>{escape(note)}</p>" if note else "")


def _cell(text: str) -> str:
    return escape(text if len(text) <= _LONGEST else text[:_LONGEST - 2] + " …")
