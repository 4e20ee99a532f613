"""Certificates of thermal networks that just hold; falsifiers: sampled Jacobians, heats on faces, simulated samples."""

from __future__ import annotations

import copy

import certificate_truth as truth
import held_truth
import loop_truth
import mutant_network_peak
import numpy as np
from held_truth import candidate
from mutants import Document, Subject, holds
from observer_truth import error_matrix, machine
from scipy.linalg import solve_discrete_lyapunov
from uncertain_truth import machines, names_of, spans

from robthermal.verification import establish

_METHODS = ("sum", "max", "energy", "lyapunov")


def ranges(document: Document) -> Document:
    """Return the ranges of the uncertain parameters in floats."""
    given = document["region"].get("parameters", {})
    return {name: [truth.number(value) for value in pair] for name, pair in given.items()}


def plants(document: Document, rng: np.random.Generator, count: int = 6) -> list[Document]:
    """Return systems of the ranges; the system itself where nothing is uncertain."""
    found = ranges(document)
    return list(machines(document["system"], found, rng, count)) if found else [document["system"]]


def with_margin(document: Document, section: str, key: str, sign: float = 1.0) -> Document:
    """Return the claim that the stored margin makes on top."""
    extra = max(truth.number(document["margin"].get(key, 0)), 0.0) if document.get("margin") else 0.0
    return truth.replaced(document, (section, key), lambda value: truth.number(value) + sign * extra)


# contraction


def make_contraction(rng: np.random.Generator) -> Document:
    method = str(rng.choice(_METHODS))
    uncertain = bool(rng.random() < 0.3)
    system = truth.random_system(rng, modules=1 if uncertain else int(rng.integers(1, 3)),
                                 nonlinear=bool(rng.random() < 0.3), wild=bool(rng.random() < 0.3))
    region = truth.box(system, float(rng.uniform(0.2, 2.0)))
    if uncertain:
        names = [f"lumps.{name}.capacity" for name in system["lumps"]] * (method != "lyapunov")
        names += 2 * names_of(system, nonlinear=True)
        region["parameters"] = spans(system, names, rng, 3, 0.8, 1.2)
    if rng.random() < 0.4:
        truth.heat_up(system, region, rng)
    evidence = truth.evidence_for(method, system, region, 1e-4, rng)
    good = establish("contraction", system=system, region=region, evidence=evidence, made_by={})
    if not good.holds:
        return make_contraction(rng)
    return {"kind": "contraction", "system": system, "region": region,
            "evidence": {**good.evidence, "rate": 1e-4 + 0.99 * good.margin["rate"]}}


def break_contraction(document: Document, rng: np.random.Generator) -> float:
    claimed = with_margin(document, "evidence", "rate")
    return max(truth.violation({**claimed, "system": plant}, rng, 25) for plant in plants(document, rng, 4))


# invariance


def make_invariance(rng: np.random.Generator) -> Document:
    system = truth.random_system(rng, modules=1, nonlinear=bool(rng.random() < 0.3), wild=bool(rng.random() < 0.3))
    lump, top = str(rng.choice(list(system["lumps"]))), float(rng.uniform(0.05, 0.8))
    region = {"temperature": [float(rng.uniform(200, 280)), float(rng.uniform(320, 450))],
              "current": {name: [-0.3 * top, top] for name in system["modules"]}, "ambient": {"room": [290.0, 300.0]}}
    if rng.random() < 0.3:
        region["parameters"] = spans(system, names_of(system, nonlinear=True), rng, 3, 0.8, 1.2)
    if rng.random() < 0.4:
        truth.heat_up(system, region, rng)
    good = establish("invariance", system=system, region=region, evidence={}, made_by={})
    if not good.holds:
        return make_invariance(rng)
    load = 0.99 * good.margin["heat"]
    return {"kind": "invariance", "system": system, "region": {**region, "heat": {lump: [-load, load]}}, "evidence": {}}


def break_invariance(document: Document, rng: np.random.Generator) -> float:
    """Largest sampled outward heat flow over all faces, per watt that flows; a stored margin must be left."""
    region, worst = document["region"], -np.inf
    T, _ = truth.boxes(document["system"], region)
    extra = truth.number(document["margin"].get("heat", 0)) if document.get("margin") else 0.0
    for plant in plants(document, rng, 4):
        for x, currents in truth.points(plant, region, rng, 25):
            room, load = ({name: float(rng.choice([truth.number(value) for value in pair]))
                           for name, pair in region.get(key, {}).items()} for key in ("ambient", "heat"))
            for k in range(len(x)):
                for face, sign in ((1, 1), (0, -1)):
                    y = x.copy()
                    y[k] = T[k, face]
                    worst = max(worst, sign * float(truth.heat(plant, y, currents, room, load)[k]) + max(extra, 0.0))
    return worst


