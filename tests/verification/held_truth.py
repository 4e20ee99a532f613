"""Independent truth about regulated modules: currents by solving the heat balances, Jacobians by complex step."""

from __future__ import annotations

import copy

import certificate_truth as truth
import numpy as np
from scipy.optimize import brentq


def held(document):
    """Return {held lump: its module}."""
    modules = document["system"]["modules"]
    return {modules[name]["cold"]: name for name in document["region"]["setpoint"]}


def ranges(document):
    """Return the temperature range of every lump (n, 2)."""
    given, setpoint, holder = document["region"]["temperature"], document["region"]["setpoint"], held(document)
    rows = [setpoint[holder[name]] if name in holder else given[name] if isinstance(given, dict) else given
            for name in document["system"]["lumps"]]
    return np.array([[truth.number(value) for value in row] for row in rows])


def flow(document, x, currents):
    """Return the heat into every lump with its ambients at 300 K."""
    system = document["system"]
    return truth.heat(system, x, currents, dict.fromkeys(system["ambients"], 300.0))


def reduced(document, x, currents):
    """Return the Jacobian of the free lumps with the held ones' balances kept, by a Schur complement."""
    system, holder = document["system"], held(document)
    names = list(system["lumps"])
    cold = [names.index(name) for name in holder]
    free = [k for k in range(len(names)) if k not in cold]
    J = truth.jacobian(system, x, currents)
    B = np.zeros((len(names), len(cold)))
    for column, module in enumerate(holder.values()):
        moved = {name: value + (1e-30j if name == module else 0) for name, value in currents.items()}
        B[:, column] = flow(document, x.astype(complex), moved).imag / 1e-30
    return J[np.ix_(free, free)] - B[free] @ np.linalg.solve(B[cold], J[np.ix_(cold, free)])


def grip(document, x, currents):
    """Return the least S x_c - R I."""
    system, names, least = document["system"], list(document["system"]["lumps"]), np.inf
    for name in held(document).values():
        module = system["modules"][name]
        h, c = names.index(module["hot"]), names.index(module["cold"])
        T = (x[h] + x[c]) / 2 - truth.number(module["reference_temperature"])
        S, R = (truth.number(module[key]["value"]) + truth.number(module[key]["slope"]) * T
                for key in ("seebeck", "resistance"))
        least = min(least, S * x[c] - R * currents[name])
    return least


def points(document, rng, count):
    """Return vertices and inner points of the box."""
    T = ranges(document)
    I = np.array([[truth.number(v) for v in document["region"]["current"][m]]  # noqa: E741 - the current
                  for m in document["system"]["modules"]]).reshape(-1, 2)
    for k in range(count):
        s, t = rng.random(len(T)), rng.random(len(I))
        if k % 3:
            s, t = np.round(s), np.round(t)
        yield (T[:, 0] + s * (T[:, 1] - T[:, 0]),
               dict(zip(document["system"]["modules"], (I[:, 0] + t * (I[:, 1] - I[:, 0])).tolist(), strict=True)))


def violation(document, rng, count=40):
    """Return the worst sampled violation of a regulated claim, relative: above 0 it is false."""
    system, evidence = document["system"], document["evidence"]
    holder = held(document)
    E = np.array([truth.number(lump["capacity"]) for name, lump in system["lumps"].items() if name not in holder])
    rate, method, worst = truth.number(evidence["rate"]), evidence["method"], -np.inf
    for x, currents in points(document, rng, count):
        if grip(document, x, currents) <= 0:
            return np.inf
        J = reduced(document, x, currents)
        if method in ("sum", "max"):
            w = np.array([truth.number(value) for value in evidence["weights"]])
            A = np.abs(J) - np.diag(np.abs(np.diag(J))) + np.diag(np.diag(J))
            A = A if method == "max" else A.T
            value = float(np.max((A @ w + rate * E * w) / (np.abs(A) @ np.abs(w) + 1e-300)))
            worst = max(worst, value, -float(np.min(w)))
        else:
            P = np.diag(E) if method == "energy" else np.array(
                [[truth.number(value) for value in row] for row in evidence["matrix"]])
            G = P / E @ J
            M = G + G.T + 2 * rate * P
            worst = max(worst, float(np.linalg.eigvalsh((M + M.T) / 2)[-1] / np.linalg.norm(G, 2)),
                        -float(np.linalg.eigvalsh((P + P.T) / 2)[0]))
    return worst


