"""Noise levels are looked for downhill from where they are: the most likely one, wherever that is."""

from __future__ import annotations

import pytest

from robthermal.diagnosis.fit import NoiseScaling
from robthermal.diagnosis.fit._noise_scaling import _lowest, _nearest

FACTORS = [0.5 + 0.1 * k for k in range(15)]


@pytest.mark.parametrize("best", [0, 1, 6, 7, 13, 14])
@pytest.mark.parametrize("near", [0, 5, 7, 14])
def test_the_most_likely_level_is_found_from_any_other(best: int, near: int) -> None:
    asked: list[float] = []
    tried = [NoiseScaling(factor, {}) for factor in FACTORS]

    def cost(levels: NoiseScaling) -> float:
        asked.append(levels.disturbance)
        return abs(levels.disturbance - FACTORS[best]) ** 1.5

    assert _lowest(tried, cost, near) is tried[best]
    assert len(asked) <= abs(best - near) + 3  # itself, one beyond, and one on the other side


def test_the_nearest_factor_is_that_of_the_smallest_ratio() -> None:
    assert [_nearest([0.5, 1.0, 2.0], now) for now in (0.1, 0.7, 0.72, 1.3, 1.5, 9.0)] == [0, 0, 1, 1, 2, 2]