# runaway


_CONSTANTS = {"seebeck": 0.05, "resistance": 4.6, "conductance": 0.3, "sink_conductance": 0.7,
              "sink_temperature": 298.0, "setpoint": 278.0}


def fold(S: float, R: float, K: float, g: float, w: float, cold: float) -> tuple[float, float] | None:
    """Smallest positive current at which the load stops growing, and the load, from the two energy balances."""
    denominator = np.poly1d([-S, g + K])
    hot = np.poly1d([R / 2, 0, K * cold + g * w])  # times 1/denominator
    load = np.poly1d([-R / 2, S * cold, K * cold]) * denominator - K * hot
    slope = load.deriv() * denominator - load * denominator.deriv()
    currents = sorted(root.real for root in slope.roots if abs(root.imag) < 1e-9 * (1 + abs(root)) and
                      0 < root.real < (g + K) / S)
    if not currents or slope(0.0) <= 0:
        return None
    return currents[0], float(load(currents[0]) / denominator(currents[0]))


def make_runaway(rng: np.random.Generator) -> Document:
    system = {key: round(value * float(rng.uniform(0.9, 1.2)), 6) for key, value in _CONSTANTS.items()}
    region: Document = {}
    if rng.random() < 0.4:
        names = rng.choice(list(_CONSTANTS), 2, replace=False)
        region = {"parameters": {str(name): [0.999 * system[name], 1.001 * system[name]] for name in names}}
    document = {"system": system, "region": region, "evidence": {}}
    found = [fold(*constants) for constants in _modules(document, rng, 60)]
    if any(item is None for item in found):
        return make_runaway(rng)
    spread = 10 ** float(rng.uniform(-6, -3)) if not region else 3e-3
    document["evidence"] = {key: [min(values) - spread, max(values) + spread]
                            for key, values in zip(("current", "load"), zip(*found, strict=True), strict=True)}
    return document if holds("runaway", document) else make_runaway(rng)


def _modules(document: Document, rng: np.random.Generator, count: int) -> list[list[float]]:
    spans_, found = ranges(document), []
    for _ in range(count if spans_ else 1):
        at = {name: pair[int(rng.integers(2))] if rng.random() < 0.7 else pair[0] + rng.random() * (pair[1] - pair[0])
              for name, pair in spans_.items()}
        found.append([at.get(key, truth.number(document["system"][key])) for key in _CONSTANTS])
    return found


def break_runaway(document: Document, rng: np.random.Generator) -> float:
    worst = -np.inf
    limits = {key: [truth.number(value) for value in document["evidence"][key]] for key in ("current", "load")}
    for constants in _modules(document, rng, 30):
        found = fold(*constants)
        if found is None:
            return np.inf
        for (low, high), value in zip(limits.values(), found, strict=True):
            worst = max(worst, low - value, value - high)
    return worst


# network


def make_network(rng: np.random.Generator) -> Document:
    n, method = int(rng.integers(2, 12)), str(rng.choice(["max", "sum"]))
    A = np.round(rng.uniform(0.1, 2, (n, n)), 3) * (rng.random((n, n)) < 0.3)
    np.fill_diagonal(A, 0)
    np.fill_diagonal(A, -np.round(A.sum(axis=1) + rng.uniform(0.05, 1, n), 3))
    E = np.round(rng.uniform(1, 50, n), 2)
    uncertainty = 0.01 if method == "max" and rng.random() < 0.4 else 0.0
    values, vectors = np.linalg.eig((A if method == "max" else A.T) / E[:, None])
    weights = np.abs(vectors[:, np.argmax(values.real)].real) + 1e-3
    rows, cols = np.nonzero(A)
    system = {"capacity": E.tolist(), "rows": rows.tolist(), "cols": cols.tolist(), "values": A[rows, cols].tolist()}
    document = {"kind": "network", "system": system, "region": {"uncertainty": uncertainty} if uncertainty else {},
                "evidence": {"method": method, "rate": 0.0, "weights": np.round(weights, 5).tolist()}}
    rate = -network_measure(document, rng)
    if not rate > 0:
        return make_network(rng)
    document["evidence"]["rate"] = rate * (1 - 10 ** float(rng.uniform(-6, -1)))
    return document if holds("network", document) else make_network(rng)


