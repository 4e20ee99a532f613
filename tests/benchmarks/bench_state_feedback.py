"""State feedback over hulls: published and known numbers, times of design and of both checkers."""

from __future__ import annotations

import json
import time

import control
import numpy as np
from _timing import header

import recheck
import robthermal as rt

GEVP = ([[-1, 2], [1, -3]], [[-0.8, 1.5], [1.3, -2.7]], [[-1.4, 0.9], [0.7, -2]])
BOX = {"temperature": (265.0, 335.0)}


def stage() -> rt.System:
    """Plate, module and sink."""
    return rt.System(
        ambients={"room": {"temperature": 298.0}},
        lumps={"plate": {"capacity": 60.0}, "module": {"capacity": 12.0}, "sink": {"capacity": 90.0}},
        links=[{"between": ("plate", "module"), "conductance": 5.0}, {"between": ("sink", "room"), "conductance": 4.0},
               {"between": ("plate", "room"), "conductance": 0.15}],
        modules={"m": {"hot": "sink", "cold": "module", "seebeck": {"value": 0.052}, "resistance": {"value": 2.1},
                       "conductance": {"value": 0.5}, "reference_temperature": 298.0}})


def checked(d: rt.design.FeedbackDesign) -> str:
    """Times of both checkers [s], and what they say."""
    certificate = d.certificates[0]
    document = json.loads(json.dumps({key: getattr(certificate, key) for key in (
        "format", "kind", "claim", "system", "region", "evidence", "margin", "made_by")}))
    start = time.perf_counter()
    first = rt.verify(certificate).valid
    middle = time.perf_counter()
    second = recheck.check(document).status
    return f"first checker {first}, {middle - start:.2f} s; second {second}, {time.perf_counter() - middle:.2f} s"


def common_decay() -> float:
    """Largest certified rate of three matrices without input, by bisection to 1e-6 1/s."""
    plants, low, high = [control.ss(A, [[0], [0]], [[1, 0]], 0) for A in GEVP], 0.05, 0.07
    while high - low > 1e-6:
        middle = (low + high) / 2
        low, high = (middle, high) if rt.design.polytopic_feedback(plants, 1, rate=middle).holds else (low, middle)
    return low


def main() -> None:
    header("State feedback over hulls")
    print(f"common decay of three matrices: certified -2 rate = {-2 * common_decay():.5f} (MathWorks gevp: -0.12213)")
    rng = np.random.default_rng(0)
    for n, count in ((4, 8), (8, 16), (12, 32)):
        A, B = rng.standard_normal((n, n)), rng.standard_normal((n, 2))
        plants = [control.ss(A + 0.05 * rng.standard_normal((n, n)), B, np.eye(n), 0) for _ in range(count)]
        d = rt.design.polytopic_feedback(plants, 2, rate=0.1)
        print(f"{n} states, {count} vertices: {d.holds}, {d.solve_time:.2f} s" + (f"; {checked(d)}" if d.holds else ""))
    d = rt.design.tem_feedback(stage(), **BOX, current=(0.2, 1.8), operating=1.0, rate=0.012)
    print(f"plate, module and sink: smallest semi-axis {d.semi_axes[0]:.2f} K, {d.solve_time:.2f} s; {checked(d)}")
    d = rt.design.tem_feedback(rt.systems.two_module(), **BOX, current=(0.0, 1.4), operating=0.7, rate=0.001)
    print(f"two modules, 0 to 1.4 A: smallest semi-axis {d.semi_axes[0]:.2f} K, {d.solve_time:.2f} s; {checked(d)}")


if __name__ == "__main__":
    main()
