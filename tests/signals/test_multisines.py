"""Multisines for several inputs: orthogonality, zippers, and what all experiments share."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from robthermal import InputError
from robthermal.signals import crest_factor, multisine, multisines

COMMON: dict[str, Any] = {"sample_time": 0.5, "lines": range(2, 40), "rms": 1.0, "seed": 3}


@pytest.mark.parametrize(
    ("n_u", "phases"),
    [(1, "random"), (2, "random"), (3, "random"), (4, "random"), (5, "random"), (2, "low_crest"), (3, "low_crest")],
)
def test_experiments_are_orthogonal_at_every_line(n_u: int, phases: Any) -> None:
    heat = multisines(200, inputs=n_u, phases=phases, offset="nonnegative", **COMMON)
    U = np.fft.rfft(heat.signals[0], axis=1, norm="ortho")[:, 2:40]  # (experiments, lines, inputs)
    product = np.einsum("eki,ekj->kij", U, U.conj())
    power = 200 / 38 / 2  # |U|^2 per line and experiment: rms^2 N / (2 lines)
    np.testing.assert_allclose(product, np.broadcast_to(n_u * power * np.eye(n_u), product.shape), atol=1e-9)


def test_zippered_lines_excite_one_input_each() -> None:
    heat = multisines(200, inputs=3, arrangement="zippered", **COMMON)
    assert heat.signals.shape == (1, 1, 200, 3)
    excited = np.abs(np.fft.rfft(heat.experiments[0], axis=0)) > 1e-9
    np.testing.assert_array_equal(excited.sum(axis=1), np.isin(np.arange(101), np.arange(2, 40)))
    for i in range(3):
        np.testing.assert_array_equal(np.flatnonzero(excited[:, i]), heat.lines[i])
        np.testing.assert_array_equal(heat.lines[i], np.arange(2 + i, 40, 3))


def test_independent_inputs_and_realizations_differ_in_phase_only() -> None:
    heat = multisines(200, inputs=2, arrangement="independent", realizations=3, periods=2, **COMMON)
    assert heat.signals.shape == (3, 1, 400, 2)
    assert len(heat.experiments) == 3
    np.testing.assert_array_equal(heat.signals[:, :, :200], heat.signals[:, :, 200:])
    U = np.fft.rfft(heat.signals[:, 0, :200], axis=1)[:, 2:40].transpose(0, 2, 1).reshape(6, 38)
    np.testing.assert_allclose(np.abs(U), np.abs(U[0, 0]))
    likeness = np.abs(U @ U.conj().T) / 38 / np.abs(U[0, 0]) ** 2
    assert (likeness - np.eye(6)).max() < 0.6  # random phases: about 38^-1/2
    np.testing.assert_array_equal(heat.signals[0, 0, :200, 0], multisine(200, **COMMON))


def test_all_experiments_share_level_and_operating_point() -> None:
    heat = multisines(
        200, inputs=3, realizations=2, offset="nonnegative", **{**COMMON, "rms": None}, amplitude=[5.0, 1.0, 2.0]
    )
    peaks = np.abs(heat.signals - heat.signals.mean(axis=2, keepdims=True)).max(axis=(0, 1, 2))
    np.testing.assert_allclose(peaks, [5.0, 1.0, 2.0])
    np.testing.assert_array_equal(heat.signals.min(axis=(0, 1, 2)), 0.0)
    means = heat.signals.mean(axis=2)
    np.testing.assert_allclose(means, np.broadcast_to(means[0, 0], means.shape))


@pytest.mark.parametrize("n_u", [2, 3])
def test_low_crest_holds_in_every_experiment(n_u: int) -> None:
    heat = multisines(400, inputs=n_u, phases="low_crest", **COMMON)
    direct = [[crest_factor(experiment[:, i]) for i in range(n_u)] for experiment in heat.experiments]
    np.testing.assert_allclose(heat.crest_factors[0], direct)
    assert (heat.crest_factors < heat.schroeder_crest_factors).all()
    assert heat.outcome.ok and "Schroeder" in heat.outcome.text
    schroeder = multisine(400, phases="schroeder", **COMMON)
    np.testing.assert_allclose(heat.schroeder_crest_factors, crest_factor(schroeder))


def test_optimized_realizations_say_that_their_phases_are_not_random() -> None:
    heat = multisines(200, inputs=1, phases="low_crest", realizations=2, **COMMON)
    assert not np.allclose(heat.signals[0], heat.signals[1])
    assert "assumes random phases" in heat.outcome.text


def test_printed_and_drawn() -> None:
    heat = multisines(200, inputs=2, **COMMON)
    assert "orthogonal multisines" in str(heat) and "crest" in str(heat)
    assert len(heat.plot()) == 2
    with pytest.raises(ValueError, match="read-only"):
        heat.signals[0] = 0.0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"inputs": 0}, "inputs is 0"),
        ({"inputs": 1.5}, "inputs is 1.5"),
        ({"realizations": 0}, "realizations is 0"),
        ({"periods": -1}, "periods is -1"),
        ({"arrangement": "zipper"}, "arrangement is 'zipper'.*'zippered'"),
        ({"arrangement": "zippered", "lines": [3]}, "1 lines for 2 zippered inputs"),
        ({"phases": "schroeder", "realizations": 2}, "same for every input and realization"),
        ({"phases": "schroeder", "arrangement": "independent"}, "same for every input and realization"),
        ({"rms": [1.0]}, "rms has 1 values for 2 inputs"),
        ({"rms": [1.0, -1.0]}, "rms is -1.0"),
        ({"rms": None}, "neither of rms and amplitude"),
        ({"offset": [1.0, 2.0, 3.0]}, "offset has 3 values for 2 inputs"),
        ({"lines": [120]}, "Nyquist"),
        ({"sample_time": -1.0}, "sample_time is -1.0"),
    ],
)
def test_multisines_refuse(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        multisines(200, **{"inputs": 2, **COMMON, **changes})