def network_measure(document: Document, rng: np.random.Generator) -> float:
    """Largest weighted line over w E [1/s], sampled over the conductances; infinite where a weight is not positive."""
    system, evidence = document["system"], document["evidence"]
    E, w, values = (np.array([truth.number(value) for value in part]) for part in
                    (system["capacity"], evidence["weights"], system["values"]))
    if np.min(w) <= 0:
        return np.inf
    nominal = np.zeros((len(E), len(E)))
    nominal[system["rows"], system["cols"]] = values
    spread, worst = truth.number(document["region"].get("uncertainty", 0)), -np.inf
    for _ in range(60 if spread else 1):
        sums = nominal.sum(axis=1) * (1 + spread * rng.choice([-1, 1], len(E)))
        A = nominal * (1 + spread * rng.choice([-1, 1], nominal.shape))
        np.fill_diagonal(A, 0)
        np.fill_diagonal(A, sums - A.sum(axis=1) if spread else np.diag(nominal))
        size = np.abs(A) - np.diag(np.abs(np.diag(A))) + np.diag(np.diag(A))
        size = size if evidence.get("method", "max") == "max" else size.T
        worst = max(worst, float(np.max(size @ w / (E * w))))
    return worst


def break_network(document: Document, rng: np.random.Generator) -> float:
    claimed = with_margin(document, "evidence", "rate")
    rate = truth.number(claimed["evidence"]["rate"])
    return (network_measure(claimed, rng) + rate) / (rate + 1e-12)


# observer


def make_observer(rng: np.random.Generator) -> Document:
    document = machine(rng)
    n = len(document["system"]["lumps"])
    document["system"]["gain"] = np.round(rng.uniform(0, 0.2, (n, 1)), 3).tolist()
    document["region"] |= truth.box(document["system"], float(rng.uniform(0.2, 1.5)), 290.0, 320.0)
    found = [error_matrix(document, *point) for point in
             truth.points(document["system"], document["region"], rng, 30)]
    mean = np.mean(found, axis=0)
    size = np.abs(np.linalg.eigvals(mean)).max()
    if size >= 0.999:
        return make_observer(rng)
    P = solve_discrete_lyapunov(mean.T / (0.5 + 0.5 * size), np.eye(n))
    P = np.round((P + P.T) / 2 / np.abs(P).max(), 6)
    level = max(float(np.abs(np.linalg.eigvals(np.linalg.solve(P, M.T @ P @ M))).max()) for M in found)
    if rng.random() < 0.3:
        document["region"]["parameters"] = spans(document["system"], names_of(document["system"]), rng, 2, 0.97, 1.03)
    for spare in (1e-6, 1e-4, 1e-3, 1e-2):
        document["evidence"] = {"matrix": P.tolist(), "contraction": float(np.sqrt(level) * (1 + spare))}
        if document["evidence"]["contraction"] < 1 and holds("observer", document):
            return {"kind": "observer", **document}
    return make_observer(rng)


def break_observer(document: Document, rng: np.random.Generator) -> float:
    claimed = with_margin(document, "evidence", "contraction", -1.0)
    claimed["system"] = copy.deepcopy(claimed["system"])
    c = truth.number(claimed["evidence"]["contraction"])
    P = np.array([[truth.number(value) for value in row] for row in claimed["evidence"]["matrix"]])
    if c <= 0 or np.linalg.eigvalsh(P)[0] <= 0:
        return np.inf
    nominal = _plain(claimed["system"])
    worst = -np.inf
    for plant in plants(claimed, rng, 3):
        for point in truth.points(claimed["system"], claimed["region"], rng, 15):
            M = error_matrix({**claimed, "system": _plain(plant)}, *point, nominal)
            worst = max(worst, float(np.linalg.eigvalsh(M.T @ P @ M - c**2 * P)[-1] / np.linalg.norm(P, 2)))
    return worst


def _plain(system: Document) -> Document:
    """Return a copy with floats for the numbers of the modules."""
    system = copy.deepcopy(system)
    for module in system["modules"].values():
        for key in ("seebeck", "resistance", "conductance"):
            module[key] = {part: truth.number(value) for part, value in module[key].items()}
    return system


# gain


def make_gain(rng: np.random.Generator) -> Document:
    system = truth.random_system(rng, modules=1, nonlinear=bool(rng.random() < 0.4), wild=bool(rng.random() < 0.3))
    region = {**truth.box(system, float(rng.uniform(0.1, 1.0))), "ambient": {"room": [285.0, 305.0]}}
    lump, rate = str(rng.choice(list(system["lumps"]))), float(rng.choice([0.0, 1e-4]))
    if rng.random() < 0.3:
        region["parameters"] = spans(system, names_of(system), rng, 2, 0.9, 1.1)
    document = {"system": system, "region": region, "evidence": {"rate": rate, "gains": {}}}
    E = np.array([part["capacity"] for part in system["lumps"].values()])
    worst = np.max([_metzler(truth.jacobian(plant, *point)) for plant in plants(document, rng)
                    for point in truth.points(system, region, rng, 40)], axis=0)
    if np.linalg.eigvals(worst).real.max() >= -1e-3:
        return make_gain(rng)
    names = {"ambients": "room", "heat": lump}
    heat = {source: _heat(document, source, name, rng) for source, name in names.items()}
    for spare in (1 + 1e-6, 1.01, 1.05, 1.2, 2.0):
        document["evidence"]["gains"] = {
            source: {name: np.linalg.solve(worst + (rate + 1e-9) * np.diag(E), -spare * heat[source] - 1e-6).tolist()}
            for source, name in names.items()}
        if holds("gain", document):
            return {"kind": "gain", **document}
    return make_gain(rng)