def machine(rng, *, nonlinear=False, extra=False):
    """Return a random machine: one or two modules holding cold lumps with cold plates, maybe one that holds nothing."""
    count = int(rng.integers(1, 3))
    lumps, links, modules = {"sink": {"capacity": 50.0}}, [], {}

    def link(a, b, low, high):
        links.append({"between": [a, b], "conductance": round(float(rng.uniform(low, high)), 3)})

    link("sink", "room", 0.5, 4)
    for m in range(count + extra):
        for name in (f"h{m}", f"c{m}", f"p{m}"):
            lumps[name] = {"capacity": round(float(rng.uniform(1, 30)), 3)}
        link("sink", f"h{m}", 2, 20)
        link(f"c{m}", f"p{m}", 0.1, 5)
        link(f"p{m}", "room", 0.02, 1)
        modules[f"m{m}"] = {"hot": f"h{m}", "cold": f"c{m}", "reference_temperature": 308.15,
                            "seebeck": {"value": 0.05, "slope": float(rng.choice([0.0, 7e-5, -5e-5]))},
                            "resistance": {"value": 4.5, "slope": float(rng.choice([0.0, 0.02, -0.01]))},
                            "conductance": {"value": 0.3, "slope": float(rng.choice([0.0, 1e-3]))}}
    if nonlinear:
        links[1]["natural"] = {"gain": 0.05, "exponent": 0.25}
        links[2]["radiation"] = 5e-10
        links[3]["radiation"] = 3e-10
        links[0]["natural"] = {"gain": 0.05, "exponent": 0.3}
    if count == 2:
        link("c0", "c1", 0.1, 1)
        link("p0", "p1", 0.1, 1)
    top = float(rng.uniform(0.1, 2.2))
    low = float(rng.uniform(275, 290))
    region = {"temperature": [280.0, round(float(rng.uniform(300, 340)), 2)],
              "setpoint": {f"m{m}": [low, low + float(rng.choice([0.0, 3.0]))] for m in range(count)},
              "current": {name: [float(rng.choice([0.0, -0.3])), round(top, 4)] for name in modules}}
    return {"system": {"lumps": lumps, "ambients": ["room"], "links": links, "modules": modules}, "region": region}


def trajectories(document, rng, count):
    """Return pairs of states (free temperatures random, held ones at a set-point) with the currents that hold them.

    Both have the same loads and set-points; where no current of the range holds them there is no pair.
    """
    system, holder, box = document["system"], held(document), ranges(document)
    names = list(system["lumps"])
    for _ in range(count):
        x = box[:, 0] + rng.random(len(names)) * (box[:, 1] - box[:, 0])
        currents = {name: float(rng.uniform(*map(truth.number, pair)))
                    for name, pair in document["region"]["current"].items()}
        wanted = flow(document, x, currents)
        y = box[:, 0] + rng.random(len(names)) * (box[:, 1] - box[:, 0])
        others = copy.copy(currents)
        for name in holder:
            y[names.index(name)] = x[names.index(name)]
        for name, module in holder.items():
            k = names.index(name)

            def missing(current, k=k, module=module, wanted=wanted, y=y, others=others):
                return (flow(document, y, {**others, module: current}) - wanted)[k]

            low, high = (truth.number(v) for v in document["region"]["current"][module])
            if missing(low) < 0 or missing(high) > 0:
                break
            others[module] = brentq(missing, low, high, xtol=1e-14) if high > low else low
        else:
            yield x, y, currents, others


def candidate(document, method, rate, rng):
    """Evidence that may prove something: weights or a diagonal P from a solve with the worst sampled Jacobian."""
    holder = held(document)
    E = np.array([lump["capacity"] for name, lump in document["system"]["lumps"].items() if name not in holder])
    samples = [reduced(document, *point) for point in points(document, rng, 30)
               if grip(document, *point) > 0]
    worst = np.max(samples, axis=0) if samples else -np.diag(E)
    d, c = (np.linalg.solve(M + 1.1 * rate * np.diag(E), -E) for M in (worst, worst.T))
    if min(d.min(), c.min()) <= 0:
        d = c = np.ones(len(E))
    if method == "energy":
        return {"method": method, "rate": rate}
    if method == "lyapunov":
        return {"method": method, "rate": rate, "matrix": np.diag(np.round(E * c / d, 6)).tolist()}
    return {"method": method, "rate": rate, "weights": np.round(d if method == "max" else c, 6).tolist()}
