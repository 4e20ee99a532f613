"""Certificates of linear systems that just hold; falsifiers: eigenvalues, dense frequency grids, impulse responses."""

from __future__ import annotations

import certificate_truth as truth
import numpy as np
from mutants import Document, Subject, holds
from scipy.linalg import (
    expm,
    solve_continuous_are,
    solve_continuous_lyapunov,
    solve_discrete_are,
    solve_discrete_lyapunov,
)

_numbers = np.vectorize(truth.number, otypes=[float])


def matrices(system: Document) -> tuple[np.ndarray, ...]:
    """Return A, B, C, D in floats."""
    n, p, m = len(system["A"]), len(system["D"]), len(system["D"][0])
    shapes = {"A": (n, n), "B": (n, m), "C": (p, n), "D": (p, m)}
    return tuple(_numbers(np.array(system[key], dtype=object).reshape(shape)).astype(float) if np.prod(shape) else
                 np.zeros(shape) for key, shape in shapes.items())


def random_linear(rng: np.random.Generator, *, positive: bool = False, single: bool = False) -> Document:
    """Return a stable random system, continuous or sampled, sometimes lightly damped."""
    n, dt = int(rng.integers(1, 6)), float(rng.choice([0.0, 0.2]))
    m, p = (1, 1) if single else (int(rng.integers(1, 3)), int(rng.integers(1, 3)))
    A = rng.standard_normal((n, n))
    if positive:
        A = np.abs(A)
    spare = 10 ** float(rng.uniform(-2, -0.3))
    modes = np.linalg.eigvals(A)
    A = (1 - spare) * A / np.abs(modes).max() if dt else A - (modes.real.max() + spare) * np.eye(n)
    B, C, D = (rng.standard_normal(shape) for shape in ((n, m), (p, n), (p, m)))
    if positive:
        B, C, D = np.abs(B), np.abs(C), np.abs(D)
    if rng.random() < 0.3:
        D = 0 * D
    return {key: np.round(value, 4).tolist() for key, value in zip("ABCD", (A, B, C, D), strict=True)} | {
        "sample_time": dt}


def spare_decay(system: Document, rate: float = 0.0) -> float:
    """Return how far the slowest mode is beyond the rate, relative: above 0 it is false."""
    A, dt = matrices(system)[0], truth.number(system["sample_time"])
    if not len(A):
        return -1.0
    modes = np.linalg.eigvals(A)
    size = 1 + np.linalg.norm(A, 2)
    return float((np.abs(modes).max() - (1 - rate) if dt > 0 else modes.real.max() + rate) / size)


def grid(system: Document, count: int = 400) -> np.ndarray:
    """Return frequencies from 0 to the end, dense near the modes [rad/s]."""
    A, dt = matrices(system)[0], truth.number(system["sample_time"])
    modes = np.linalg.eigvals(A) if len(A) else np.array([1.0])
    if dt > 0:
        modes = np.log(np.where(np.abs(modes) > 1e-12, modes, 0.5).astype(complex)) / dt
    near = [abs(mode.imag) + (abs(mode.real) + 1e-9) * np.linspace(-3, 3, 61) for mode in modes]
    wide = np.geomspace(1e-4, 1e4, count) * float(np.median(np.abs(modes)) + 1e-9)
    found = np.unique(np.clip(np.concatenate([[0.0], wide, *near]), 0.0, np.pi / dt if dt > 0 else np.inf))
    return found


def responses(system: Document, omega: np.ndarray) -> np.ndarray:
    """Return M at many frequencies, frequency first."""
    A, B, C, D = matrices(system)
    dt = truth.number(system["sample_time"])
    z = np.exp(1j * omega * dt) if dt > 0 else 1j * omega
    if not len(A):
        return np.broadcast_to(D.astype(complex), (len(omega), *D.shape))
    return C @ np.linalg.solve(z[:, None, None] * np.eye(len(A)) - A, np.broadcast_to(B, (len(omega), *B.shape))) + D


def _complex(rows: list) -> np.ndarray:
    return np.array([[complex(*map(truth.number, item)) if isinstance(item, list) else truth.number(item)
                      for item in row] for row in rows], dtype=complex)


# stability


