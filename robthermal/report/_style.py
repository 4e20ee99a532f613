"""Style that all drawings share."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from .._drawing import COLORS, line_of

_LETTERS = 66  # of a legend's line across a figure
WIDTH = 5.2  # inch: letters of 9 points are then as large as the text in the report's column, and read on a phone

# Black and white become the ink and paper of the page (see _figure.inline), so that dark mode works.
_STYLE: Any = {  # names are checked by matplotlib when they are set
    "font.family": "sans-serif", "font.sans-serif": ["DejaVu Sans"], "font.size": 9.0, "axes.titlesize": 10.0,
    "axes.titleweight": "bold", "axes.titlelocation": "left", "figure.titlesize": 10.0, "axes.labelsize": 9.0,
    "xtick.labelsize": 8.5, "ytick.labelsize": 8.5, "legend.fontsize": 8.5, "legend.frameon": False,
    "axes.spines.top": False, "axes.spines.right": False, "axes.linewidth": 0.8, "axes.axisbelow": True,
    "axes.grid": True, "grid.color": "#888888", "grid.alpha": 0.3, "grid.linewidth": 0.6,
    "lines.linewidth": 1.4, "figure.figsize": (WIDTH, 3.6), "figure.constrained_layout.use": True,
    "figure.facecolor": "white", "axes.facecolor": "white", "text.color": "black", "axes.labelcolor": "black",
    "xtick.color": "black", "ytick.color": "black", "axes.edgecolor": "black",
    "axes.prop_cycle": f"cycler(color={list(COLORS)})",
}


@contextmanager
def house_style() -> Iterator[None]:
    """Draw in the style of the report: sizes, grid, colors that do not rely on red and green.

    Yields
    ------
    None
        matplotlib's own settings come back at the end of the block.

    Examples
    --------
    >>> import matplotlib, robthermal as rt
    >>> with rt.report.house_style():
    ...     matplotlib.rcParams["font.size"]
    9.0
    """
    # Imported here: matplotlib is slow to load, and a summary without figures does not need it.
    import matplotlib

    with matplotlib.rc_context(_STYLE):
        yield


def look(name: str, drawn: Sequence[str], order: Sequence[str]) -> tuple[str, str]:
    """Color and dashes of a sensor: by its place in `order`, else by its place among those drawn."""
    one = line_of(list(order if name in order else drawn).index(name))
    return one["color"], one["linestyle"]


def plain(text: str) -> str:
    """Text in which a dollar is a dollar: matplotlib would read a formula between two."""
    return text.replace("$", r"\$")


def canvas(height: float, rows: int = 1, **options: Any) -> tuple[Any, Any]:
    """Figure of the report's width and its axes, outside pyplot: nothing stays open if the caller drops it."""
    # Imported here: matplotlib is slow to load, and a summary without figures does not need it.
    from matplotlib.figure import Figure as Drawing

    drawing = Drawing(figsize=(WIDTH, height), layout="constrained")
    return drawing, drawing.subplots(rows, 1, **options)


def legend_above(figure: Any, lines: Sequence[Any], title: str = "") -> None:
    """Legend over the whole figure, with the figure's title, above those of its axes: never on data or on letters."""
    widths = [len(line.get_label()) + 5 for line in lines]  # letters, with the sample of the line
    columns = len(lines) if sum(widths) <= _LETTERS else max(1, min(len(lines), _LETTERS // max(widths)))
    figure.legend(handles=list(lines), loc="outside upper left", ncols=columns, borderaxespad=0.0, columnspacing=1.2,
                  handlelength=1.4, title=plain(title) or None, alignment="left")
