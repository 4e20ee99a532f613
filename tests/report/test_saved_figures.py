"""Figures as they are saved: arranged as matplotlib itself does, powers of ten in plain letters."""

from __future__ import annotations

import re
from typing import Any

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import pytest

from robthermal.report import Figure, house_style, spectra_before_after
from robthermal.report._powers import plain_power, plain_powers

_DIGITS = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹−", "-0123456789-")


def spectra() -> Any:
    frequency = np.geomspace(1e-4, 1e-1, 50)
    before, after = {"T_plate": 1e-3 / frequency, "T_sink": np.full(50, 0.02)}, {"T_plate": 1e-4 / frequency}
    return spectra_before_after(frequency, before, {**after, "T_sink": np.full(50, 0.02)}, unit="K/√Hz", title="train")


def limits_without_a_layout() -> Any:
    figure, axes = plt.subplots(1, 2, figsize=(4.0, 2.0))
    axes[0].plot([0, 1], [1e5, 3e5], label="load")
    axes[0].legend()
    axes[1].imshow(np.arange(12.0).reshape(3, 4))
    return figure


def shared() -> Any:
    figure, axes = plt.subplots(2, sharex=True, layout="constrained", figsize=(5.0, 3.0))
    for ax in axes:
        ax.loglog([0.3, 40.0], [2e-9, 5e-9])
    figure.legend(handles=axes[0].get_lines(), labels=["gain"], loc="outside upper left")
    return figure


def numbers(svg: str) -> list[str]:
    """All of a drawing but the names of its clips, which hang on the last digit of a place."""
    svg = re.sub(r'url\(#[^)]*\)|\sid="[^"]*"', "", svg)
    return re.sub(r"(?<![\d.])-0(?![\d.])", "0", svg).split()


@pytest.mark.parametrize("draw", [spectra, limits_without_a_layout, shared])
def test_a_saved_figure_is_as_matplotlib_arranges_it(draw: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Which draws once more to find what is drawn on."""
    with house_style():
        found = numbers(Figure.draw(draw(), alt="Test.", caption="Test.").svg)
        monkeypatch.setattr("robthermal.report._figure._laid_out", lambda figure: "tight")
        with matplotlib.rc_context({"savefig.pad_inches": 0.04}):
            expected = numbers(Figure.draw(draw(), alt="Test.", caption="Test.").svg)
    assert len(found) == len(expected) > 200
    assert sum(a != b for a, b in zip(found, expected, strict=True)) <= 0.005 * len(found)  # the last of two decimals


def test_numbers_beside_logarithmic_axes_are_those_of_their_ticks() -> None:
    figure = shared()
    plain_powers(figure)
    figure.canvas.draw()
    said = [(text.translate(_DIGITS), value) for axes in figure.axes for axis in (axes.xaxis, axes.yaxis)
            for minor in (False, True) for text, value in zip(
                axis.get_minor_formatter().format_ticks(axis.get_minorticklocs()) if minor
                else axis.get_major_formatter().format_ticks(axis.get_majorticklocs()),
                axis.get_minorticklocs() if minor else axis.get_majorticklocs(), strict=True) if text]
    plt.close(figure)
    assert len(said) >= 12 and not any("$" in text for text, _ in said)
    for text, value in said:
        factor, base, power = re.fullmatch(r"(?:(\d)×)?(10)(-?\d+)", text).groups("1")  # type: ignore[union-attr]
        assert float(factor) * float(base) ** int(power) == pytest.approx(value, rel=1e-12)


def test_what_is_no_power_of_ten_stays_as_it_is() -> None:
    texts = [r"$\mathdefault{10^{3.50}}$", r"$\alpha$", "", "1e-5"]
    assert [plain_power(text) for text in texts] == texts
    assert plain_power(r"$\mathdefault{0}$") == "0"
