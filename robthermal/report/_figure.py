"""Figures as SVG that can stand in a page: no ids shared with a neighbor, no resource outside, colors of the page."""

from __future__ import annotations

import io
import re
from dataclasses import dataclass
from typing import Any
from xml.etree import ElementTree

from ..errors import InputError
from ._powers import plain_powers

_ENLARGED = 1.25  # so much larger than drawn a figure may be shown; its letters are then as large as the text
_PAD = 0.04  # inch, around what is drawn
_FORBIDDEN = {"script", "style", "foreignObject", "iframe", "animate", "set"}


@dataclass(frozen=True)
class Figure:
    """A drawing with the words that stand for it.

    Parameters
    ----------
    svg : str
        Drawing, one ``<svg>`` element without scripts or outside resources.
    alt : str
        What a reader who cannot see it needs to know.
    caption : str
        Text printed below the drawing.

    Raises
    ------
    InputError
        Not an SVG element, scripts, outside resources, or no alternative text.

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.report.Figure('<svg viewBox="0 0 1 1"></svg>', alt="", caption="Nothing.")
    Traceback (most recent call last):
    ...
    robthermal.errors.InputError: figure 'Nothing.': alt is empty. Expected a sentence that says what the figure shows.
    """

    svg: str
    alt: str
    caption: str

    def __post_init__(self) -> None:
        where = f"figure {self.caption!r}"
        if not self.alt.strip():
            raise InputError("alt is empty", where=where, expected="a sentence that says what the figure shows")
        _refuse_unsafe(self.svg, where)

    @classmethod
    def draw(cls, figure: Any, *, alt: str, caption: str) -> Figure:
        """Turn a matplotlib figure into SVG, and close it.

        Parameters
        ----------
        figure : matplotlib.figure.Figure
            Finished drawing, which is closed.
        alt : str
            What a reader who cannot see it needs to know.
        caption : str
            Text printed below the drawing.

        Returns
        -------
        Figure
            The same bytes for the same drawing, whenever and wherever it is made with one matplotlib version.

        Raises
        ------
        InputError
            Not a matplotlib figure, or no alternative text.

        Examples
        --------
        >>> import robthermal as rt
        >>> drawing = rt.report.box_ranges(["x1"], [20.0], [30.0])
        >>> rt.report.Figure.draw(drawing, alt="Range of x1: 20 to 30 °C.", caption="Ranges.").caption
        'Ranges.'
        """
        # Imported here: matplotlib is slow to load, and a summary without figures does not need it.
        import matplotlib
        import matplotlib.pyplot as plt

        if not hasattr(figure, "savefig"):
            raise InputError(f"figure is a {type(figure).__name__}", where="Figure.draw",
                             expected="a matplotlib figure", remedy="From axes, pass axes.figure.")
        text = io.StringIO()
        # Letters as paths look the same on every machine; a fixed salt and no date make the file reproducible.
        with matplotlib.rc_context({"svg.fonttype": "path", "svg.hashsalt": "robthermal"}):
            plain_powers(figure)
            figure.savefig(text, format="svg", facecolor="none", edgecolor="none", bbox_inches=_laid_out(figure),
                           metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
        plt.close(figure)
        return cls(_bare(text.getvalue()), alt, caption)


def _laid_out(figure: Any) -> Any:
    """Arrange a matplotlib figure for good, and say which part of it is drawn on.

    What ``bbox_inches="tight"`` finds by drawing once more into nothing.
    """
    # Imported here: matplotlib is slow to load, and a summary without figures does not need it.
    import matplotlib
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    resolution, layout = figure.dpi, figure.get_layout_engine()
    FigureCanvasSVG(figure)  # measures letters as they are drawn
    if layout is not None:
        layout.execute(figure)
        with matplotlib.rc_context({"figure.autolayout": False, "figure.constrained_layout.use": False}):
            figure.set_layout_engine(None)  # done
    box = figure.get_tightbbox().padded(_PAD)
    figure.set_dpi(resolution)  # which that canvas has changed
    return box


def inline(figure: Figure, prefix: str) -> str:
    """SVG of a figure for an HTML page: every id begins with `prefix`, black and white are the page's ink and paper."""
    svg = re.sub(r'(\sid=")([^"]+)"', rf'\g<1>{prefix}\2"', figure.svg)
    svg = re.sub(r'\s(?:xlink:)?href="#([^"]+)"', rf' href="#{prefix}\1"', svg)
    svg = re.sub(r"url\(#([^)]+)\)", rf"url(#{prefix}\1)", svg)
    svg = re.sub(r'\sxmlns(?::\w+)?="[^"]*"', "", svg)  # implied in HTML
    svg = svg.replace("#000000", "currentColor").replace("#ffffff", "var(--card, #ffffff)")
    head, rest = re.match(r"\s*<svg([^>]*)>(.*)", svg, re.DOTALL).groups()  # type: ignore[union-attr]  # parsed before
    width = re.search(r'\swidth="([\d.]+)pt"', head)
    head = re.sub(r'\s(?:width|height|role|aria-label|version)="[^"]*"', "", head)
    limit = f' style="max-width: {_ENLARGED * float(width.group(1)):.0f}pt"' if width else ""
    return f'<svg{head} fill="currentColor" role="img" aria-label="{_attribute(figure.alt)}"{limit}>{rest}'


def _attribute(text: str) -> str:
    return text.replace("&", "&amp;").replace('"', "&quot;").replace("<", "&lt;").replace(">", "&gt;")


def _bare(svg: str) -> str:
    """Only the element: no XML declaration, comments, metadata, or style sheet that would reach the whole page."""
    svg = re.sub(r"<!--.*?-->", "", svg, flags=re.DOTALL)
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    svg = re.sub(r"<defs>\s*<style[^>]*>.*?</style>\s*</defs>", "", svg, flags=re.DOTALL)
    svg = re.sub(r'(?<=\sd=")[^"]+', lambda path: _rounded(path.group()), svg)
    return re.sub(r"\n\s*", "\n", svg[svg.index("<svg"):]).strip()


def _rounded(path: str) -> str:
    # A hundredth of a point is 3.5 µm on paper; matplotlib writes a millionth.
    return re.sub(r"\s+", " ", re.sub(r"(\.\d\d)\d+", r"\1", path)).strip()


def _refuse_unsafe(svg: str, where: str) -> None:
    if "<!" in svg:
        raise InputError("svg holds a declaration or comment", where=where, expected="one <svg> element",
                         remedy="Use Figure.draw.")
    try:
        root = ElementTree.fromstring(re.sub(r"\sxlink:href=", " href=", svg))
    except ElementTree.ParseError as error:
        raise InputError(f"svg is not well formed ({error})", where=where, remedy="Use Figure.draw.") from None
    if root.tag.split("}")[-1] != "svg":
        raise InputError(f"svg begins with <{root.tag}>", where=where, expected="one <svg> element")
    for element in root.iter():
        tag = element.tag.split("}")[-1]
        links = [value for key, value in element.attrib.items() if key.split("}")[-1] == "href"]
        outside = [link for link in links if not link.startswith(("#", "data:image/png;"))]
        outside += [value for value in element.attrib.values() if re.search(r"url\((?!#)", value)]
        if tag in _FORBIDDEN or outside or any(key.lower().startswith("on") for key in element.attrib):
            raise InputError(f"svg has a script or outside resource in <{tag}>", where=where, remedy="Use Figure.draw.")