def make_stability(rng: np.random.Generator) -> Document:
    system = random_linear(rng)
    A, dt = matrices(system)[0], system["sample_time"]
    modes, n = np.linalg.eigvals(A), len(A)
    rate = float((1 - np.abs(modes).max() if dt else -modes.real.max()) * rng.choice([0.0, 0.9, 0.999]))
    evidence: Document = {"method": "polynomial"}
    if rng.random() < 0.5:
        P = (solve_discrete_lyapunov(A.T / (1 - rate), np.eye(n)) if dt else
             solve_continuous_lyapunov((A + rate * np.eye(n)).T, -np.eye(n)))
        evidence = {"method": "lyapunov", "matrix": np.round((P + P.T) / 2, 8).tolist()}
    document = {"system": system, "region": {"rate": rate}, "evidence": evidence}
    return document if holds("stability", document) else make_stability(rng)


def break_stability(document: Document, rng: np.random.Generator) -> float:
    return spare_decay(document["system"], truth.number(document["region"].get("rate", 0)))


# hinf


def norm_of(system: Document, left: np.ndarray | float = 1.0, right: np.ndarray | float = 1.0) -> float:
    return float(np.linalg.norm(_scaled(responses(system, grid(system)), left, right), 2, axis=(1, 2)).max())


def _scaled(M: np.ndarray, left: np.ndarray | float, right: np.ndarray | float) -> np.ndarray:
    M = M if np.isscalar(left) else left @ M
    return M if np.isscalar(right) else M @ np.linalg.inv(right)


def make_hinf(rng: np.random.Generator) -> Document:
    system = random_linear(rng)
    A, B, C, D = matrices(system)
    (p, m), scalings = D.shape, {}
    if rng.random() < 0.3:
        scalings = {"left": np.diag(rng.uniform(0.5, 1, p).round(3)), "right": np.diag(rng.uniform(1, 2, m).round(3))}
        B, C, D = B / np.diag(scalings["right"]), scalings["left"] @ C, _scaled(D, *scalings.values())
    bound = (norm_of(system, *scalings.values()) + 1e-3) * (1 + 10 ** float(rng.uniform(-2.5, -1)))
    evidence: Document = {"method": "polynomial"}
    if rng.random() < 0.6:
        solve = solve_discrete_are if system["sample_time"] else solve_continuous_are
        level = bound * (1 - 1e-4)
        try:
            P = solve(A, B, C.T @ C + 1e-6 * np.eye(len(A)), D.T @ D - level**2 * np.eye(m), s=C.T @ D)
            evidence = {"method": "bounded_real", "matrix": np.round((P + P.T) / 2, 9).tolist()}
        except (np.linalg.LinAlgError, ValueError):
            pass
    region = {"bound": bound, **{key: scaling.tolist() for key, scaling in scalings.items()}}
    document = {"system": system, "region": region, "evidence": evidence}
    return document if holds("hinf", document) else make_hinf(rng)


def break_hinf(document: Document, rng: np.random.Generator) -> float:
    region, system = document["region"], document["system"]
    left, right = (_complex(region[key]) if key in region else 1.0 for key in ("left", "right"))
    return max(spare_decay(system), norm_of(system, left, right) / truth.number(region["bound"]) - 1)


# frequency


def make_frequency(rng: np.random.Generator) -> Document:
    system = random_linear(rng)
    D, dt = matrices(system)[3], system["sample_time"]
    p, m = D.shape
    edges = np.unique(np.round(rng.uniform(0.05, 0.9 * np.pi / dt if dt else 5.0, int(rng.integers(0, 4))), 3))
    region: Document = {"edges": edges.tolist()}
    count = len(edges) + 1
    if rng.random() < 0.4:
        envelopes = [np.round(rng.uniform(0, 1, (m, p)), 3) for _ in range(count)]
        region |= {"form": "radius", "envelopes": [R.tolist() for R in envelopes], "bound": 1.0}
        region["bound"] = max(_largest(system, region)) * 1.02 + 1e-3
    else:
        region |= {"form": "norm", "bounds": [1.0] * count}
        if rng.random() < 0.6:
            scale = [np.round(rng.uniform(0.5, 2, 1) * np.exp(1j * rng.uniform(0, 6, 1)), 3)[0] for _ in range(count)]
            for key, size in (("left", p), ("right", m)):
                region[key] = [[[[s.real, s.imag] if i == j else 0.0 for j in range(size)] for i in range(size)]
                               for s in scale]
            region["blocks"] = [["full", m, p]]
            if p == m == 2:
                region |= _two_blocks(count, rng)
        region["bounds"] = [1.02 * value + 1e-3 for value in _largest(system, region)]
    document = {"system": system, "region": region, "evidence": {}}
    return document if holds("frequency", document) else make_frequency(rng)


