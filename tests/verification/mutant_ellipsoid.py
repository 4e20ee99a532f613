"""Certificates of kind "ellipsoid" that just hold; falsifier: moments of the limited loop itself."""

from __future__ import annotations

from itertools import product
from typing import Any

import certificate_truth as truth
import numpy as np
from mutant_linear import gramian
from mutants import Document, Subject, holds

_DRAWN = 15


def _array(value: object) -> np.ndarray:
    return np.vectorize(truth.number, otypes=[float])(np.array(value, dtype=object)).astype(float)


class Machine:
    """Section "system" in floats: one plant of the hull, the controller, and what happens in one moment."""

    def __init__(self, system: Document, weights: np.ndarray):
        A, B = ([_array(one[key]) for one in system["vertices"]] for key in "AB")
        self.A, self.B = (sum(w * one for w, one in zip(weights, part, strict=True)) for part in (A, B))
        n = len(self.A)
        own = system.get("controller")
        self.k = len(own["D"]) if own else 0
        self.w = self.B.shape[1] - self.k
        seen = system.get("measured", {"C": np.eye(n), "D": np.zeros((n, self.w))})
        self.C, self.D = (_array(seen[key]).reshape(len(seen["C"]), columns) for key, columns in
                          (("C", n), ("D", self.w)))
        p, q = len(self.C), len(own["A"]) if own else 0
        shapes = {"A": (q, q), "B": (q, p), "C": (self.k, q), "D": (self.k, p), "windup": (q, self.k)}
        self.K = {key: _array(own[key]).reshape(shape) if own and key in own and np.prod(shape) else np.zeros(shape)
                  for key, shape in shapes.items()}
        self.F, self.direct = np.hstack([self.K["D"] @ self.C, self.K["C"]]), self.K["D"] @ self.D
        part, m = system.get("performance"), self.B.shape[1]
        self.Cz, self.Dz = ((_array(part["C"]), _array(part["D"])) if part else (np.zeros((0, n)), np.zeros((0, m))))

    def loop(self, U: np.ndarray, V: np.ndarray) -> tuple[np.ndarray, ...]:
        """A, B, C, D of the loop with u = U xi + V w."""
        n, q, into, K = len(self.A), len(self.K["A"]), self.B[:, self.w:], self.K
        A = np.block([[self.A, np.zeros((n, q))], [K["B"] @ self.C, K["A"]]])
        A += np.vstack([into @ U, K["windup"] @ (self.F - U)])
        B = np.vstack([self.B[:, :self.w] + into @ V, K["B"] @ self.D + K["windup"] @ (self.direct - V)])
        C = np.hstack([self.Cz, np.zeros((len(self.Cz), q))]) + self.Dz[:, self.w:] @ U
        return A, B, C, self.Dz[:, :self.w] + self.Dz[:, self.w:] @ V

    def moved(self, x: np.ndarray, w: np.ndarray, limits: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
        """x' (or x+) and z with the controls limited."""
        n, v = len(self.A), self.F @ x + self.direct @ w
        u = v if limits is None else np.clip(v, -limits, limits)
        y, both = self.C @ x[:n] + self.D @ w, np.concatenate([w, u])
        own = self.K["A"] @ x[n:] + self.K["B"] @ y + self.K["windup"] @ (v - u)
        return np.concatenate([self.A @ x[:n] + self.B @ both, own]), self.Cz @ x[:n] + self.Dz @ both


def make_ellipsoid(rng: np.random.Generator) -> Document:
    n, k, count, dt = int(rng.integers(1, 3)), int(rng.integers(0, 3)), int(rng.integers(1, 3)), float(
        rng.choice([0.0, 0.2]))
    way = str(rng.choice(["free", "free", "norm", "each", "energy"]))
    w, q, limited = (0 if way == "free" else int(rng.integers(1, 3))), int(rng.integers(0, 2)) * (k > 0), bool(
        k and rng.random() < 0.6)
    A, B = rng.standard_normal((n, n)), rng.standard_normal((n, w + k))
    modes = np.linalg.eigvals(A)
    A = 0.7 * A / max(np.abs(modes).max(), 0.1) if dt else A - (modes.real.max() + 0.8) * np.eye(n)
    system: Document = {"vertices": [{"A": np.round(A + 0.03 * rng.standard_normal((n, n)), 3).tolist(),
                                      "B": np.round(B + 0.03 * rng.standard_normal(B.shape), 3).tolist()}
                                     for _ in range(count)], "sample_time": dt}
    if k:
        p = int(rng.integers(1, 3)) if rng.random() < 0.7 else n
        if rng.random() < 0.7 or p != n:
            system["measured"] = {"C": np.round(rng.standard_normal((p, n)), 2).tolist(),
                                  "D": np.round(0.2 * rng.standard_normal((p, w)), 2).tolist()}
        shapes = {"A": (q, q), "B": (q, p), "C": (k, q), "D": (k, p)}
        system["controller"] = {key: np.round(0.2 * rng.standard_normal(shape) - (key == "A") * (0.0 if dt else 1.0), 2
                                              ).tolist() for key, shape in shapes.items()}
        if q and rng.random() < 0.7:
            system["controller"]["windup"] = np.round(0.2 * rng.standard_normal((q, k)), 2).tolist()
    if way == "energy":
        system["performance"] = {"C": np.round(rng.standard_normal((1, n)), 2).tolist(),
                                 "D": np.round(0.2 * rng.standard_normal((1, w + k)), 2).tolist()}
    machines = [Machine(system, row) for row in np.eye(count)]
    held = 0.5 * machines[0].F
    loops = [one.loop(*_law(one, held, way)) for one in machines
             for way in (product((0, 1), repeat=k) if limited else [(0,) * k])]
    P = gramian(sum(one[0] for one in loops) / len(loops), np.eye(n + q), dt > 0)
    if not np.linalg.eigvalsh(P)[0] > 0:
        return make_ellipsoid(rng)
    L = np.linalg.cholesky(np.linalg.inv(P))
    own = [np.linalg.solve(L, one[0] @ L) for one in loops]
    rate = 0.97 * min(1 - np.linalg.norm(one, 2) if dt else -np.linalg.eigvalsh(one + one.T)[-1] / 2 for one in own)
    if rate <= 1e-2:
        return make_ellipsoid(rng)
    document = _claimed(rng, system, way, limited, P, float(f"{rate:.3g}"), held, loops, machines)
    return document if document is not None and holds("ellipsoid", document) else make_ellipsoid(rng)


def _law(machine: Machine, held: np.ndarray, limited: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    chosen = np.array(limited, float).reshape(-1, 1)
    return (1 - chosen) * machine.F + chosen * held, (1 - chosen) * machine.direct


def _claimed(rng: np.random.Generator, system: Document, way: str, limited: bool, P: np.ndarray, rate: float,
             held: np.ndarray, loops: list, machines: list[Machine]) -> Document | None:
    one, dt, N = machines[0], system["sample_time"], len(P)
    evidence: Document = {"matrix": P.tolist()}
    region: Document = {}
    if way == "energy":
        scale = 0.5 / max(np.linalg.eigvalsh(_driven(A, B, P, dt, 0.0))[-1] for A, B, _, _ in loops)
        P = scale * P
        squared = 0.0
        for A, B, C, D in loops:
            both, parts = np.hstack([C, D]), _joint(A, B, P, dt, 0.0, np.ones(B.shape[1]))
            squared = max(squared, np.linalg.eigvalsh(both @ np.linalg.solve(parts, both.T))[-1])
        region["bound"], evidence["matrix"] = float(f"{1.01 * np.sqrt(squared) + 1e-6:.4g}"), P.tolist()
    W = np.linalg.inv(P)
    level = float(f"{rng.uniform(0.2, 2.0):.3g}")
    if limited:
        region["saturation"] = [float(f"{1.01 * np.sqrt(level * row @ W @ row):.4g}") for row in held]
        if min(region["saturation"]) <= 0:
            return None
        evidence["feedback"] = held.tolist()
    if way in ("norm", "each"):
        decay = float(f"{rate * (1.0 if dt else 1.0):.3g}")
        worst = 1.02 * max(np.linalg.eigvalsh(_driven(A, B, P, dt, decay))[-1] for A, B, _, _ in loops)
        evidence["decay"] = decay
        if way == "norm":
            region["disturbance"] = float(f"{np.sqrt(decay * level / worst) * 0.99:.4g}")
        else:
            evidence["multipliers"] = [float(worst)] * one.w
            region["disturbance"] = [float(f"{np.sqrt(decay * level / worst / one.w) * 0.99:.4g}")] * one.w
    if way == "free":
        region["rate"] = rate
    if rng.random() < 0.6:
        rows, n = np.round(rng.standard_normal((2, N - len(one.K["A"]))), 2), N - len(one.K["A"])
        limits: Document = {"state": rows.tolist()}
        whole = np.hstack([rows, np.zeros((2, N - n))])
        if one.k and not limited and not one.direct.any():
            limits["control"] = np.round(rng.standard_normal((2, one.k)), 2).tolist()
            whole = whole + np.array(limits["control"]) @ one.F
        limits["bound"] = [float(f"{1.01 * np.sqrt(level * row @ W @ row) + 1e-9:.4g}") for row in whole]
        region["limits"] = limits
    if way == "free" and not limited and rng.random() < 0.5:
        least = min(np.linalg.eigvalsh(P - A.T @ P @ A if dt else -(P @ A + A.T @ P))[0] for A, _, _, _ in loops)
        n, size = len(one.A), 1 + np.linalg.norm(one.F, 2) ** 2
        region["cost"] = {"state": (float(f"{0.9 * least / size:.3g}") * np.eye(n)).tolist()}
        if one.k:
            region["cost"]["control"] = (float(f"{0.9 * least / size:.3g}") * np.eye(one.k)).tolist()
    region["level"] = level
    return {"system": system, "region": region, "evidence": evidence}


def _joint(A: np.ndarray, B: np.ndarray, P: np.ndarray, dt: float, decay: float, weights: np.ndarray) -> np.ndarray:
    both = np.hstack([A, B])
    size = len(A)
    if dt:
        own = -both.T @ P @ both
        own[:size, :size] += (1 - decay) * P
    else:
        own = np.block([[-(P @ A + A.T @ P) - decay * P, -P @ B], [-B.T @ P, np.zeros((B.shape[1],) * 2)]])
    own[size:, size:] += np.diag(weights)
    return own


def _driven(A: np.ndarray, B: np.ndarray, P: np.ndarray, dt: float, decay: float) -> np.ndarray:
    """The least matrix that has to be subtracted for the disturbances."""
    own = _joint(A, B, P, dt, decay, np.zeros(B.shape[1]))
    n = len(A)
    found: np.ndarray = own[n:, :n] @ np.linalg.solve(own[:n, :n], own[:n, n:]) - own[n:, n:]
    return found


def break_ellipsoid(document: Document, rng: np.random.Generator) -> float:
    """How far moments of limited loops in the ellipsoid violate the claim, relative."""
    system, region = document["system"], document["region"]
    P, dt, level = _array(document["evidence"]["matrix"]), truth.number(system["sample_time"]), truth.number(
        region["level"])
    if np.abs(P - P.T).max() > 0 or np.linalg.eigvalsh(P)[0] <= 0:
        return 1.0
    worst, count = _beyond_limits(document, P, level), len(system["vertices"])
    root = np.linalg.inv(np.linalg.cholesky(P)).T
    limits = _array(region["saturation"]) if "saturation" in region else None
    for weights in np.vstack([np.eye(count), rng.dirichlet(np.full(count, 0.6), 4)]):
        machine = Machine(system, weights)
        starts = list(rng.standard_normal((_DRAWN, len(P))))
        A = machine.loop(machine.F, machine.direct)[0]
        half = root.T @ (A.T @ P @ A if dt else P @ A + A.T @ P) @ root
        starts += list(np.linalg.eigh(half)[1].T)
        for start in starts:
            x = np.sqrt(level) * root @ start / np.linalg.norm(start)
            worst = max(worst, _moment(machine, region, P, dt, level, x, limits, rng))
    return worst


def _beyond_limits(document: Document, P: np.ndarray, level: float) -> float:
    """Largest of every limited row in the ellipsoid, exactly."""
    if "limits" not in document["region"]:
        return -1.0
    table, system = document["region"]["limits"], document["system"]
    machine = Machine(system, np.eye(len(system["vertices"]))[0])
    rows = np.hstack([_array(table["state"]), np.zeros((len(table["bound"]), len(P) - len(machine.A)))])
    rows = rows + (_array(table["control"]) @ machine.F if "control" in table else 0)
    return max(np.sqrt(level * row @ np.linalg.solve(P, row)) / bound - 1
               for row, bound in zip(rows, _array(table["bound"]), strict=True))


def _moment(machine: Machine, region: Document, P: np.ndarray, dt: float, level: float, x: np.ndarray,
            limits: np.ndarray | None, rng: np.random.Generator) -> float:
    """How much V grows beyond what is claimed from one point, relative to the level and the speed of the loop."""
    size = level * (1 + np.linalg.norm(machine.A, 2)) ** 2
    if "disturbance" in region:
        # only on the boundary something is claimed: the worst disturbance, with limits the better of some
        tried = [_strongest(machine.B.shape[1] - machine.k, region["disturbance"], v)
                 for v in (machine.loop(machine.F, machine.direct)[1].T @ P @ x, *rng.standard_normal((6, machine.w)))]
        grown = max(_change(P, x, machine.moved(x, w, limits)[0], dt) for w in tried)
        return float(grown / size) if not dt else float(grown / level)
    if "bound" in region:
        worst, bound = -1.0, truth.number(region["bound"])
        for scale in (0.0, 0.3, 1.0, 3.0):
            w = scale * rng.standard_normal(machine.w) * np.sqrt(level)
            then, z = machine.moved(x, w, limits)
            worst = max(worst, float((_change(P, x, then, dt) + z @ z / bound**2 - w @ w) / (size + w @ w)))
        return worst
    then = machine.moved(x, np.zeros(0), limits)[0]
    rate = truth.number(region.get("rate", 0))
    change = _change(P, x, then, dt)
    allowed = ((1 - rate) ** 2 - 1) * level if dt else -2 * rate * level
    worst = (change - allowed) / size
    if "cost" in region:
        n, u = len(machine.A), machine.F @ x
        paid = x[:n] @ _array(region["cost"]["state"]) @ x[:n] if "state" in region["cost"] else 0.0
        paid += u @ _array(region["cost"]["control"]) @ u if "control" in region["cost"] else 0.0
        worst = max(worst, (change + paid) / size)
    return float(worst)


def _change(P: np.ndarray, x: np.ndarray, then: np.ndarray, dt: float) -> float:
    return float(then @ P @ then - x @ P @ x if dt else 2 * x @ P @ then)


def _strongest(count: int, size: Any, direction: np.ndarray) -> np.ndarray:
    """The allowed disturbance that goes furthest in a direction."""
    if isinstance(size, list):
        return _array(size) * np.where(direction >= 0, 1.0, -1.0)
    length = np.linalg.norm(direction)
    return truth.number(size) * (direction / length if length > 0 else np.eye(count)[0])


SUBJECTS = (Subject("ellipsoid", make_ellipsoid, break_ellipsoid, tolerance=1e-7),)
