"""Empty cells in the head of a table are no headings: `th` without a text becomes `td` (axe, empty-table-header)."""

from __future__ import annotations

import re
from typing import Any

_EMPTY = re.compile(r"<th(?: [^>]*)?>\s*(?:<p>\s*</p>)?\s*</th>")


def _corners(app: Any, page: str, template: str, context: dict[str, Any], doctree: Any) -> None:
    if "body" in context:
        context["body"] = _EMPTY.sub("<td></td>", context["body"])


def setup(app: Any) -> dict[str, bool]:
    """Connect the change to every page that is written.

    Parameters
    ----------
    app : sphinx.application.Sphinx
        The site that is built.
    """
    app.connect("html-page-context", _corners)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
