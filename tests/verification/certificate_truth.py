"""Independent truth about certificates: sampled Jacobians in floats, from the heat flows by complex step.

Nothing here uses the checker: numbers are read by Python's own float(), Jacobians come from differentiating the heat
flows numerically, and a claim is false as soon as one sampled point of its box violates it.
"""

from __future__ import annotations

import copy
import itertools
from typing import Any

import numpy as np
from scipy.optimize import linprog

Document = dict[str, Any]


def number(value: Any) -> float:
    """Read a number of a certificate the plain way."""
    if isinstance(value, str) and "x" in value.lower():
        return float.fromhex(value)
    return float(value)


def heat(system: Document, x: np.ndarray, currents: dict[str, float], ambient: dict[str, float],
         load: dict[str, float] | None = None) -> np.ndarray:
    """Return the heat into every lump [W]; works for complex temperatures too. Powers of heaters are with currents."""
    place = {name: k for k, name in enumerate(system["lumps"])}
    flow = np.zeros(len(place), dtype=x.dtype)
    for link in system["links"]:
        a, b = link["between"]
        Ta, Tb = (x[place[node]] if node in place else ambient[node] for node in (a, b))
        q = number(link["conductance"]) * (Ta - Tb)
        if "natural" in link:
            distance = (Ta - Tb) * np.sign((Ta - Tb).real)
            if distance.real > 0:
                q += number(link["natural"]["gain"]) * distance ** number(link["natural"]["exponent"]) * (Ta - Tb)
        q += number(link.get("radiation", 0.0)) * (Ta**4 - Tb**4)
        if a in place:
            flow[place[a]] -= q
        if b in place:
            flow[place[b]] += q
    for name, module in system["modules"].items():
        h, c = place[module["hot"]], place[module["cold"]]
        T = (x[h] + x[c]) / 2 - number(module["reference_temperature"])
        S, R, K = (number(module[key]["value"]) + number(module[key]["slope"]) * T
                   for key in ("seebeck", "resistance", "conductance"))
        current = currents[name]
        flow[h] += S * x[h] * current + R * current**2 / 2 + K * (x[c] - x[h])
        flow[c] += -S * x[c] * current + R * current**2 / 2 + K * (x[h] - x[c])
    for name, heater in system.get("inputs", {}).items():
        T = x[place[heater["lump"]]]
        warmer = T - number(heater["reference_temperature"])
        flow[place[heater["lump"]]] += currents.get(name, 0.0) * (1 + number(heater["power_slope"]) * warmer)
    for name, value in (load or {}).items():
        flow[place[name]] += value
    return flow


def jacobian(system: Document, x: np.ndarray, currents: dict[str, float]) -> np.ndarray:
    """Return d(heat into row)/d(temperature of column) [W/K] by complex step."""
    ambient = {name: 300.0 for name in system["ambients"]}
    n = len(x)
    J = np.zeros((n, n))
    for j in range(n):
        z = x.astype(complex)
        z[j] += 1e-30j
        J[:, j] = heat(system, z, currents, ambient).imag / 1e-30
    return J


def boxes(system: Document, region: Document) -> tuple[np.ndarray, np.ndarray]:
    """Return the temperature boxes (n, 2) and current boxes (m, 2)."""
    given = region["temperature"]
    temperature = [given[name] if isinstance(given, dict) else given for name in system["lumps"]]
    current = [region["current"][name] for name in system["modules"]]
    read = np.vectorize(number, otypes=[float])
    return read(np.array(temperature, dtype=object)), read(np.array(current, dtype=object).reshape(-1, 2))


def points(system: Document, region: Document, rng: np.random.Generator, count: int) -> list[tuple[np.ndarray, dict]]:
    """Return vertices and inner points of the box; with the currents, powers of heaters that follow temperature."""
    T, I = boxes(system, region)  # noqa: E741 - the current
    powers = {name: [number(value) for value in pair] for name, pair in region.get("power", {}).items()}
    found = []
    for k in range(count):
        s, t = rng.random(len(T)), rng.random(len(I))
        if k % 4:  # most at vertices, where the worst case tends to be
            s, t = np.round(s), np.round(t)
        if k % 4 == 1:
            t = rng.random(len(I))
        x = T[:, 0] + s * (T[:, 1] - T[:, 0])
        i = I[:, 0] + t * (I[:, 1] - I[:, 0])
        chosen = {name: float(rng.choice(pair)) for name, pair in powers.items()}
        found.append((x, dict(zip(system["modules"], i.tolist(), strict=True)) | chosen))
    return found