def _two_blocks(count: int, rng: np.random.Generator) -> Document:
    """Return two scalar blocks with diagonal scalings, or a repeated scalar with full complex ones, L = R."""
    entries = np.round(rng.standard_normal((count, 2, 2, 2)) + 2 * np.eye(2)[:, :, None], 3)
    blocks: list = [["repeated", 2]]
    if rng.random() < 0.5:
        entries, blocks = entries * np.eye(2)[:, :, None], [["full", 1, 1], ["full", 1, 1]]
    return {"left": entries.tolist(), "right": entries.tolist(), "blocks": blocks}


def _largest(system: Document, region: Document) -> list[float]:
    """Return the largest value of every interval on a grid that contains its ends."""
    edges = [0.0, *(truth.number(edge) for edge in region["edges"]), np.inf]
    w, found = grid(system), []
    for k, (a, b) in enumerate(zip(edges[:-1], edges[1:], strict=True)):
        M = responses(system, np.array([*w[(w > a) & (w < b)], a, min(b, max(a, w[-1]))]))
        if region["form"] == "radius":
            R = _numbers(np.array(region["envelopes"][k], dtype=object))
            found.append(float(np.abs(np.linalg.eigvals(np.abs(M) @ R)).max()))
        else:
            left, right = (_complex(region[key][k]) if region.get(key) else 1.0 for key in ("left", "right"))
            found.append(float(np.linalg.norm(_scaled(M, left, right), 2, axis=(1, 2)).max()))
    return found


def break_frequency(document: Document, rng: np.random.Generator) -> float:
    """Grid of the bounds; with blocks also: L and R must commute with a random Delta of the structure."""
    system, region = document["system"], document["region"]
    bounds = region["bounds"] if region["form"] == "norm" else [region["bound"]] * (len(region["edges"]) + 1)
    worst = max(spare_decay(system), *(value / truth.number(bound) - 1 for value, bound in
                                       zip(_largest(system, region), bounds, strict=True)))
    if region.get("blocks") and (region.get("left") or region.get("right")):
        p, m = matrices(system)[3].shape
        Delta = np.zeros((m, p), complex)
        row = column = 0
        for block in region["blocks"]:
            a, b = (int(truth.number(value)) for value in (block[1:] if block[0] == "full" else block[1:] * 2))
            part = rng.standard_normal((a, b)) + 1j * rng.standard_normal((a, b))
            Delta[row:row + a, column:column + b] = part if block[0] == "full" else part[0, 0] * np.eye(a)
            row, column = row + a, column + b
        for k in range(len(region["bounds"])):
            L, R = (_complex(region[key][k]) if region.get(key) else np.eye(size)
                    for key, size in (("left", p), ("right", m)))
            worst = max(worst, float(np.abs(R @ Delta - Delta @ L).max()) - 1e-9)
    return worst


# peak


def make_peak(rng: np.random.Generator) -> Document:
    if rng.random() < 0.4:
        system = random_linear(rng, positive=True, single=True)
        A, B, C, D = matrices(system)
        steady = np.eye(len(A)) - A if system["sample_time"] else -A
        gain = float((D + C @ np.linalg.solve(steady, B))[0, 0])
        document = {"system": system, "region": {"bound": gain * (1 + 1e-9) + 1e-12},
                    "evidence": {"method": "positive"}}
        return document if holds("peak", document) else make_peak(rng)
    system = random_linear(rng)
    A, B, C, D = matrices(system)
    n, sampled, modes = len(A), system["sample_time"] > 0, np.linalg.eigvals(A)
    free = 1 - np.abs(modes).max() ** 2 if sampled else -2 * modes.real.max()
    decay, share = float(free * rng.uniform(0.2, 0.8)), float(rng.uniform(0.3, 0.95)) if D.any() else 0.999
    drive = B @ B.T + 1e-6 * np.eye(n)
    Q = (solve_discrete_lyapunov(A / np.sqrt(1 - decay), drive) if sampled else
         solve_continuous_lyapunov(A + decay / 2 * np.eye(n), -drive))
    Q = np.round((Q + Q.T) / 2, 9)
    bound = float(np.sqrt(np.linalg.eigvalsh(C @ Q @ C.T / (decay * share) + D @ D.T / (1 - share))[-1])) * 1.0001
    document = {"system": system, "region": {"bound": bound + 1e-9}, "evidence": {
        "method": "ellipsoid", "matrix": Q.tolist(), "decay": decay, "share": share}}
    return document if holds("peak", document) else make_peak(rng)


