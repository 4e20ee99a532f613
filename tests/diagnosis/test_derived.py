"""Derivatives of a system's numbers where an effect scales or derives them from nominal parameters."""

from __future__ import annotations

import numpy as np
import pytest

from robthermal.diagnosis.fit._derived import with_quantities


@pytest.mark.parametrize("change", [-0.5, 0.0, 1.0])
def test_a_number_that_an_effect_scales_moves_with_its_parameter_by_the_scaled_derivative(change: float) -> None:
    """G = g (1 + x) with the unknowns g and x, and a capacity that no effect changes."""
    known = [{"links.a-b.conductance": 1.0}, {"lumps.a.capacity": 3.0}]

    def numbers(v: np.ndarray) -> dict[str, float]:
        return {"links.a-b.conductance": v[0] * (1.0 + v[2]), "lumps.a.capacity": 3.0 * v[1]}

    by_g, by_c, by_x = with_quantities(numbers, np.array([2.0, 50.0, change]), known, np.full(3, 1e3))
    assert by_g == {"links.a-b.conductance": pytest.approx(1.0 + change, rel=1e-6)}
    assert by_c == {"lumps.a.capacity": 3.0}
    assert by_x == {"links.a-b.conductance": pytest.approx(2.0, rel=1e-6)}


@pytest.mark.parametrize("change", [0.0, 1.0])
def test_a_parameter_at_its_upper_bound_moves_its_number(change: float) -> None:
    """Numbers stand still beyond a bound: a step across it would say that the parameter moves nothing."""
    def numbers(v: np.ndarray) -> dict[str, float]:
        return {"links.a-b.conductance": min(v[0], 2.0) * (1.0 + v[1])}

    by_g, by_x = with_quantities(numbers, np.array([2.0, change]), [{"links.a-b.conductance": 1.0}],
                                 np.array([2.0, 1e3]))
    assert by_g == {"links.a-b.conductance": pytest.approx(1.0 + change, rel=1e-6)}
    assert by_x == {"links.a-b.conductance": pytest.approx(2.0, rel=1e-6)}
