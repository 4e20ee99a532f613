"""Kalman filter and whitening, in C with vectors of every width and in blocks of samples, against a loop over them."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any

import compiled
import numpy as np
import pytest

from robthermal._library import LANES, library_name
from robthermal.diagnosis.path import _filter, _riccati, _whitening
from robthermal.diagnosis.path._riccati import filtered
from robthermal.diagnosis.path._whitening import Whitener


@pytest.fixture(autouse=True, params=["numpy", *LANES])
def way(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """All ways: without C, and with vectors of every width that this processor has."""
    found = None if request.param == "numpy" else compiled.filters(request.param)
    for module in (_riccati, _whitening):
        monkeypatch.setattr(module, "compiled_for", lambda C: found)


def model(n: int, n_z: int, n_s: int) -> dict[str, Any]:
    """A system that varies, whose sensors read sums of states."""
    rng = np.random.default_rng(100 * n_z + n_s)
    noise, added = rng.standard_normal((n, n_s, n_s)), 0.1 * rng.standard_normal((n, n_z, n_z))
    return {"A": 0.9 * np.eye(n_z) + 0.1 / n_z * rng.standard_normal((n, n_z, n_z)),
            "C": rng.standard_normal((n, n_s, n_z)), "R": 0.1 * np.eye(n_s) + noise @ noise.swapaxes(1, 2),
            "Q": added @ added.swapaxes(1, 2), "P": 0.3 * np.eye(n_z)}


def looped(A: np.ndarray, C: np.ndarray, R: np.ndarray, Q: np.ndarray, P: np.ndarray, r: np.ndarray) -> np.ndarray:
    """Whitened innovations by the textbook's filter, in Joseph's form."""
    x, out = np.zeros((A.shape[1], r.shape[2])), np.empty(r.shape)
    for k in range(len(A)):
        S = C[k] @ P @ C[k].T + R[k]
        gain = P @ C[k].T @ np.linalg.inv(S)
        out[k] = np.linalg.inv(np.linalg.cholesky(S)) @ (r[k] - C[k] @ x)
        x = A[k] @ (x + gain @ (r[k] - C[k] @ x))
        left = np.eye(len(P)) - gain @ C[k]
        P = A[k] @ (left @ P @ left.T + gain @ R[k] @ gain.T) @ A[k].T + Q[k]
    return out


@pytest.mark.parametrize(("n", "n_z", "n_s", "columns"), [(1, 1, 1, 1), (7, 3, 2, 1), (50, 5, 3, 4), (300, 4, 1, 7),
                                                          (150, 9, 4, 33), (40, 6, 5, 64), (40, 2, 2, 131)])
def test_innovations_are_those_of_a_loop(n: int, n_z: int, n_s: int, columns: int) -> None:
    given, r = model(n, n_z, n_s), np.random.default_rng(n).standard_normal((n, n_s, columns))
    white = Whitener(given["A"], given["C"], *filtered(**given))
    np.testing.assert_allclose(white(r), looped(**given, r=r), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("laid", ["one for all", "every other", "transposed"])
def test_matrices_may_lie_in_any_way(laid: str) -> None:
    given = model(40, 3, 2)
    for name in "ACRQ":
        one = given[name]
        given[name] = {"one for all": np.broadcast_to(one[0], one.shape), "every other": np.repeat(one, 2, axis=0)[::2],
                       "transposed": np.ascontiguousarray(one.swapaxes(1, 2)).swapaxes(1, 2)}[laid]
    r = np.asfortranarray(np.random.default_rng(0).standard_normal((40, 2, 5)))
    white = Whitener(given["A"], given["C"], *filtered(**given))
    np.testing.assert_allclose(white(r), looped(**given, r=r), rtol=1e-9, atol=1e-9)


def test_a_missing_reading_and_what_it_is_whitened_into() -> None:
    """Its noise is a million kelvin: the others are whitened as if it were not there, and it is next to nothing."""
    given, r = model(60, 3, 2), np.random.default_rng(1).standard_normal((60, 2, 3))
    given["R"] = np.broadcast_to(0.1 * np.eye(2), (60, 2, 2)).copy()
    given["R"][:, 1, 1] = 1e12
    z = Whitener(given["A"], given["C"], *filtered(**given))(r)
    alone = {**given, "C": given["C"][:, :1], "R": given["R"][:, :1, :1]}
    np.testing.assert_allclose(z[:, :1], looped(**alone, r=r[:, :1]), rtol=1e-6, atol=1e-6)
    assert np.abs(z[:, 1]).max() < 1e-4


def test_into_a_part_of_an_array() -> None:
    given, r = model(30, 4, 2), np.random.default_rng(2).standard_normal((30, 2, 6))
    white, whole = Whitener(given["A"], given["C"], *filtered(**given)), np.zeros((62, 6))
    found = white(r, whole[1:61].reshape(r.shape))
    np.testing.assert_array_equal(whole[1:61].reshape(r.shape), found)
    assert not whole[0].any() and not whole[61].any()


def test_a_covariance_that_is_none_is_refused() -> None:
    given = model(200, 3, 2)
    given["R"][20, 0, 0] = -1e3
    with pytest.raises(np.linalg.LinAlgError):
        filtered(**given)


@pytest.mark.parametrize("name", ["A", "C", "R", "Q"])
def test_numbers_that_are_none_are_not_filtered_without_a_word(name: str) -> None:
    given = model(200, 3, 2)
    given[name][20] = np.nan
    gains = np.full(1, np.nan)
    with suppress(np.linalg.LinAlgError):
        gains, _ = filtered(**given)
    assert np.isnan(gains).any()


def test_sizes_that_do_not_fit_are_refused() -> None:
    given = model(5, 3, 2)
    with pytest.raises(ValueError):
        filtered(**{**given, "R": given["R"][:4]})
    with pytest.raises(ValueError):
        Whitener(given["A"], given["C"], *filtered(**given))(np.zeros((5, 3, 2)))


def test_large_systems_are_for_numpy() -> None:
    assert _filter.compiled_for(np.zeros((4, 2, 65))) is None
    assert _filter.compiled_for(np.zeros((4, 65, 2))) is None


def test_another_source_is_another_library(tmp_path: Path) -> None:
    source = compiled.copied(_filter, tmp_path, new="\n")
    assert compiled.name_of(_filter) != library_name(source, _filter.HEADERS)
    assert _filter.compiled(source.parent) is None
