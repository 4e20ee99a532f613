"""Frequency responses: bins per second against the flop bound of sliding moments, threads, coverage, a long record.

Run as a script; `--large` adds the record of ten million samples, `--runs n` sets the Monte Carlo size.
The bound is what the moments of every window, the removal of the transient and the elimination of the regressors would
take at the speed of dgemm: 1 556 (SISO) and 4 846 (2x2) real flop per bin.
"""

from __future__ import annotations

import argparse
import os
import resource
import time
from collections.abc import Callable, Sequence

os.environ.setdefault("OMP_NUM_THREADS", "1")  # one core for dgemm and for the estimate alike

import numpy as np  # noqa: E402  (after the thread count is set)
from _timing import best_of, header, row  # noqa: E402
from scipy.linalg import expm  # noqa: E402

import robthermal as rt  # noqa: E402
from robthermal.identify import _compiled  # noqa: E402

BUILT = _compiled.library()
N, HALF_WIDTH, DEGREE = 172_800, 8, 2
POLES = [-1e-4, -1e-3, -1e-2]


def white_record(n: int, n_u: int, n_y: int) -> rt.Record:
    rng = np.random.default_rng(0)
    names = [[f"{kind}{i}" for i in range(count)] for kind, count in (("u", n_u), ("y", n_y))]
    return rt.Record(
        sample_time=1.0,
        inputs=rng.normal(size=(n, n_u)),
        outputs=rng.normal(size=(n, n_y)),
        input_names=names[0],
        output_names=names[1],
    )


