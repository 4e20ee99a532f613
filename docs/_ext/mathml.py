"""Formulas as MathML, made when the site is built: a page needs no script and no other host to show them.

docutils converts; what it does not know of LaTeX is rewritten before (`_rewritten`), and where it puts a subscript
under an accented letter instead of beside it, that is moved after (`_mended`).
"""

from __future__ import annotations

import re
from typing import Any
from xml.etree import ElementTree

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import accents, over, tex2mathml
from sphinx.util import logging

_logger = logging.getLogger(__name__)
_NAMESPACE = "http://www.w3.org/1998/Math/MathML"
_ACCENTS = {*accents.values(), *(sign for sign, _ in over.values())} - {over["overbrace"][0]}
_WORDS = re.compile(r"(\\(?:text|mathrm|operatorname|mbox|tag)\s*\{[^{}]*\})")
_SIMPLE = [
    (re.compile(r"\\dots(?![a-zA-Z])"), r"\\ldots "),
    (re.compile(r"\\(?:text|display)style(?![a-zA-Z])"), ""),  # docutils takes it at the start of a group only
    (re.compile(r"\\iff(?![a-zA-Z])"), r"\\;\\Longleftrightarrow\\;"),
    (re.compile(r"\\rm\s+(\w+)"), r"\\mathrm{\1}"),
    (re.compile(r"\\([bB]igg?)(?=[(\[]|\\\{|\\langle)"), r"\\\1l"),  # \big( has a left and a right in docutils
    (re.compile(r"\\([bB]igg?)(?=[)\]]|\\\}|\\rangle)"), r"\\\1r"),
    (re.compile(r"\\[bB]igg?(?=\||\\\||/)"), ""),  # a bar may be either; it keeps its height
    (re.compile(r"([_^])(\d)(?=\d)"), r"\1{\2}"),  # x^10 is x^{1}0
    (re.compile(r"('+)\^(?:\{((?:[^{}]|\{[^{}]*\})*)\}|(\\[a-zA-Z]+|.))"),
     lambda found: "^{" + r"\prime" * len(found[1]) + " " + (found[2] or found[3]) + "}"),
    (re.compile(r"'+"), lambda found: "^{" + r"\prime" * len(found[0]) + "}"),
    (re.compile(r"^\s*(?=[_^])"), "{}"),
]
_TAG = re.compile(r"\\tag\s*\{([^{}]*)\}")
_FRACTION = re.compile(r"\\[dt]?frac(?![a-zA-Z])")


def mathml(code: str, *, block: bool = False) -> str:
    """A formula in LaTeX as MathML.

    Parameters
    ----------
    code : str
        The formula without dollars.
    block : bool
        Whether it stands on a line of its own.

    Returns
    -------
    str
        One `<math>` element.

    Raises
    ------
    docutils.utils.math.MathError
        If the formula uses a command that is not known here, or its braces do not match.
    """
    try:
        markup = tex2mathml(_rewritten(code.strip()), as_block=block)
        return _mended(str(markup).replace("&ApplyFunction;", "\u2061"))
    except (IndexError, AttributeError, TypeError, ElementTree.ParseError) as error:
        raise MathError(f"the converter stopped ({error})") from error


def _rewritten(code: str) -> str:
    """The same formula in the LaTeX that docutils knows; words in it are left alone."""
    pieces = _WORDS.split(_arguments_in_braces(code))
    for place in range(0, len(pieces), 2):
        for pattern, replacement in _SIMPLE:
            if place == 0 or not pattern.pattern.startswith("^"):
                pieces[place] = pattern.sub(replacement, pieces[place])
    return _TAG.sub(r"\\qquad\\text{(\1)}", "".join(pieces))


def _arguments_in_braces(code: str) -> str:
    r"""Fractions with braces around what they divide: \frac12x is \frac{1}{2}x, which docutils reads as 12 over x."""
    found = _FRACTION.search(code)
    if not found:
        return code
    above, rest = _argument(code[found.end():])
    below, rest = _argument(rest)
    inner = [_arguments_in_braces(part) for part in (above, below, rest)]
    return f"{code[:found.end()]}{{{inner[0]}}}{{{inner[1]}}}{inner[2]}"


def _argument(code: str) -> tuple[str, str]:
    """The first argument of a command, and what follows it: a group, a command, or one character."""
    code = code.lstrip()
    if not code.startswith("{"):
        found = re.match(r"\\[a-zA-Z]+|\\.|.", code, re.S)
        if not found:
            raise MathError("a fraction lacks an argument")
        return found[0], code[found.end():]
    depth = 0
    for place, sign in enumerate(code):
        depth += (sign == "{") - (sign == "}")
        if depth == 0:
            return code[1:place], code[place + 1:]
    raise MathError("a brace is not closed")


def _mended(markup: str) -> str:
    """Subscripts beside accented letters, and no room inside the bars of an absolute value."""
    tree = ElementTree.fromstring(markup)
    for node in tree.iter():
        if node.tag.endswith("munderover") and (node[2].text or "") in _ACCENTS:
            base, below, accent = node
            node.tag = f"{{{_NAMESPACE}}}msub"
            for child in list(node):
                node.remove(child)
            accented = ElementTree.SubElement(node, f"{{{_NAMESPACE}}}mover", accent="true")
            accented.extend([base, accent])
            node.append(below)
        elif node.tag.endswith("}mo") and node.text in ("|", "‖"):
            node.attrib.setdefault("lspace", "0")
            node.attrib.setdefault("rspace", "0")
    ElementTree.register_namespace("", _NAMESPACE)
    return re.sub(r"\s*\n\s*", "", ElementTree.tostring(tree, encoding="unicode"))


def _inline(self: Any, node: nodes.Element) -> None:
    self.body.append(_markup(node, block=False))
    raise nodes.SkipNode


def _display(self: Any, node: nodes.Element) -> None:
    reached = 'tabindex="0" role="group" aria-label="Formula"'  # by keyboard: a wide one is moved sideways
    self.body.append(f'<div class="formula" {reached}>{_markup(node, block=True)}</div>\n')
    raise nodes.SkipNode


def _markup(node: nodes.Element, *, block: bool) -> str:
    code = node.astext().strip()
    try:
        return mathml(code, block=block)
    except MathError as error:
        _logger.warning("formula cannot be shown: %s in %s", error, code[:120], location=node)
        return f"<code>{code.replace('&', '&amp;').replace('<', '&lt;')}</code>"


def setup(app: Any) -> dict[str, bool]:
    """Called by Sphinx."""
    app.add_html_math_renderer("mathml", (_inline, None), (_display, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
