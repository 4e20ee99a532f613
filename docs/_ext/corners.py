"""What Sphinx, pandas and the theme leave of accessibility, in every page that is written.

Empty cells in the head of a table are no headings: `th` without a text becomes `td` (axe, empty-table-header).
A formula that is a heading alone is named by its letters. What opens hidden code is named by its own text (WCAG 2.5.3).
"""

from __future__ import annotations

import re
from typing import Any

_EMPTY = re.compile(r"<th(?: [^>]*)?>(?:\s|&nbsp;|\u00a0)*(?:<p>\s*</p>)?\s*</th>")
_FORMULA = re.compile(r"(<th(?: [^>]*)?><p>)<math(?P<attributes>[^>]*)>(?P<formula>(?:(?!</?math).)*)</math></p></th>",
                      re.DOTALL)
_TOGGLE = '<summary aria-label="Toggle hidden content">'


def _named(found: re.Match[str]) -> str:
    said = re.sub(r"<[^>]*>|\s+", "", found["formula"])
    formula = f'<math{found["attributes"]}>{found["formula"]}</math>'
    return f'{found[1]}<span role="img" aria-label="{said}">{formula}</span></p></th>'


def _corners(app: Any, page: str, template: str, context: dict[str, Any], doctree: Any) -> None:
    if "body" in context:
        body = _FORMULA.sub(_named, _EMPTY.sub("<td></td>", context["body"]))
        context["body"] = body.replace(_TOGGLE, "<summary>")


def setup(app: Any) -> dict[str, bool]:
    """Connect the changes to every page that is written.

    Parameters
    ----------
    app : sphinx.application.Sphinx
        The site that is built.
    """
    app.connect("html-page-context", _corners)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
