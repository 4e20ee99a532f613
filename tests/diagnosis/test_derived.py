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


@pytest.mark.parametrize("place", range(5))
def test_a_number_that_an_effect_adds_moves_with_the_one_parameter_that_it_is_derived_from(place: int) -> None:
    """Of five conductances one is split in two halves beside another number; where none is split nothing is added."""
    known = [{f"links.{i}.conductance": 1.0} for i in range(5)]

    def numbers(v: np.ndarray) -> dict[str, float]:
        own = {f"links.{i}.conductance": float(v[i]) for i in range(5)}
        return own | {"links.new.conductance": 2.0 * float(v[place]), "lumps.new.capacity": float(v[5])}

    *found, by_size = with_quantities(numbers, np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0]), known, np.full(6, 1e3))
    assert by_size == {"lumps.new.capacity": pytest.approx(1.0)}
    assert [set(column) for column in found] == [
        {f"links.{i}.conductance", *(["links.new.conductance"] if i == place else [])} for i in range(5)]
    assert found[place]["links.new.conductance"] == pytest.approx(2.0)


def test_few_systems_are_built_to_find_what_an_effect_derives() -> None:
    """A path whose conductance is split among thirty: the number has its own name, and two more systems tell."""
    known, asked = [{f"links.{i}.conductance": 1.0} for i in range(30)], []

    def numbers(v: np.ndarray) -> dict[str, float]:
        asked.append(v)
        return {f"links.{i}.conductance": float(v[i]) * (2.0 if i == 17 else 1.0) for i in range(30)} | {
            "lumps.new.capacity": float(v[30])}

    found = with_quantities(numbers, np.arange(1.0, 32.0), known, np.full(31, 1e3))
    assert found[17] == {"links.17.conductance": pytest.approx(2.0)}
    assert len(asked) == 5  # as it is, the capacity moved, all moved, all but one, and that one