def violation(document: Document, rng: np.random.Generator, count: int = 60) -> float:
    """Return the worst sampled violation of a contraction claim, relative to its terms: above 0 it is false."""
    system, evidence = document["system"], document["evidence"]
    E = np.array([number(lump["capacity"]) for lump in system["lumps"].values()])
    rate, method = number(evidence["rate"]), evidence["method"]
    worst = -np.inf
    for x, currents in points(system, document["region"], rng, count):
        J = jacobian(system, x, currents)
        if method in ("sum", "max"):
            w = np.array([number(value) for value in evidence["weights"]])
            A = np.abs(J) - np.diag(np.abs(np.diag(J))) + np.diag(np.diag(J))
            A = A if method == "max" else A.T
            terms = np.abs(A) @ np.abs(w) + rate * E * np.abs(w)
            worst = max(worst, float(np.max((A @ w + rate * E * w) / terms)), -float(np.min(w)))
        elif method == "energy":
            M = (J + J.T) / 2 + rate * np.diag(E)
            worst = max(worst, float(np.linalg.eigvalsh(M)[-1] / np.linalg.norm(J, 2)))
        else:
            P = np.array([[number(value) for value in row] for row in evidence["matrix"]])
            G = P / E @ J
            M = G + G.T + 2 * rate * P
            scale = np.linalg.norm(G, 2)
            worst = max(worst, float(np.linalg.eigvalsh((M + M.T) / 2)[-1] / scale),
                        -float(np.linalg.eigvalsh((P + P.T) / 2)[0]))
    return worst


def frozen_abscissa(document: Document, rng: np.random.Generator, count: int = 60) -> float:
    """Return the largest real part of an eigenvalue of E^-1 J sampled over the box [1/s]."""
    system = document["system"]
    E = np.array([number(lump["capacity"]) for lump in system["lumps"].values()])
    return max(float(np.max(np.linalg.eigvals(jacobian(system, x, i) / E[:, None]).real))
               for x, i in points(system, document["region"], rng, count))


def random_system(rng: np.random.Generator, *, modules: int = 2, nonlinear: bool = False,
                  wild: bool = False) -> Document:
    """Return a connected random network; ``wild`` slopes may be negative and modules may share lumps."""
    n = int(rng.integers(2 * modules, 2 * modules + 4)) if not wild else int(rng.integers(3, 6))
    names = [f"x{k}" for k in range(n)]
    links = [{"between": [names[k], names[int(rng.integers(k))]], "conductance": round(float(rng.uniform(0.5, 5)), 3)}
             for k in range(1, n)]
    links += [{"between": [name, "room"], "conductance": round(float(rng.uniform(0.2, 1)), 3)} for name in names]
    if nonlinear:
        links[0]["natural"] = {"gain": 0.05, "exponent": 0.25}
        links[-1]["natural"] = {"gain": 0.03, "exponent": 0.33}
        links[1]["radiation"] = 2e-10
        links[-2]["radiation"] = 3e-10
    order = rng.permutation(n)
    table = {}
    for m in range(modules):
        h, c = (order[2 * m], order[2 * m + 1]) if not wild else rng.choice(n, 2, replace=False)
        sign = (lambda: float(rng.choice([-1, 1]))) if wild else (lambda: 1.0)
        table[f"m{m}"] = {
            "hot": names[int(h)], "cold": names[int(c)],
            "seebeck": {"value": 0.05, "slope": sign() * 7e-5}, "resistance": {"value": 4.5, "slope": sign() * 0.02},
            "conductance": {"value": 0.3, "slope": sign() * 1e-3 if wild else 0.0}, "reference_temperature": 308.15}
    return {"lumps": {name: {"capacity": round(float(rng.uniform(1, 50)), 3)} for name in names},
            "ambients": ["room"], "links": links, "modules": table}


def heat_up(system: Document, region: Document, rng: np.random.Generator) -> None:
    """Add a heater whose power follows temperature, with a range of its power, and sometimes one of its slope."""
    slope = round(float(rng.uniform(-0.006, 0.006)), 5)
    system["inputs"] = {"q0": {"lump": str(rng.choice(list(system["lumps"]))), "power_slope": slope,
                               "reference_temperature": round(float(rng.uniform(285, 300)), 2)}}
    region["power"] = {"q0": [0.0 if rng.random() < 0.6 else -round(float(rng.uniform(1, 10)), 2),
                              round(float(rng.uniform(1, 20)), 2)]}
    if rng.random() < 0.4:
        region.setdefault("parameters", {})["inputs.q0.power_slope"] = [slope - 0.001, slope + 0.0015]


