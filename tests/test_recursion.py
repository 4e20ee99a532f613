"""Linear recursions, in C and in blocks, and filters 1/a, against a loop over the steps."""

from __future__ import annotations

from pathlib import Path

import compiled
import numpy as np
import pytest

from robthermal import _recursion
from robthermal._all_pole import all_pole
from robthermal._library import LANES, library_name
from robthermal._recursion import recursion


@pytest.fixture(autouse=True, params=["numpy", *LANES])
def way(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """All ways of a recursion: without C, and with vectors of every width that this processor has."""
    run = None if request.param == "numpy" else compiled.recursion(request.param)
    monkeypatch.setattr(_recursion, "compiled", lambda: run)


@pytest.mark.parametrize("n", [0, 1, 2, 7, 50, 1025])
@pytest.mark.parametrize(("columns", "states"), [(1, 3), (5, 3), (1, 6), (8, 4), (13, 3), (16, 6), (7, 5), (9, 9)])
def test_is_what_a_loop_gives(n: int, columns: int, states: int) -> None:
    rng = np.random.default_rng(n)
    A = 0.5 * np.eye(states) + 0.1 * rng.standard_normal((n, states, states))
    b = rng.standard_normal((n, states, columns))
    start = rng.standard_normal((states, columns))
    expected = [start]
    for k in range(n):
        expected.append(A[k] @ expected[-1] + b[k])
    found = recursion(A, b, start)
    assert found.shape == (n + 1, states, columns)
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("laid", ["one", "transposed", "every other"])
def test_arrays_may_lie_in_any_way(laid: str) -> None:
    rng = np.random.default_rng(0)
    A, b = 0.4 * rng.standard_normal((40, 3, 3)), rng.standard_normal((40, 3, 2))
    given = {"one": (np.broadcast_to(A[0], A.shape), b), "transposed": (A.transpose(0, 2, 1), np.asfortranarray(b)),
             "every other": (A[::2], b[::2])}[laid]
    expected = [np.zeros((3, 2))]
    for transition, pushed in zip(*given, strict=True):
        expected.append(transition @ expected[-1] + pushed)
    np.testing.assert_allclose(recursion(*given), expected, rtol=1e-12, atol=1e-12)


def test_sizes_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ValueError, match="transitions"):
        recursion(np.zeros((4, 3, 3)), np.zeros((5, 3, 1)))


def test_starts_from_nothing_by_default_and_leaves_its_arguments_alone() -> None:
    A, b = np.full((9, 1, 1), 0.5), np.ones((9, 1, 2))
    found = recursion(A, b)
    np.testing.assert_allclose(found[:, 0, 1], 2.0 * (1.0 - 0.5 ** np.arange(10.0)), rtol=1e-15)
    assert np.all(b == 1.0) and np.all(A == 0.5)


def test_a_stiff_step_that_forgets_its_start() -> None:
    """Transitions whose products underflow to 0."""
    A, b = np.full((2000, 1, 1), 1e-30), np.ones((2000, 1, 1))
    np.testing.assert_allclose(recursion(A, b, np.array([[1e20]]))[2:, 0, 0], 1.0, rtol=1e-9)


@pytest.mark.parametrize(("roots", "shape"), [([], (5,)), ([0.9], (1,)), ([0.9], (300, 2)), ([0.99, -0.5, 0.3], (300,)),
                                              ([0.8 + 0.3j], (300, 2)), ([0.9, 0.2, 0.1], (2,)), ([0.5], (0,))])
def test_filter_without_zeros_sample_by_sample(roots: list[complex], shape: tuple[int, ...]) -> None:
    a, signal = np.poly(roots) if roots else np.ones(1), np.random.default_rng(0).standard_normal(shape)
    y = np.zeros(shape, dtype=complex)
    for k in range(len(signal)):
        y[k] = signal[k] - sum(a[j] * y[k - j] for j in range(1, min(k, len(roots)) + 1))
    found = all_pole(a, signal)
    assert found.shape == shape
    np.testing.assert_allclose(found, y if np.iscomplexobj(a) else y.real, rtol=1e-12, atol=1e-12)


def test_a_header_that_changes_is_another_library(tmp_path: Path) -> None:
    source = compiled.copied(_recursion, tmp_path)
    same = library_name(source, _recursion.HEADERS)
    header = source.with_name("_lanes.h")
    header.write_text(header.read_text(encoding="utf-8") + " ", encoding="utf-8")
    assert same == compiled.name_of(_recursion) != library_name(source, _recursion.HEADERS)
