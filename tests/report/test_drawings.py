"""Drawings: the right numbers in the right places, reproducible, nothing left open."""

from __future__ import annotations

from typing import Any

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import pytest

import robthermal as rt
from robthermal.errors import InputError
from robthermal.report import (
    Figure,
    box_ranges,
    current_limits,
    house_style,
    load_curve,
    measured_against_model,
    residuals_before_after,
)


def labels(figure: Any) -> list[str]:
    return [text.get_text() for axes in figure.axes for text in axes.texts]


def test_traces_are_in_celsius_and_the_residual_is_measured_minus_model() -> None:
    figure = measured_against_model([0.0, 1.0, 2.0], {"T1": [300.0, np.nan, 301.0]}, {"T1": [300.5, 300.0, 301.25]})
    above, below = figure.axes
    np.testing.assert_allclose(above.lines[0].get_ydata(), [27.35, 26.85, 28.10])
    dots = above.patches[0].get_path().vertices[::2]
    np.testing.assert_allclose(dots, [[0.0, 26.85], [2.0, 27.85]])
    np.testing.assert_allclose(below.lines[0].get_ydata(), [-0.5, np.nan, -0.25])


def test_a_sensor_has_one_color_whichever_sensors_are_drawn_with_it() -> None:
    order, values = ("T1", "T2", "T3"), [300.0, 301.0]
    alone = measured_against_model([0.0, 1.0], {"T3": values}, {"T3": values}, order=order)
    both = residuals_before_after([0.0, 1.0], {"T3": values, "T1": values}, {"T3": values, "T1": values}, order=order)
    color = alone.axes[0].lines[0].get_color()
    assert color == both.axes[0].lines[0].get_color() != both.axes[0].lines[1].get_color()
    system = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"a": {"capacity": 1.0}},
                       links=[{"between": ("a", "room"), "conductance": 1.0}],
                       sensors={name: {"lump": "a"} for name in order})
    dots = [line.get_color() for line in system.plot().lines if line.get_marker() == "o"]
    assert dots[2] == color and len(set(dots)) == 3


@pytest.mark.parametrize(("span", "unit"), [(100.0, "s"), (3000.0, "min"), (90_000.0, "h")])
def test_time_axis_has_a_readable_unit(span: float, unit: str) -> None:
    figure = measured_against_model([0.0, span], {"T1": [300.0, 301.0]}, {"T1": [300.0, 301.0]}, residual=False)
    assert len(figure.axes) == 1 and figure.axes[0].get_xlabel() == f"time [{unit}]"


def test_thinning_keeps_every_peak_and_gap() -> None:
    time = np.arange(100_000.0)
    values = np.full(time.size, 300.0)
    values[12_345], values[54_321], values[70_000:80_000] = 310.0, 290.0, np.nan
    line = measured_against_model(time, {"T1": values}, {"T1": values}).axes[0].lines[0]
    x, y = line.get_xdata() * 3600.0, line.get_ydata() + 273.15
    assert x.size <= 800 and np.all(np.diff(x) > 0)
    np.testing.assert_allclose([x[np.nanargmax(y)], x[np.nanargmin(y)]], [12_345.0, 54_321.0])
    np.testing.assert_allclose([np.nanmax(y), np.nanmin(y)], [310.0, 290.0])
    assert np.isnan(y[(x > 70_500) & (x < 79_500)]).all()


@pytest.mark.parametrize(("time", "measured", "model", "named"), [
    ([0.0, 0.0], {"T1": [1.0, 2.0]}, {"T1": [1.0, 2.0]}, "time"),
    ([0.0, 1.0], {}, {}, "measured is empty"),
    ([0.0, 1.0], {"T1": [1.0, 2.0]}, {"T2": [1.0, 2.0]}, "model has no 'T1'"),
    ([0.0, 1.0], {"T1": [1.0, 2.0]}, {"T1": [1.0]}, "model 'T1' has shape"),
])
def test_bad_traces_are_refused(time: Any, measured: Any, model: Any, named: str) -> None:
    with pytest.raises(InputError, match=named):
        measured_against_model(time, measured, model)


