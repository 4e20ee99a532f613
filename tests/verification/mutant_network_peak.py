"""Certificates of kind "network_peak" that just hold; falsifier: eigenvectors on a dense grid of times."""

from __future__ import annotations

import certificate_truth as truth
import numpy as np
from mutants import Document, holds
from scipy.sparse import coo_array

import robthermal as rt

_LINEAR, _GEOMETRIC = 2000, 400  # times


def network(rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Return capacities and a symmetric network of random conductances, some of them to the surroundings."""
    A = np.triu(np.round(rng.uniform(0.1, 2, (n, n)), 3) * (rng.random((n, n)) < 0.5), 1)
    A[np.arange(n - 1), np.arange(1, n)] += 0.25
    A += A.T
    loss = np.round(rng.uniform(0.1, 1, n), 3) * (rng.random(n) < 0.5)
    return np.round(rng.uniform(1, 20, n), 2), A - np.diag(A.sum(axis=1) + loss)


def trajectory(E: np.ndarray, A: np.ndarray, lump: int, start: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Return the temperature of one lump by the eigenvectors of E^-1 A."""
    rates, vectors = np.linalg.eig(A / E[:, None])
    parts = vectors[lump] * np.linalg.solve(vectors, start.astype(complex))
    with np.errstate(over="ignore"):
        return np.asarray((np.exp(np.outer(times, rates)) @ parts).real)


def make(rng: np.random.Generator) -> Document:
    """Return a certificate at the bound the search finds."""
    n = int(rng.integers(2, 9))
    E, A = network(rng, n)
    start = np.round(rng.uniform(-5, 20, n), 2) * (rng.random(n) < 0.6)
    lump, horizon = int(rng.integers(n)), round(10 ** float(rng.uniform(-1, 2)), 3)
    found = rt.certify.network_peak(E, coo_array(A), lump, start, horizon)
    if not found.holds:  # a lump that is coldest, for ever below the surroundings
        return make(rng)
    document = {"kind": "network_peak",
                "system": {key: np.asarray(value).tolist() for key, value in found.system.items()},
                "region": {**found.region, "start": start.tolist()},
                "evidence": {"degree": found.evidence["degree"], "edges": list(found.evidence["edges"])}}
    return document if holds("network_peak", document) else make(rng)


def violation(document: Document, rng: np.random.Generator) -> float:
    """Return by how much the warmest start exceeds the bound, relative."""
    system, region = document["system"], document["region"]
    E, values, start = (np.array([truth.number(value) for value in part]) for part in
                        (system["capacity"], system["values"], region["start"]))
    A = np.zeros((len(E), len(E)))
    A[system["rows"], system["cols"]] = values
    horizon, bound = truth.number(region["horizon"]), truth.number(region["bound"])
    times = np.union1d(np.linspace(0, horizon, _LINEAR), np.geomspace(1e-9, 1, _GEOMETRIC) * horizon)
    largest = np.max(trajectory(E, A, region["lump"], start, times))
    return float(largest / bound - 1) if np.isfinite(largest) else np.inf
