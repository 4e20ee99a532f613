"""Fixed points that Picard's iteration misses, and the simulation that rests on them against scipy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import robthermal as rt
from robthermal.thermal._mixing import mixed


@pytest.mark.parametrize("radius", [0.5, 0.99, 3.0])
def test_linear_maps_are_solved_in_as_many_steps_as_they_have_dimensions(radius: float) -> None:
    rng = np.random.default_rng(3)
    A = rng.standard_normal((5, 5))
    A *= radius / np.abs(np.linalg.eigvals(A)).max()
    b = rng.standard_normal(5)
    points, changes = [np.zeros(5)], [b]
    points.append(b)
    for _ in range(6):
        changes.append(A @ points[-1] + b - points[-1])
        points.append(mixed(points, changes))
    np.testing.assert_allclose(points[-1], np.linalg.solve(np.eye(5) - A, b), rtol=1e-7)


@pytest.mark.parametrize("relative", [-0.95, 4.0, 20.0])
def test_large_steps_of_a_conductance(relative: float) -> None:
    """A stiff link that changes by a multiple of itself: the heat of the change is many times what flows before."""
    system = rt.System(
        ambients={"room": {"temperature": 295.0}}, lumps={"a": {"capacity": 20.0}, "b": {"capacity": 5.0}},
        links=[{"between": ("a", "b"), "conductance": 3.0, "step": {"relative": relative, "time": 151.0}},
               {"between": ("b", "room"), "conductance": 1.0}],
        inputs={"heater": {"lump": "a"}}, sensors={"Ta": {"lump": "a"}, "Tb": {"lump": "b"}})
    heater = np.repeat([4.0, 0.0, 8.0, 2.0], 32)
    drive = rt.Record(sample_time=3.0, inputs=heater, outputs=np.zeros((128, 0)), input_names=["heater"],
                      output_names=[])
    mine = rt.thermal.simulate(system, drive, tolerance=1e-6).outputs

    def rate(t: float, T: np.ndarray, q: float, G: float) -> list[float]:
        return [(q - G * (T[0] - T[1])) / 20.0, (G * (T[0] - T[1]) - (T[1] - 295.0)) / 5.0]

    T, theirs = np.array([295.0, 295.0]), []
    for k, q in enumerate(heater):
        theirs.append(T)
        edges = [3.0 * k, 151.0, 3.0 * k + 3.0] if 3.0 * k < 151.0 < 3.0 * k + 3.0 else [3.0 * k, 3.0 * k + 3.0]
        for begin, end in zip(edges, edges[1:], strict=False):
            G = 3.0 * (1.0 + relative * (begin >= 151.0))
            T = solve_ivp(rate, (begin, end), T, method="LSODA", args=(q, G), rtol=1e-10, atol=1e-10).y[:, -1]
    np.testing.assert_allclose(mine, theirs, rtol=0.0, atol=2e-5)
