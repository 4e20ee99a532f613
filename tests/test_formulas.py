"""Formulas of the documentation are shown as MathML that says what the LaTeX says, without a script from elsewhere."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path
from types import ModuleType
from xml.etree import ElementTree

import pytest
from docutils.utils.math import MathError
from markdown_it import MarkdownIt
from mdit_py_plugins.dollarmath import dollarmath_plugin

DOCS = Path(__file__).resolve().parents[1] / "docs"
EXTENSION = DOCS / "_ext" / "mathml.py"


@pytest.fixture(scope="module")
def extension() -> ModuleType:
    spec = importlib.util.spec_from_file_location("mathml", EXTENSION)
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def drawn(node: ElementTree.Element) -> str:
    """What a browser draws, as MathML Core defines the elements, in one line."""
    name = node.tag.rpartition("}")[2]
    parts = [drawn(child) for child in node]
    shapes = {"mfrac": "({0})/({1})", "msub": "{0}_[{1}]", "msup": "{0}^[{1}]", "msubsup": "{0}_[{1}]^[{2}]",
              "mover": "{0}above[{1}]", "munder": "{0}under[{1}]", "munderover": "{0}under[{1}]above[{2}]",
              "msqrt": "sqrt({0})"}
    if name in shapes:
        return shapes[name].format(*parts)
    return (node.text or "").strip().replace("\u2061", "").replace("\u2212", "-") + "".join(parts)


@pytest.mark.parametrize(("code", "shown"), [
    (r"\tfrac12S'x", "(1)/(2)S^[′]x"),  # docutils reads 12 over S
    (r"\frac{a}25", "(a)/(2)5"),
    (r"\frac\alpha{b + 1}", "(α)/(b+1)"),
    (r"\frac{\frac12}{x^10}", "((1)/(2))/(x^[1]0)"),
    (r"\hat x_0 + \widehat{GS}_{11}", "xabove[ˆ]_[0]+GSabove[^]_[11]"),  # docutils puts the index under the letter
    (r"\bar x_i^2", "xabove[ˉ]_[i]^[2]"),
    (r"H'^{\mathsf T}_k", "H_[k]^[′𝖳]"),
    (r"\rho''/2", "ρ^[′′]/2"),
    (r"1, \dots, n", "1,…,n"),
    (r"\max\big(1, \Big[a\Big]\big)", "max(1,[a])"),
    (r"f\Big|_v", "f|_[v]"),
    (r"G_{\rm BLA}", "G_[BLA]"),
    (r"e = 0 \tag{6.21, corrected}", "e=0(6.21, corrected)"),
    (r"^2", "^[2]"),
    (r"a\textstyle\sum_j", "a∑under[j]"),
    (r"\text{don't}\ x'", "don'tx^[′]"),
    (r"\operatorname{tr} P \iff a < b", "trP⟺a<b"),
])
def test_a_formula_is_drawn_as_it_is_written(extension: ModuleType, code: str, shown: str) -> None:
    for block in (False, True):
        assert drawn(ElementTree.fromstring(extension.mathml(code, block=block))) == shown


def test_absolute_values_have_no_room_inside_their_bars(extension: ModuleType) -> None:
    tree = ElementTree.fromstring(extension.mathml(r"|d| < \|e\|"))
    bars = [node for node in tree.iter() if node.text in ("|", "‖")]
    assert len(bars) == 4 and all(bar.get("lspace") == bar.get("rspace") == "0" for bar in bars)


@pytest.mark.parametrize("code", [r"\nosuchcommand", r"\frac{a", r"\frac", r"{^2}", r"\begin{array}a\end{array}"])
def test_what_cannot_be_shown_is_refused(extension: ModuleType, code: str) -> None:
    with pytest.raises(MathError):
        extension.mathml(code)


def pages() -> dict[str, str]:
    """The Markdown of the documentation, cells of notebooks included."""
    found = {str(path.relative_to(DOCS)): path.read_text(encoding="utf-8") for path in DOCS.rglob("*.md")}
    for path in (DOCS / "tutorials").glob("*.ipynb"):
        cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
        found[path.name] = "\n\n".join("".join(one["source"]) for one in cells if one["cell_type"] == "markdown")
    return found


def test_every_formula_of_the_pages_can_be_shown(extension: ModuleType) -> None:
    """In seconds; the build of the site sees those of the docstrings as well, and warns with file and line."""
    reader = MarkdownIt().use(dollarmath_plugin, double_inline=True)
    shown, refused = 0, []
    for name, text in pages().items():
        tokens = reader.parse(text)
        for token in [*tokens, *(child for block in tokens for child in block.children or ())]:
            if token.type.startswith("math"):
                try:
                    extension.mathml(token.content, block=token.type == "math_block")
                    shown += 1
                except MathError as error:
                    refused.append(f"{name}: {error}: {token.content}")
    assert refused == [] and shown > 2000
