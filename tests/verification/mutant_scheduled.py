"""Certificates of scheduled currents that just hold; falsifiers: heat flows on the ellipsoid, and the equilibrium."""

from __future__ import annotations

import certificate_truth as truth
import numpy as np
from mutant_thermal import plants
from mutants import Document, Subject, holds
from scipy.linalg import solve_continuous_lyapunov


class Law:
    """The feedback of a document in floats."""

    def __init__(self, document: Document):
        system, self.system = document["system"], document["system"]
        read = np.vectorize(truth.number, otypes=[float])
        operating = system["operating"]
        self.x0 = np.array([truth.number(operating["temperature"][name]) for name in system["lumps"]])
        self.I0 = np.array([truth.number(operating["current"][name]) for name in system["modules"]])
        self.F = read(np.array(system["gain"], dtype=object))
        self.P = read(np.array(document["evidence"]["matrix"], dtype=object))

    def slope(self, plant: Document, x: np.ndarray, room: Document, load: Document) -> np.ndarray:
        """E^-1 f of a plant under the feedback."""
        E = np.array([truth.number(lump["capacity"]) for lump in plant["lumps"].values()])
        currents = dict(zip(plant["modules"], self.I0 + self.F @ (x - self.x0), strict=True))
        return truth.heat(plant, x, currents, room, load) / E

    def jacobian(self, plant: Document, x: np.ndarray, room: Document, load: Document) -> np.ndarray:
        eye = 1e-30j * np.eye(len(x))
        return np.array([self.slope(plant, x + row, room, load).imag / 1e-30 for row in eye]).T

    def rest(self, plant: Document, room: Document, load: Document) -> np.ndarray:
        """Equilibrium by Newton's method from x0."""
        x = self.x0.copy()
        for _ in range(30):
            x = x - np.linalg.solve(self.jacobian(plant, x, room, load), self.slope(plant, x, room, load))
        return x


def make_scheduled(rng: np.random.Generator) -> Document:
    system = truth.random_system(rng, modules=1, nonlinear=bool(rng.random() < 0.3))
    n, (name,) = len(system["lumps"]), system["modules"]
    current, room = float(rng.uniform(0.1, 0.5)), {"room": 298.0}
    system["gain"] = np.round(0.02 * rng.standard_normal((1, n)), 4).tolist()
    system["operating"] = {"temperature": dict.fromkeys(system["lumps"], 298.0), "current": {name: round(current, 3)}}
    document: Document = {"system": system, "evidence": {"matrix": np.eye(n).tolist()}}
    x = Law(document).rest(system, room, {})
    if not np.abs(x - 298).max() < 60:
        return make_scheduled(rng)
    system["operating"]["temperature"] = dict(zip(system["lumps"], np.round(x, 9).tolist(), strict=True))
    law = Law(document)
    A = law.jacobian(system, law.x0, room, {})
    decay = -np.linalg.eigvals(A).real.max()
    if not decay > 0:
        return make_scheduled(rng)
    P = solve_continuous_lyapunov((A + 0.5 * decay * np.eye(n)).T, -np.eye(n))
    P = np.round((P + P.T) / 2 / np.abs(P).max(), 8)
    W, width = np.linalg.inv(P), 0.3
    room_of = min((10.0**2 / np.diag(W)).min(), width**2 / (law.F @ W @ law.F.T)[0, 0])
    spread, more = (0.3, 10.0) if rng.random() < 0.4 else (0.0, 0.001)
    region: Document = {
        "temperature": {key: [float(value - 10.5), float(value + 10.5)] for key, value in
                        zip(system["lumps"], law.x0, strict=True)},
        "current": {name: [float(law.I0[0] - width), float(law.I0[0] + width)]}, "level": float(0.98 * room_of),
        "rate": float(decay * rng.choice([0.2, 0.4])), "offset": more,
        "ambient": {"room": [298 - spread, 298 + spread]}}
    if rng.random() < 0.3:
        region["heat"] = {str(rng.choice(list(system["lumps"]))): [-0.02, 0.02]}
        region["offset"] = 10.0
    if rng.random() < 0.3:
        system["links"][0]["name"] = "first"
        g = system["links"][0]["conductance"]
        region |= {"parameters": {"links.first.conductance": [0.99 * g, 1.01 * g]}, "offset": 10.0}
    document = {"kind": "scheduled", "system": system, "region": region, "evidence": {"matrix": P.tolist()}}
    return document if holds("scheduled", document) else make_scheduled(rng)


def break_scheduled(document: Document, rng: np.random.Generator) -> float:
    """How far samples on the ellipsoid leave the box, grow, or rest elsewhere; relative."""
    region, law = document["region"], Law(document)
    T, I = truth.boxes(document["system"], region)  # noqa: E741 - the current
    level, rate, offset = (truth.number(region[key]) for key in ("level", "rate", "offset"))
    values = np.linalg.eigvalsh((law.P + law.P.T) / 2)
    if values[0] <= 0 or level <= 0 or np.any(law.P != law.P.T):
        return 1.0
    W = np.linalg.inv(law.P)
    root, worst, n = np.linalg.cholesky(W), -np.inf, len(law.x0)
    reach = np.sqrt(level * np.diag(W)) / 10
    worst = max(worst, float(((law.x0 - T[:, 1]) / 10 + reach).max()), float(((T[:, 0] - law.x0) / 10 + reach).max()))
    swing = np.sqrt(level * np.einsum("ki,ij,kj->k", law.F, W, law.F))
    worst = max(worst, float((law.I0 + swing - I[:, 1]).max()), float((I[:, 0] - law.I0 + swing).max()))
    size = 1 + np.abs(law.jacobian(document["system"], law.x0, _middle(region, "ambient"), {})).max()
    for plant in plants(document, rng, 3):
        for _ in range(4):
            room, load = ({name: float(rng.choice([truth.number(value) for value in pair]))
                           for name, pair in region.get(key, {}).items()} for key in ("ambient", "heat"))
            d = rng.standard_normal((20, n))
            d /= np.linalg.norm(d, axis=1)[:, None]
            at_rest = law.rest(plant, room, load)
            worst = max(worst, float(np.abs(at_rest - law.x0).max()) - offset)
            for k, e in enumerate(np.sqrt(level) * d @ root.T):
                slope = law.slope(plant, law.x0 + e, room, load)
                worst = max(worst, float(2 * e @ law.P @ slope / level / size))
                inner = law.x0 + e * (k % 4 + 1) / 4 - at_rest
                V = inner @ law.P @ inner
                slope = law.slope(plant, at_rest + inner, room, load)
                worst = max(worst, float((2 * inner @ law.P @ slope + 2 * rate * V) / max(V, 1e-3 * level) / size))
    return worst


def _middle(region: Document, key: str) -> Document:
    return {name: sum(truth.number(value) for value in pair) / 2 for name, pair in region[key].items()}


SUBJECTS = (Subject("scheduled", make_scheduled, break_scheduled, tolerance=1e-6),)
