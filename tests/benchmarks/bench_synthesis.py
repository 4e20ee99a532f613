"""H-infinity and H2 synthesis over the COMPleib models: proven value over optimum, and time against control.hinfsyn.

The models lie beside the project (../shared/data/compleib). Odd ones were looked at while the method was written, even
ones were not. control.hinfsyn needs slycot; it runs in a process of its own, because it does not always end.
"""

from __future__ import annotations

import json
import multiprocessing
import time
from pathlib import Path
from typing import Any

import control
import numpy as np
from _timing import header

import robthermal as rt
from robthermal.linear import close, plant_norm, read_plant

try:
    import slycot
except ImportError:
    slycot = None

FOLDER = Path(__file__).resolve().parents[3] / "shared" / "data" / "compleib"
LONGEST = 30.0  # seconds that hinfsyn may take


def model(data: Any, name: str, eps: float, full: bool) -> tuple[control.StateSpace, int, int]:
    """Model with channels of its own: z gets eps u (full: eps x), w gets eps times noise on y (full: on x')."""
    A, B1, B, C1, C, D11, D12, D21 = (data[f"{name}.{key}"].astype(float)
                                      for key in ("A", "B1", "B", "C1", "C", "D11", "D12", "D21"))
    n, m, p = len(A), B.shape[1], len(C)
    more = n if full else 0
    B1 = np.hstack([B1, np.zeros((n, p)), eps * np.eye(n)[:, :more]])
    C1 = np.vstack([C1, np.zeros((m, n)), eps * np.eye(n)[:more]])
    D = np.block([[np.pad(D11, ((0, m + more), (0, p + more))),
                   np.vstack([D12, eps * np.eye(m), np.zeros((more, m))])],
                  [np.hstack([D21, eps * np.eye(p), np.zeros((p, more))]), np.zeros((p, m))]])
    return control.ss(A, np.hstack([B1, B]), np.vstack([C1, C]), D), p, m


def peer(P: control.StateSpace, n_meas: int, n_ctrl: int, found: Any) -> None:
    """What hinfsyn reports, what its loop attains, and its time [s]."""
    start = time.perf_counter()
    K, _, level, _ = control.hinfsyn(P, n_meas, n_ctrl)
    seconds = time.perf_counter() - start
    loop = close(read_plant(P), read_plant(K))
    found.put((float(level), plant_norm(loop)[0] if loop.stable else np.inf, seconds))


def against(P: control.StateSpace, n_meas: int, n_ctrl: int) -> tuple[float, float, float] | None:
    """The same in a process that ends after a while; None where it does."""
    queue: Any = multiprocessing.Queue()
    process = multiprocessing.Process(target=peer, args=(P, n_meas, n_ctrl, queue))
    process.start()
    process.join(LONGEST)
    if process.is_alive():
        process.kill()
        process.join()
        return None
    return queue.get() if process.exitcode == 0 else None


def heated_square(side: int) -> control.StateSpace:
    """Heat flow in a square of side² cells, one mode unstable as in COMPleib's HF2D: 2 heaters, 3 sensors, 2 loads."""
    n, at = side**2, np.arange(side**2).reshape(side, side)
    A = 0.05 * np.eye(n)
    for first, second in ((at[1:], at[:-1]), (at[:, 1:], at[:, :-1])):
        for i, j in zip(first.ravel(), second.ravel(), strict=True):
            A[[i, j], [i, j]] -= 0.01 * (side + 1) ** 2
            A[[i, j], [j, i]] += 0.01 * (side + 1) ** 2
    place = np.stack(np.meshgrid(*[np.arange(side) / (side - 1)] * 2, indexing="ij"))

    def patch(x: float, y: float, size: float) -> Any:
        return (np.abs(place - np.array([[[x]], [[y]]])).max(axis=0) <= size).astype(float).ravel()

    heaters = np.stack([patch(0.2, 0.3, 0.15), patch(0.75, 0.2, 0.15)], axis=1)
    sensors = np.stack([one / one.sum() for one in (patch(0.3, 0.3, 0.1), patch(0.7, 0.6, 0.1), patch(0.5, 0.9, 0.1))])
    loads = np.stack([patch(0.1, 0.9, 0.2), patch(0.9, 0.1, 0.2)], axis=1)
    seen = np.stack([patch(0.5, 0.5, 0.2), patch(0.2, 0.1, 0.1)]) / 10
    D = np.zeros((7, 7))
    D[2:4, 5:], D[4:, 2:5] = 0.1 * np.eye(2), 0.05 * np.eye(3)
    return control.ss(A, np.hstack([loads, np.zeros((n, 3)), heaters]), np.vstack([seen, np.zeros((2, n)), sensors]), D)


def main() -> None:
    """Print one line per model and the medians."""
    for side in (8, 16):
        header(f"H-infinity control of a heated square with {side**2} states")
        start, P = time.process_time(), heated_square(side)
        d = rt.design.hinf(P, 3, 2)
        print(f"value/optimum {d.value / d.lower:.5f}, certified {d.holds}, {time.process_time() - start:.1f} s of "
              f"processor time, {d.solve_time:.1f} s")
    header("Synthesis over the COMPleib models with channels of weight 1e-3")
    if not FOLDER.is_dir():
        print("no COMPleib models beside the project")
        return
    data, reference = np.load(FOLDER / "compleib.npz"), json.loads((FOLDER / "reference.json").read_text())
    names = [name for name in reference if "reg" in reference[name]]
    ratios, times, peers = [], [], []
    for k, name in enumerate(names):
        one = reference[name]
        P, n_meas, n_ctrl = model(data, name, one["eps"], one["full"])
        d = rt.design.hinf(P, n_meas, n_ctrl)
        h2 = rt.design.h2(P, n_meas, n_ctrl) if "h2" in one else None
        line = (f"{'odd' if k % 2 else 'even':4} {name:9} n {one['n']:2}  value/optimum {d.value / one['reg']:.5f} "
                f"({d.solver}, {d.solve_time:.2f} s)")
        if h2 is not None:
            line += f"  h2 {h2.value / one['h2']:.6f} ({h2.solve_time:.2f} s)"
        ratios.append(d.value / one["reg"])
        times.append(d.solve_time)
        if slycot is not None:
            other = against(P, n_meas, n_ctrl)
            line += "  hinfsyn: no answer" if other is None else (
                f"  hinfsyn: says {other[0] / one['reg']:.4f}, attains {other[1] / one['reg']:.4f}, {other[2]:.2f} s")
            if other is not None and abs(other[1] / one["reg"] - 1) < 0.01:
                peers.append(d.solve_time / other[2])
        print(line, flush=True)
    print(f"{len(names)} models: worst value/optimum {max(ratios):.5f}, median time {np.median(times):.3f} s")
    print("slycot is not installed: no comparison" if slycot is None else
          f"median time over that of hinfsyn, where that is right ({len(peers)} models): {np.median(peers):.2f}")


if __name__ == "__main__":
    main()
