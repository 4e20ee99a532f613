"""Certificates of feedback over hulls that just hold; falsifiers: plants drawn from the hull, moving weights."""

from __future__ import annotations

import certificate_truth as truth
import numpy as np
from mutant_linear import gramian, norm_of
from mutants import Document, Subject, holds

_DRAWN = 40


def _array(value: object) -> np.ndarray:
    return np.vectorize(truth.number, otypes=[float])(np.array(value, dtype=object)).astype(float)


def loops(system: Document, weights: np.ndarray | None = None) -> list[Document]:
    """Loops at the vertices, or at plants of the hull with these weights (rows), in floats."""
    if "controller" in system:
        return _scheduled_loops(system, weights)
    F, k = _array(system["gain"]), len(system["gain"])
    vertices = [{key: _array(one[key]) for key in one} for one in system["vertices"]]
    weights = np.eye(len(vertices)) if weights is None else weights
    found = []
    for row in weights:
        part = {key: sum(w * one[key] for w, one in zip(row, vertices, strict=True)) for key in vertices[0]}
        B, m = part["B"], part["B"].shape[1] - k
        one = {"A": part["A"] + B[:, m:] @ F, "B": B[:, :m]}
        if "C" in part:
            one |= {"C": part["C"] + part["D"][:, m:] @ F, "D": part["D"][:, :m]}
        found.append(one)
    return found


def _scheduled_loops(system: Document, weights: np.ndarray | None) -> list[Document]:
    """Plants and controllers are averaged, then joined: whether that is the average of the loops is not presumed."""
    q, k = int(truth.number(system["n_meas"])), int(truth.number(system["n_ctrl"]))
    weights, found = np.eye(len(system["vertices"])) if weights is None else weights, []
    for row in weights:
        (A, B, C, D), (AK, BK, CK, DK) = (
            [sum(w * _shaped(one, key) for w, one in zip(row, system[name], strict=True)) for key in "ABCD"]
            for name in ("vertices", "controller"))
        m, p, n, s = B.shape[1] - k, len(C) - q, len(A), len(AK)
        E = np.linalg.inv(np.eye(k) - DK @ D[p:, m:])
        u = np.hstack([E @ DK @ C[p:], E @ CK, E @ DK @ D[p:, :m]])
        y = np.hstack([C[p:], np.zeros((q, s)), D[p:, :m]]) + D[p:, m:] @ u
        moved = np.vstack([np.hstack([A, np.zeros((n, s)), B[:, :m]]) + B[:, m:] @ u,
                           np.hstack([np.zeros((s, n)), AK, np.zeros((s, m))]) + BK @ y])
        seen = np.hstack([C[:p], np.zeros((p, s)), D[:p, :m]]) + D[:p, m:] @ u
        found.append({"A": moved[:, :n + s], "B": moved[:, n + s:], "C": seen[:, :n + s], "D": seen[:, n + s:]})
    return found


def _shaped(one: Document, key: str) -> np.ndarray:
    p, m, n = len(one["D"]), len(one["D"][0]), len(one["A"])
    return _array(one[key]).reshape({"A": (n, n), "B": (n, m), "C": (p, n), "D": (p, m)}[key])


def _scheduled_system(rng: np.random.Generator, measure: str, dt: float) -> Document:
    """Plants and controllers that vary; of factors that meet in a product one is common to all vertices."""
    n, s, count, q, k = (int(rng.integers(low, high)) for low, high in ((1, 3), (0, 3), (1, 4), (1, 3), (1, 3)))
    m, p, spread = 1, 1, 0.05
    A, B, C = (rng.standard_normal(shape) for shape in ((n, n), (n, m + k), (p + q, n)))
    A = 0.6 * A / max(np.abs(np.linalg.eigvals(A)).max(), 0.1) if dt else A - (
        np.linalg.eigvals(A).real.max() + 0.8) * np.eye(n)
    D = 0.3 * rng.standard_normal((p + q, m + k))
    D[p:, m:] = 0
    if measure == "h2" and not dt:
        D[:, :m] = 0
    AK = (0.4 if dt else -0.9) * np.eye(s)
    BK, CK, DK = (0.2 * rng.standard_normal(shape) for shape in ((s, q), (k, s), (k, q)))
    if rng.random() < 0.3:
        DK, D[p:, m:] = 0 * DK, 0.3 * rng.standard_normal((q, k))
    acts = rng.random() < 0.5  # B2 and D12 vary, or C_K
    vertices, controllers = [], []
    for _ in range(count):
        other = [part + spread * rng.standard_normal(part.shape) for part in (A, B, C, D)]
        if not acts:
            other[1][:, m:], other[3][:p, m:] = B[:, m:], D[:p, m:]
        other[2][p:], other[3][p:] = C[p:], D[p:]
        if measure == "h2" and not dt:
            other[3][:p, :m] = 0
        vertices.append({key: np.round(part, 3).tolist() for key, part in zip("ABCD", other, strict=True)})
        own = [AK + spread * rng.standard_normal(AK.shape), BK + spread * rng.standard_normal(BK.shape),
               CK + (0 if acts or D[p:, m:].any() else spread) * rng.standard_normal(CK.shape), DK]
        controllers.append({key: np.round(part, 3).tolist() for key, part in zip("ABCD", own, strict=True)})
    return {"vertices": vertices, "controller": controllers, "n_meas": q, "n_ctrl": k, "sample_time": dt}