def test_limits_show_values_and_say_what_is_missing() -> None:
    figure = current_limits(["a", "b", "c"], [1.25, np.nan, np.inf], {"I* of m1": 2.3, "declared": np.inf})
    axes = figure.axes[0]
    assert labels(figure) == ["1.25 A", "nothing proven", "no limit found"]
    assert [bar.get_width() for bar in axes.patches] == [1.25, 0.0, axes.get_xlim()[1]]
    assert [line.get_xdata()[0] for line in axes.lines] == [2.3]
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["I* of m1: 2.3 A"]


def test_limits_with_nothing_proven_can_be_drawn() -> None:
    figure = current_limits(["a"], [np.nan])
    assert labels(figure) == ["nothing proven"]
    assert Figure.draw(figure, alt="None.", caption="None.").svg.startswith("<svg")


def test_ranges_are_bars_for_few_and_a_band_for_many() -> None:
    few = box_ranges(["x1", "x$2"], [5.0, 6.0], [60.0, 85.0])
    assert [(bar.get_x(), bar.get_x() + bar.get_width()) for bar in few.axes[0].patches] == [(5.0, 60.0), (6.0, 85.0)]
    assert labels(few) == ["5.0", "60.0", "6.0", "85.0"]
    n = 100_000
    high = np.full(n, 60.0)
    high[77_777] = 99.0
    many = box_ranges([f"x{i}" for i in range(n)], np.zeros(n), high)
    vertices = many.axes[0].collections[0].get_paths()[0].vertices
    assert (vertices[:, 1].min(), vertices[:, 1].max()) == (0.0, 99.0)
    assert len(Figure.draw(many, alt="Band.", caption="Band.").svg) < 100_000


@pytest.mark.parametrize(("call", "named"), [
    (lambda: current_limits(["a"], [1.0, 2.0]), "values has shape"),
    (lambda: current_limits([], []), "values has shape"),
    (lambda: box_ranges(["x1"], [5.0], [4.0]), "range of 'x1'"),
    (lambda: box_ranges(["x1"], [np.nan], [4.0]), "range of 'x1'"),
    (lambda: load_curve({"m1": ([0.0], [0.0, 1.0])}, {}), "curve 'm1'"),
    (lambda: load_curve({"m1": ([0.0], [0.0])}, {"m2": (1.0, 1.0)}), "folds has 'm2'"),
])
def test_bad_arrays_are_refused(call: Any, named: str) -> None:
    with pytest.raises(InputError, match=named):
        call()


def test_drawing_is_reproducible_and_leaves_nothing_open() -> None:
    def once() -> str:
        curve = load_curve({"m1": ([0.0, 1.0], [0.0, 2.0])}, {"m1": (1.0, 2.0)})
        return Figure.draw(curve, alt="Curve.", caption="C.").svg

    assert once() == once()
    with house_style():
        drawing, axes = plt.subplots()
        axes.plot([0, 1], [0, 1])
    before = dict(matplotlib.rcParams)
    Figure.draw(drawing, alt="Line.", caption="L.")
    assert plt.get_fignums() == [] and dict(matplotlib.rcParams) == before
    svg = once()
    assert svg.startswith("<svg") and "<style" not in svg and "<metadata" not in svg and "<!--" not in svg


@pytest.mark.parametrize("svg", [
    "<svg><script>1</script></svg>", '<svg onload="1"></svg>', '<svg><image href="http://example.org/a.png"/></svg>',
    '<svg xmlns:xlink="http://www.w3.org/1999/xlink"><image xlink:href="file:///etc/a"/></svg>', "<svg>", "<p></p>",
    '<!DOCTYPE svg [<!ENTITY a "b">]><svg>&a;</svg>', "<svg><foreignObject/></svg>",
    "<svg><style>@import 'a.css'</style></svg>", '<svg><path style="fill: url(a.svg#b)"/></svg>',
])
def test_unsafe_drawings_are_refused(svg: str) -> None:
    with pytest.raises(InputError, match="svg"):
        Figure(svg, alt="Something.", caption="Bad.")


def test_a_drawing_needs_words() -> None:
    with pytest.raises(InputError, match="alt is empty"):
        Figure("<svg></svg>", alt=" ", caption="No words.")
    with pytest.raises(InputError, match="expected a matplotlib figure|Expected a matplotlib figure"):
        Figure.draw([1, 2], alt="Numbers.", caption="Not a figure.")