def box(system: Document, top: float, low: float = 280.0, high: float = 350.0) -> Document:
    """Return a region with currents in [-top, top]."""
    return {"temperature": [low, high], "current": {name: [-top, top] for name in system["modules"]}}


def weights(system: Document, region: Document, method: str, rate: float, rng: np.random.Generator) -> list | None:
    """Return weights from a linear programme over sampled vertices (a candidate, not a proof), or None."""
    E = np.array([lump["capacity"] for lump in system["lumps"].values()])
    T, I = boxes(system, region)  # noqa: E741 - the current
    rows = []
    for corner in itertools.product((0, 1), repeat=3):
        for _ in range(4):
            x = T[np.arange(len(T)), rng.integers(0, 2, len(T))]
            i = I[:, corner[2]].copy()
            for k, module in enumerate(system["modules"].values()):
                place = list(system["lumps"])
                h, c = place.index(module["hot"]), place.index(module["cold"])
                x[h], x[c] = T[h, corner[0]], T[c, corner[1]]
                i[k] = I[k, corner[2]]
            J = jacobian(system, x, dict(zip(system["modules"], i.tolist(), strict=True)))
            A = np.abs(J) - np.diag(np.abs(np.diag(J))) + np.diag(np.diag(J))
            rows.append((A if method == "max" else A.T) + rate * np.diag(E))
    stacked = np.vstack(rows)
    found = linprog(np.ones(len(E)), A_ub=stacked, b_ub=-1e-3 * np.ones(len(stacked)), bounds=(1e-3, 1e5))
    return found.x.tolist() if found.success else None


def evidence_for(method: str, system: Document, region: Document, rate: float, rng: np.random.Generator) -> Document:
    """Return plausible evidence for a method; whether it proves anything is for the checker to say."""
    if method in ("sum", "max"):
        w = weights(system, region, method, rate, rng)
        return {"method": method, "rate": rate, "weights": w or [1.0] * len(system["lumps"])}
    if method == "energy":
        return {"method": method, "rate": rate}
    E = np.diag([lump["capacity"] for lump in system["lumps"].values()])
    noise = 0.01 * rng.standard_normal(E.shape) * np.sqrt(np.outer(np.diag(E), np.diag(E)))
    return {"method": method, "rate": rate, "matrix": (E + noise + noise.T).tolist()}


def leaves(value: Any, path: tuple = ()) -> list[tuple]:
    """Return the paths of all numbers and texts."""
    if isinstance(value, dict):
        return [item for key, part in value.items() for item in leaves(part, (*path, key))]
    if isinstance(value, list):
        return [item for key, part in enumerate(value) for item in leaves(part, (*path, key))]
    return [path]


def replaced(document: Document, path: tuple, change: Any) -> Document:
    """Return a copy with ``change`` applied to the value at a path."""
    document = copy.deepcopy(document)
    part = document
    for key in path[:-1]:
        part = part[key]
    part[path[-1]] = change(part[path[-1]])
    return document


def mutate(document: Document, rng: np.random.Generator) -> Document:
    """Return a copy with one random change that keeps it readable: a digit, a factor, a swap, a wider box."""
    kind = int(rng.integers(6))
    if kind == 0 and "weights" in document["evidence"]:
        changed = copy.deepcopy(document)
        rng.shuffle(changed["evidence"]["weights"])
        return changed
    if kind == 1:
        factor = float(rng.uniform(1.0, 3.0))
        name = str(rng.choice(list(document["region"]["current"])))
        return replaced(document, ("region", "current", name), lambda pair: [factor * value for value in pair])
    if kind == 2:
        factor = float(rng.uniform(1.0, 4.0))
        return replaced(document, ("evidence", "rate"), lambda value: number(value) * factor)
    numeric = [path for section in ("system", "region", "evidence") for path in leaves(document[section], (section,))
               if not path[-1] == "method" and "between" not in path and path[-1] not in ("hot", "cold", "name")
               and "ambients" not in path]
    path = numeric[int(rng.integers(len(numeric)))]
    return replaced(document, path, (lambda value: digit(value, rng)) if kind < 5 else (
        lambda value: number(value) * float(rng.choice([-1.0, 0.1, 0.9, 1.1, 10.0]))))


def digit(value: Any, rng: np.random.Generator) -> Any:
    """Change one digit of a number's text."""
    text = value if isinstance(value, str) else repr(value)
    places = [k for k, letter in enumerate(text) if letter.isdigit()]
    k = int(rng.choice(places))
    return text[:k] + str(int(rng.integers(10))) + text[k + 1:]