def _metzler(J: np.ndarray) -> np.ndarray:
    return np.abs(J) - np.diag(np.abs(np.diag(J))) + np.diag(np.diag(J))


def _heat(document: Document, source: str, name: str, rng: np.random.Generator) -> np.ndarray:
    """Largest sampled heat into every lump per unit of a disturbance."""
    names = list(document["system"]["lumps"])
    if source == "heat":
        return np.array([1.0 if other == name else 0.0 for other in names])
    worst = np.zeros(len(names))
    span = [truth.number(value) for value in document["region"].get("ambient", {}).get("room", [295, 305])]
    for plant in plants(document, rng):
        for x, currents in truth.points(plant, document["region"], rng, 20):
            room = dict.fromkeys(plant["ambients"], complex(float(rng.choice(span)), 1e-30))
            worst = np.maximum(worst, truth.heat(plant, x.astype(complex), currents, room).imag / 1e-30)
    return worst


def break_gain(document: Document, rng: np.random.Generator) -> float:
    evidence, worst = document["evidence"], -np.inf
    E = np.array([truth.number(lump["capacity"]) for lump in document["system"]["lumps"].values()])
    rate = truth.number(evidence["rate"])
    for source, listed in evidence["gains"].items():
        for name, values in listed.items():
            d = np.array([truth.number(value) for value in values])
            need = _heat(document, source, name, rng) + rate * E * d
            for plant in plants(document, rng):
                for point in truth.points(plant, document["region"], rng, 25):
                    J = _metzler(truth.jacobian(plant, *point))
                    worst = max(worst, float(np.max((J @ d + need) / (np.abs(J) @ np.abs(d)))), -float(d.min()))
    return worst


# regulated


def make_regulated(rng: np.random.Generator) -> Document:
    document = held_truth.machine(rng, nonlinear=bool(rng.random() < 0.3), extra=bool(rng.random() < 0.2))
    method = str(rng.choice(_METHODS))
    if method == "lyapunov":
        document["system"]["links"][0].pop("natural", None)
    document["evidence"] = candidate(document, method, 1e-6, rng)
    if rng.random() < 0.3:
        document["region"]["parameters"] = spans(document["system"], names_of(document["system"]), rng, 2, 0.98, 1.02)
    if not holds("regulated", document):
        return make_regulated(rng)
    good = establish("regulated", **document, made_by={})
    document["evidence"]["rate"] = 1e-6 + 0.99 * good.margin["rate"]
    return {"kind": "regulated", **document}


def break_regulated(document: Document, rng: np.random.Generator) -> float:
    claimed = with_margin(document, "evidence", "rate")
    return max(held_truth.violation({**claimed, "system": plant}, rng, 30) for plant in plants(document, rng))


# loop


def make_loop(rng: np.random.Generator) -> Document:
    return {"kind": "loop", **loop_truth.variant(str(rng.choice(list(loop_truth.VARIANTS))))}


def break_loop(document: Document, rng: np.random.Generator) -> float:
    claimed = with_margin(document, "evidence", "contraction", -1.0)
    for section in ("system", "region", "evidence"):
        for path in truth.leaves(claimed[section], (section,)):
            try:
                claimed = truth.replaced(claimed, path, truth.number)
            except ValueError:
                continue  # a name
    return loop_truth.violation(claimed, rng)


SUBJECTS = (Subject("contraction", make_contraction, break_contraction),
            Subject("invariance", make_invariance, break_invariance, tolerance=1e-7),
            Subject("runaway", make_runaway, break_runaway, tolerance=1e-9),
            Subject("network", make_network, break_network),
            Subject("network_peak", mutant_network_peak.make, mutant_network_peak.violation, tolerance=1e-9),
            Subject("observer", make_observer, break_observer, 0.6),
            Subject("gain", make_gain, break_gain),
            Subject("regulated", make_regulated, break_regulated, 0.4, edges=(9,)),
            Subject("loop", make_loop, break_loop, 0.1, tolerance=1e-6, edges=(9,)))