def peak_from_below(system: Document) -> float:
    """Return a lower bound of the peak gain: the integral of the impulse response in some directions of the output."""
    A, B, C, D = matrices(system)
    dt, n = truth.number(system["sample_time"]), len(A)
    if not n:
        return float(np.linalg.norm(D, 2))
    modes = np.linalg.eigvals(A)
    slow = -np.log(max(np.abs(modes).max(), 1e-3)) if dt > 0 else -modes.real.max()
    step = 1.0 if dt > 0 else 0.2 / (1 + np.abs(modes).max())
    count = int(min(20_000, 12 / (slow * step) + 50))
    moved = A if dt > 0 else expm(A * step)
    x, pieces = B if dt > 0 else None, []
    if dt == 0:  # heat of one step of constant input, exactly: a zero-order hold is an admissible input
        both = expm(np.block([[A, B], [np.zeros((B.shape[1], n + B.shape[1]))]]) * step)
        x = both[:n, n:]
    for _ in range(count):
        pieces.append(C @ x)
        x = moved @ x
    best = 0.0
    for direction in (*np.eye(len(C)), np.ones(len(C)) / np.sqrt(len(C)), [1, -1] / np.sqrt(2) if len(C) == 2 else [1]):
        total = sum(float(np.linalg.norm(np.asarray(direction) @ piece)) for piece in pieces)
        best = max(best, total + float(np.linalg.norm(np.asarray(direction) @ D)))
    return best


def break_peak(document: Document, rng: np.random.Generator) -> float:
    loss = spare_decay(document["system"])
    return loss if loss > 0 else max(loss, peak_from_below(document["system"]) / truth.number(
        document["region"]["bound"]) - 1)


# closed_loop


def close(system: Document) -> Document:
    """Return the loop in floats by another way than the checker's: u is solved for together with the states."""
    P, K = matrices(system["plant"]), matrices(system["controller"])
    n_u, n_y = (int(truth.number(system[key])) for key in ("n_ctrl", "n_meas"))
    n, k, m, p = len(P[0]), len(K[0]), P[3].shape[1] - n_u, P[3].shape[0] - n_y
    known = np.block([[P[0], np.zeros((n, k)), P[1][:, :m]], [P[2][p:], np.zeros((n_y, k)), P[3][p:, :m]]])
    # unknown: u and y of u = K_C x_K + K_D y, y = C2 x + D21 w + D22 u
    left = np.block([[np.eye(n_u), -K[3]], [-P[3][p:, m:], np.eye(n_y)]])
    right = np.block([[np.zeros((n_u, n)), K[2], np.zeros((n_u, m))], [known[n:]]])
    u, y = np.split(np.linalg.solve(left, right), [n_u])
    A = np.vstack([known[:n] + P[1][:, m:] @ u, K[1] @ y + np.hstack([np.zeros((k, n)), K[0], np.zeros((k, m))])])
    C = np.hstack([P[2][:p], np.zeros((p, k)), P[3][:p, :m]]) + P[3][:p, m:] @ u
    return {"A": A[:, :n + k].tolist(), "B": A[:, n + k:].tolist(), "C": C[:, :n + k].tolist(),
            "D": C[:, n + k:].tolist(), "sample_time": system["sample_time"]}