def _feedback_system(rng: np.random.Generator, measure: str, dt: float) -> Document:
    n, k, count = int(rng.integers(1, 4)), int(rng.integers(1, 3)), int(rng.integers(1, 4))
    m, p = int(rng.integers(1, 3)), int(rng.integers(1, 3))
    A, B = rng.standard_normal((n, n)), rng.standard_normal((n, m + k))
    modes = np.linalg.eigvals(A)
    A = 0.7 * A / max(np.abs(modes).max(), 0.1) if dt else A - (modes.real.max() + 0.6) * np.eye(n)
    F, spread = np.round(0.2 * rng.standard_normal((k, n)), 3), 0.05
    C, D = rng.standard_normal((p, n)), rng.standard_normal((p, m + k)) * (0 if measure == "h2" and not dt else 0.3)
    vertices = []
    for _ in range(count):
        Bi = np.round(B + spread * rng.standard_normal(B.shape), 3)
        one = {"A": np.round(A - Bi[:, m:] @ F + spread * rng.standard_normal((n, n)), 3).tolist(), "B": Bi.tolist()}
        if measure in ("hinf", "h2"):
            one |= {"C": np.round(C, 3).tolist(), "D": np.round(D, 3).tolist()}
        vertices.append(one)
    return {"vertices": vertices, "gain": F.tolist(), "sample_time": dt}


def make_polytope(rng: np.random.Generator) -> Document:
    measure, dt = str(rng.choice(["stability", "stability", "hinf", "h2", "region"])), float(rng.choice([0.0, 0.2]))
    system = (_scheduled_system if rng.random() < 0.5 else _feedback_system)(rng, measure, dt)
    closed = loops(system)
    n, count = len(closed[0]["A"]), len(closed)
    P = gramian(sum(one["A"] for one in closed) / count, np.eye(n), dt > 0)
    if not np.linalg.eigvalsh(P)[0] > 0:
        return make_polytope(rng)
    L = np.linalg.cholesky(np.linalg.inv(P))
    own = [np.linalg.solve(L, one["A"] @ L) for one in closed]
    rate = min(1 - np.linalg.norm(one, 2) if dt else -np.linalg.eigvalsh(one + one.T)[-1] / 2 for one in own)
    if rate <= 1e-3:
        return make_polytope(rng)
    short = float(f"{rate * 0.98:.3g}")
    evidence: Document = {"matrix": P.tolist()}
    if measure == "stability":
        region: Document = {"rate": short}
        if rng.random() < 0.4:
            region, evidence = _with_slack(rng, closed, P, short, dt)
    elif measure == "region":
        region = {"measure": measure, "radius": 1 - short} if dt else {"measure": measure, "decay": short}
    else:
        region, evidence = _bounded(measure, closed, P, dt)
    document = {"system": system, "region": region, "evidence": evidence}
    return document if holds("polytope", document) else make_polytope(rng)


def _with_slack(rng: np.random.Generator, closed: list[Document], P: np.ndarray, rate: float, dt: float
                ) -> tuple[Document, Document]:
    """The same P at all vertices, a little different, and G = [P; ε] or, sampled, [0; P]: it just holds."""
    n = len(P)
    forms = [np.round(P * (1 + 1e-4 * k), 9) for k in range(len(closed))]
    G = np.vstack([0 * P, P]) if dt else np.vstack([P, 1e-3 * np.eye(n)])
    region: Document = {"rate": float(f"{rate * (0.9 if dt else 0.7):.3g}")}
    if not dt and rng.random() < 0.5:
        region["parameter_rates"] = [0.2] * len(closed)
    return region, {"matrices": [((P + P.T) / 2).tolist() for P in forms], "slack": G.tolist()}