def cpu_seconds(run: Callable[[], object], repeats: int = 5) -> float:
    """Shortest processor time [s]: what the code costs, whoever else uses the machine."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        run()
        times.append(time.process_time() - start)
    return min(times)


def dgemm_rate(size: int = 1500) -> float:
    """Floating-point operations per second of one core."""
    a = np.random.default_rng(0).normal(size=(size, size))
    return 2.0 * size**3 / cpu_seconds(lambda: a @ a)


def moment_flops(n_u: int, n_y: int) -> float:
    """Real flop per bin: window sums, what the transient explains, Cholesky steps; 8 for a complex multiply and add."""
    m, p = 2 * HALF_WIDTH + 1, DEGREE + 1
    n, n_k = n_u * p + n_y, n_u * p
    sums = n_u**2 * (2 * p - 1) + 2 * n_u * n_y * p + n_y**2 + 2 * n_u * p**2 + 2 * n_y * p  # real ones
    upper = [sum(range(n - c, 0, -1)) for c in range(n_k + 1)]  # entries of the triangle from row c on
    eliminated = sum(2 * (n - c - 1) + 8 * upper[c + 1] for c in range(n_k))
    return 2.0 * m * sums + 8.0 * p * upper[0] + eliminated


def set_cores(cores: set[int]) -> None:
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, cores)


def alternately(run: Callable[[], object], choices: Sequence[set[int]], repeats: int) -> list[float]:
    """Shortest wall time [s] on each set of cores, taken in turn: a machine that is slow for a while is so for all."""
    times: list[list[float]] = [[] for _ in choices]
    for _ in range(repeats):
        for of_these, cores in zip(times, choices, strict=True):
            set_cores(cores)
            of_these.append(best_of(run, repeats=1)[0])
    return [min(of_these) for of_these in times]


def speed() -> None:
    cores = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else set(range(os.cpu_count() or 1))
    set_cores({min(cores)})
    rate, bins = dgemm_rate(), (N - 1) // 2
    header(f"Local methods, {N} samples, half_width {HALF_WIDTH}, one core, dgemm {rate / 1e9:.1f} GFlop/s")
    for n in (1, 2):
        record = white_record(N, n, n)
        for name, run in (
            (f"lpm {n}x{n}, degree {DEGREE}, covariance", lambda r=record: rt.identify.lpm(r).covariance),
            (f"lrmp {n}x{n}, three poles, covariance", lambda r=record: rt.identify.lrmp(r, POLES).covariance),
        ):
            for kernel, library in (("numpy", None), *([("compiled", BUILT)] if BUILT else [])):
                _compiled.library = lambda library=library: library  # what the package asks which kernel to take
                seconds = cpu_seconds(run)
                part = bins / seconds * moment_flops(n, n) / rate
                share = f"{part:.1%} of the bound" if name.startswith("lpm") else ""
                row(f"{name}, {kernel}", seconds, f"{bins / seconds / 1e6:.2f} M bins/cpu-s  {share}")
    if BUILT is None:
        print("The compiled kernel is not there: numpy alone (docs/contributing.md, the kernel in C).")
    for n, repeats in ((N, 30), (1_000_000, 8)):
        record = white_record(n, 2, 2)
        one, two = alternately(lambda r=record: rt.identify.lpm(r), ({min(cores)}, cores), repeats)
        row(f"lpm 2x2, {n} samples, {len(cores)} core(s), wall", two, f"{one / two:.2f} times one core")


def network(n: int) -> tuple[np.ndarray, ...]:
    """Three lumps, n heaters and sensors, time constants 550, 25 and 4 s, exact zero-order hold at 1 s."""
    flow = np.array([[-2.3, 2.0, 0.0], [2.0, -5.0, 3.0], [0.0, 3.0, -3.2]]) / np.array([[200.0], [50.0], [20.0]])
    B = np.array([[1 / 200, 0.0], [0.0, 0.0], [0.0, 1 / 20]])[:, :n]
    block = np.zeros((3 + n, 3 + n))
    block[:3, :3], block[:3, 3:] = flow, B
    step = expm(block)
    return step[:3, :3], step[:3, 3:], np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])[:n], np.linalg.eigvals(flow).real


def monte_carlo(runs: int) -> None:
    header(f"Coverage of the 95 % circle and noise ratio, {runs} runs of 4000 samples from a cold start, 10 mK noise")
    for n in (1, 2):
        A, B, C, poles = network(n)
        rng, found, low = np.random.default_rng(1), {}, {}
        for _ in range(runs):
            U, x = 10.0 + rng.normal(size=(4000, n)), np.zeros(3)
            Y = 0.01 * rng.normal(size=(4000, n)) + 298.0
            for k, u in enumerate(U):
                Y[k] += C @ x
                x = A @ x + B @ u
            names = [f"u{i}" for i in range(n)], [f"y{i}" for i in range(n)]
            record = rt.Record(sample_time=1.0, inputs=U, outputs=Y, input_names=names[0], output_names=names[1])
            for name, G in (
                ("lpm", rt.identify.lpm(record)),
                ("lrmp, exact poles", rt.identify.lrmp(record, poles)),
                ("lrmp, poles 30 % slow", rt.identify.lrmp(record, 0.7 * poles)),
            ):
                z = np.exp(2j * np.pi * G.frequencies)
                truth = np.moveaxis(C @ np.linalg.inv(z[:, None, None] * np.eye(3) - A) @ B, 0, -1)
                error = np.abs(G.response - truth)
                inside = (error < G.confidence_radius(0.95))[..., 100:].mean()
                found.setdefault(name, []).append((inside, G.noise_variance[:, 100:].mean() / 1e-4))
                low.setdefault(name, []).append(np.mean((error / np.abs(truth))[..., :12] ** 2))
        for name, values in found.items():
            coverage, ratio = np.mean(values, axis=0)
            rms = np.sqrt(np.mean(low[name]))
            print(f"{n}x{n} {name:<22} coverage {coverage:.4f}  noise ratio {ratio:.4f}  rms of bins 1-12 {rms:.3g}")


def long_record() -> None:
    header("Ten million samples, one input, eight outputs")
    record = white_record(10_000_000, 1, 8)
    seconds, G = best_of(lambda: rt.identify.lpm(record), repeats=1)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    row("lpm 8x1, with variances", seconds, f"{len(G) / seconds / 1e6:.2f} M bins/s, peak memory {peak:.2f} GiB")
    seconds, _ = best_of(lambda: G.between(0.1, 0.101).covariance, repeats=1)
    row("full covariance of 10 000 of its bins", seconds)


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--large", action="store_true")
    arguments.add_argument("--runs", type=int, default=50)
    options = arguments.parse_args()
    speed()
    monte_carlo(options.runs)
    if options.large:
        long_record()