def make_closed_loop(rng: np.random.Generator) -> Document:
    n, k, dt = int(rng.integers(1, 4)), int(rng.integers(0, 3)), float(rng.choice([0.0, 0.2]))
    n_u, n_y, m, p = (int(rng.integers(1, 3)) for _ in range(4))
    plant, controller = (
        {key: np.round(size * rng.standard_normal(shape), 3).tolist()
         for key, shape in zip("ABCD", shapes, strict=True)}
        for size, shapes in ((1.0, ((n, n), (n, m + n_u), (p + n_y, n), (p + n_y, m + n_u))),
                             (0.3, ((k, k), (k, n_y), (n_u, k), (n_u, n_y)))))
    system = {"plant": plant, "controller": controller, "n_meas": n_y, "n_ctrl": n_u, "sample_time": dt}
    loop = close(system)
    modes = np.linalg.eigvals(np.array(loop["A"]))
    spare = 0.05 + 0.5 * rng.random()
    if dt:  # u = K y is the same loop when A, B of both are scaled alike
        factor = (1 - spare) / max(np.abs(modes).max(), 1e-3)
        for part in (plant, controller):
            part.update({key: np.round(factor * np.array(part[key]), 6).tolist() for key in "AB"})
    else:
        for part in (plant, controller):
            part["A"] = np.round(np.array(part["A"]) - (modes.real.max() + spare) * np.eye(len(part["A"])), 6).tolist()
    loop = close(system)
    if spare_decay(loop) >= 0:
        return make_closed_loop(rng)
    A, B, C, D = matrices(loop)
    region: Document = {"measure": "hinf", "bound": norm_of(loop) * (1 + 10 ** float(rng.uniform(-2.5, -1)))}
    evidence: Document = {"method": "polynomial"}
    if rng.random() < 0.3:
        region = {"measure": "stability", "rate": 0.9 * (spare if not dt else 1 - np.abs(np.linalg.eigvals(A)).max())}
    elif rng.random() < 0.4 and (dt or n_u + n_y > 2):  # continuous: D must be zero
        if not dt:
            plant["D"] = np.zeros((p + n_y, m + n_u)).tolist()
            A, B, C, D = matrices(close(system))
            if spare_decay(close(system)) >= 0:
                return make_closed_loop(rng)
        P = gramian(A, C, dt > 0)
        region = {"measure": "h2", "bound": float(np.sqrt(np.trace(B.T @ P @ B) + np.sum(D**2))) * 1.001}
        evidence = {"method": "lyapunov", "matrix": np.round(P + 1e-6 * gramian(A, np.eye(n + k), dt > 0), 9).tolist()}
    document = {"system": system, "region": region, "evidence": evidence}
    return document if holds("closed_loop", document) else make_closed_loop(rng)


def gramian(A: np.ndarray, C: np.ndarray, sampled: bool) -> np.ndarray:
    """Return P with A'P + PA + C'C = 0, or A'PA - P + C'C = 0, by Kronecker products."""
    n = len(A)
    K = np.kron(A.T, A.T) - np.eye(n * n) if sampled else np.kron(A.T, np.eye(n)) + np.kron(np.eye(n), A.T)
    P = np.linalg.solve(K, -(C.T @ C).ravel()).reshape(n, n)
    return (P + P.T) / 2


def break_closed_loop(document: Document, rng: np.random.Generator) -> float:
    region, loop = document["region"], close(document["system"])
    if region["measure"] == "stability":
        return spare_decay(loop, truth.number(region.get("rate", 0)))
    loss, bound = spare_decay(loop), truth.number(region["bound"])
    if loss > 0 or region["measure"] == "hinf":
        return max(loss, norm_of(loop) / bound - 1)
    A, B, C, D = matrices(loop)
    P = gramian(A, C, truth.number(loop["sample_time"]) > 0)
    return float(np.sqrt(max(np.trace(B.T @ P @ B) + np.sum(D**2), 0.0))) / bound - 1


SUBJECTS = (Subject("stability", make_stability, break_stability, tolerance=1e-7),
            Subject("hinf", make_hinf, break_hinf, tolerance=1e-7),
            Subject("peak", make_peak, break_peak, tolerance=1e-7),
            Subject("frequency", make_frequency, break_frequency, tolerance=1e-7),
            Subject("closed_loop", make_closed_loop, break_closed_loop, tolerance=1e-7))