def _bounded(measure: str, closed: list[Document], P: np.ndarray, dt: float) -> tuple[Document, Document]:
    """A multiple of P that shows a bound, and that bound with a thousandth to spare."""
    falls = [P - one["A"].T @ P @ one["A"] if dt else -(P @ one["A"] + one["A"].T @ P) for one in closed]
    scale = 1.01 * max(np.linalg.eigvals(np.linalg.solve(own, one["C"].T @ one["C"])).real.max()
                       for own, one in zip(falls, closed, strict=True))
    P, squared = scale * P, 0.0
    for own, one in zip(falls, closed, strict=True):
        B, C, D = one["B"], one["C"], one["D"]
        if measure == "h2":
            squared = max(squared, np.trace(B.T @ P @ B) + np.sum(D**2))
            continue
        cross = (one["A"].T @ P @ B if dt else P @ B) + C.T @ D
        last = D.T @ D + (B.T @ P @ B if dt else 0)
        squared = max(squared, np.linalg.eigvalsh(last + cross.T @ np.linalg.solve(scale * own - C.T @ C, cross))[-1])
    return {"measure": measure, "bound": float(np.sqrt(squared)) * 1.001}, {"matrix": P.tolist()}


def break_polytope(document: Document, rng: np.random.Generator) -> float:
    """How far plants of the hull violate the claim, relative."""
    system, region, evidence = document["system"], document["region"], document["evidence"]
    count, dt = len(system["vertices"]), truth.number(system["sample_time"])
    weights = np.vstack([np.eye(count), rng.dirichlet(np.full(count, 0.6), _DRAWN)])
    drawn = loops(system, weights)
    measure, number = region.get("measure", "stability"), {key: truth.number(value) for key, value in region.items()
                                                           if key not in ("measure", "parameter_rates")}
    rate = {"stability": number.get("rate", 0.0), "region": 1 - number["radius"] if "radius" in number and dt else
            number.get("decay", 0.0)}.get(measure, 0.0)
    worst = max(_growth(one["A"], rate, dt) for one in drawn)
    if measure == "stability":
        return max(worst, _forms(drawn, weights, evidence, region, rate, dt, rng))
    if measure == "region" or worst > 0:
        return worst
    return max(_size(measure, one, dt) for one in drawn) / number["bound"] - 1


def _growth(A: np.ndarray, rate: float, dt: float) -> float:
    modes, size = np.linalg.eigvals(A), 1 + np.linalg.norm(A, 2)
    return float((np.abs(modes).max() - (1 - rate) if dt else modes.real.max() + rate) / size)


def _forms(drawn: list[Document], weights: np.ndarray, evidence: Document, region: Document, rate: float, dt: float,
           rng: np.random.Generator) -> float:
    """V must fall at every plant of the hull, with weights that move as fast as they may; relative to V."""
    moving = "parameter_rates" in region
    if "matrices" in evidence and not moving:
        return -1.0  # of constant plants only: their eigenvalues were looked at
    forms = [_array(one) for one in evidence.get("matrices", [evidence["matrix"]] if "matrix" in evidence else [])]
    worst = -1.0
    for row, one in zip(weights, drawn, strict=True):
        P = sum(w * form for w, form in zip(row, forms, strict=True)) if len(forms) == len(row) else forms[0]
        change = 0 * P
        if moving:
            way = rng.uniform(-1, 1, len(row)) * _array(region["parameter_rates"])
            way -= way.mean()
            limit = np.abs(way) / np.maximum(_array(region["parameter_rates"]), 1e-300)
            way = way / max(limit.max(), 1.0) if limit.max() < 1e200 else 0 * way
            change = sum(w * form for w, form in zip(way, forms, strict=True))
        values = np.linalg.eigvalsh(P)
        if values[0] <= 0:
            return 1.0
        half = np.linalg.inv(np.linalg.cholesky(P))
        A = one["A"]
        form = A.T @ P @ A - (1 - rate) ** 2 * P if dt else P @ A + A.T @ P + change + 2 * rate * P
        worst = max(worst, float(np.linalg.eigvalsh(half @ form @ half.T)[-1] / (1 + np.linalg.norm(A, 2))))
    return worst


def _size(measure: str, one: Document, dt: float) -> float:
    if measure == "hinf":
        return norm_of({key: value.tolist() for key, value in one.items()} | {"sample_time": dt})
    P = gramian(one["A"], one["C"], dt > 0)
    if not dt and one["D"].any():
        return np.inf
    return float(np.sqrt(max(np.trace(one["B"].T @ P @ one["B"]) + np.sum(one["D"] ** 2), 0.0)))


SUBJECTS = (Subject("polytope", make_polytope, break_polytope, tolerance=1e-7),)
