"""Drawings of reports: no letters lie on other letters, and every axis has a name with its unit."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text

from robthermal import report

TIME = np.arange(0.0, 7200.0, 20.0)
MODEL = {name: 295.0 + 3 * k + np.sin(TIME / 900 + k) for k, name in
         enumerate(("T_plate", "T_sink", "T_cold_side_of_module_2", "T_a", "T_b", "T_c"))}
MEASURED = {name: values + 0.05 * np.cos(TIME) for name, values in MODEL.items()}
LEFT = {name: MEASURED[name] - MODEL[name] for name in MODEL}
LONG = "validation: log_of_the_bench_after_the_repair_2026-11-23.csv"
FEW = dict(itertools.islice(MEASURED.items(), 2))
FIGURES = {
    "two sensors": lambda: report.measured_against_model(TIME, FEW, MODEL, title="train: a.csv"),
    "long names": lambda: report.measured_against_model(TIME, MEASURED, MODEL, title=LONG),
    "voltages": lambda: report.measured_against_model(TIME, FEW, MODEL, title=LONG, unit="V"),
    "residuals": lambda: report.residuals_before_after(TIME, LEFT, LEFT, noise=0.05, unit="K", title=LONG),
    "spectra": lambda: report.spectra_before_after(np.geomspace(1e-4, 1e-1, 50), *2 * [
        {name: np.geomspace(1.0, 1e-3, 50) for name in MODEL}], unit="K/√Hz", title=LONG),
    "limits": lambda: report.current_limits(["cooling, energy", "heating, max"], [1.47, np.nan],
                                            {"I* of m1": 2.3, "declared limit of m1": 3.3, "I* of m2": 2.4}),
    "boxes": lambda: report.box_ranges([f"x{k}" for k in range(18)], np.linspace(5, 9, 18), np.linspace(30, 90, 18)),
    "loads": lambda: report.load_curve({"m1": ([0, 1, 2], [0, 3, 4]), "m2": ([0, 1, 2], [0, 3.1, 4.2])},
                                       {"m1": (2.0, 4.0), "m2": (2.0, 4.2)})}


def texts(figure: Any) -> list[tuple[str, Any]]:
    """Everything that is written, with the box it takes on the canvas."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    hidden = set()  # ticks outside of the view are no letters on the page
    for axis in (axis for axes in figure.axes for axis in (axes.xaxis, axes.yaxis)):
        low, high = sorted(axis.get_view_interval())
        hidden |= {label for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks())
                   if not low <= tick.get_loc() <= high for label in (tick.label1, tick.label2)}
    found = [one for one in figure.findobj(Text) if one.get_visible() and one.get_text().strip() and one not in hidden]
    return [(one.get_text(), one.get_window_extent(canvas.get_renderer())) for one in found]


def touching(figure: Any) -> list[tuple[str, str]]:
    """Pairs of texts that lie on each other by more than a pixel."""
    return [(a, b) for (a, one), (b, two) in itertools.combinations(texts(figure), 2)
            if min(one.x1, two.x1) - max(one.x0, two.x0) > 1.0 and min(one.y1, two.y1) - max(one.y0, two.y0) > 1.0]


@pytest.mark.parametrize("name", FIGURES)
def test_no_text_lies_on_another(name: str) -> None:
    figure = FIGURES[name]()
    assert len(texts(figure)) > 8
    assert touching(figure) == []


@pytest.mark.parametrize("name", FIGURES)
def test_axes_say_what_they_show(name: str) -> None:
    axes = FIGURES[name]().axes
    assert all(axis.get_xlabel().endswith("]") for axis in axes if axis.get_subplotspec().is_last_row())
    assert name in ("limits", "boxes") or all("[" in axis.get_ylabel() for axis in axes)


def test_overlaps_are_seen() -> None:
    figure = FIGURES["two sensors"]()
    figure.axes[0].set_title("a title that is as long as the legend is wide " * 2, loc="right")
    assert touching(figure)
