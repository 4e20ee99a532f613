"""What is wrong with a drawn figure: text over text or cut off, axes without a label or a unit, curves no name."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import combinations

import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.text import Text

SLACK = 1.0  # two texts may share this much [pixel]: the boxes of letters are larger than the letters


def complaints(figure: Figure) -> list[str]:
    """What a reader of the figure would complain of; an empty list for a good figure."""
    figure.canvas.draw()
    drawn = [(_said(text), text.get_window_extent()) for text in _texts(figure)]
    found = [f"{one!r} lies on {other!r}" for (one, first), (other, second) in combinations(drawn, 2)
             if min(first.x1, second.x1) - max(first.x0, second.x0) > SLACK
             and min(first.y1, second.y1) - max(first.y0, second.y0) > SLACK]
    page = figure.bbox
    found += [f"{said!r} is cut off by the edge of the figure" for said, box in drawn
              if min(box.x0 - page.x0, box.y0 - page.y0, page.x1 - box.x1, page.y1 - box.y1) < -SLACK]
    for axes in figure.axes:
        found += _of_axes(axes)
    return found


def look_at_open_figures(*, described: bool) -> None:
    """Complain of what a cell of a notebook has drawn, and close it; figures need an alternative text."""
    found = [complaint for number in plt.get_fignums() for complaint in complaints(plt.figure(number))]
    if plt.get_fignums() and not described:
        found.append("a figure without alternative text")
    if described and not plt.get_fignums():
        found.append("an alternative text without a figure")
    plt.close("all")
    assert not found, found


def _said(text: Text) -> str:
    return " ".join(text.get_text().split())


def _texts(figure: Figure) -> Iterator[Text]:
    """Every text that is seen: labels of ticks within the limits, and all others that are not empty."""
    ticks: set[Text] = set()
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            scaled = axis.get_transform()
            low, high = sorted(scaled.transform(axis.get_view_interval()))
            margin = 1e-6 * (high - low)
            shown = axes.axison and axes.get_visible()
            for tick in [*axis.get_major_ticks(), *axis.get_minor_ticks()]:
                labels = {tick.label1, tick.label2}
                ticks |= labels
                if shown and low - margin <= scaled.transform(tick.get_loc()) <= high + margin:
                    yield from (one for one in labels if one.get_visible() and _said(one))
            if not axes.axison:
                ticks |= {axis.label, axis.offsetText}
    for text in figure.findobj(Text):
        if text not in ticks and text.get_visible() and _said(text):
            yield text


def _of_axes(axes: Axes) -> list[str]:
    if not (axes.has_data() and axes.axison and axes.get_visible()):
        return []
    found = []
    shared = axes.get_shared_x_axes().get_siblings(axes)
    if not any(_named(one.xaxis) for one in shared):
        found.append(f"x axis says {axes.get_xlabel()!r}: no quantity with its unit in brackets")
    if not _named(axes.yaxis) and not any(_named(one.yaxis) for one in axes.get_shared_y_axes().get_siblings(axes)):
        found.append(f"y axis says {axes.get_ylabel()!r}: no quantity with its unit in brackets")
    names = {str(line.get_label()) for line in axes.lines if not str(line.get_label()).startswith("_")}
    beside = {_said(text) for text in axes.texts}
    legends = [one for one in (*(each.get_legend() for each in axes.figure.axes), *axes.figure.legends) if one]
    beside |= {_said(text) for legend in legends for text in legend.get_texts()}
    if len(names) > 1 and not names <= beside:
        found.append(f"{len(names)} curves, {sorted(names)}, and no legend")
    return found


def _named(axis: Axis) -> bool:
    """Whether an axis says what it shows: a quantity [unit], names at its ticks, or nothing at all."""
    ticks = [_said(tick) for tick in axis.get_ticklabels()]
    if any(re.search(r"[^\W\d_]", re.sub(r"\$.*?\$", "", tick)) for tick in ticks):
        return True
    if not any(ticks) or not axis.get_visible():
        return True
    label = axis.get_label_text()
    return "[" in label and label.rstrip().endswith("]")
