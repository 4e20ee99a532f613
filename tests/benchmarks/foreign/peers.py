"""Two other ways to choose a name, on the same data: residual correlation, and empirical model discrepancy.

Rene and Longtin (2025), as their supplement defines the process of quantile paths: a model A with the quantile function
q* of its pointwise loss where it holds, and q of the loss on the data, is expected to have the loss functions of a
process with center q and metric variance c (q - q*)² in every dyadic refinement. A is falsified by B if B has the
smaller expected loss in 95 % of the draws. The scale c is theirs to calibrate; here it is varied.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import brentq, root
from scipy.special import polygamma, psi
from scipy.stats import chi2

import robthermal as rt

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from blind.peers import correlation  # noqa: E402 - beside this package

from .field import Array  # noqa: E402

LEVELS, DRAWS, SURE = 6, 400, 0.95
SCALES = (2.0**-8, 2.0**-6, 2.0**-4, 2.0**-2, 1.0, 4.0)  # of c


def beta_of(r: float, v: float) -> tuple[float, float]:
    """Parameters of a beta distribution whose center divides 1 as r : 1, with the metric variance v / 2."""
    start = brentq(lambda x: np.log(2.0 * polygamma(1, np.exp(x))) - np.log(v), -6.0, 21.0)

    def unlike(x: Array) -> Array:
        a, b = np.exp(np.clip(x, -7.0, 25.0))
        return np.array([psi(a) - psi(b) - np.log(r), np.log(polygamma(1, a) + polygamma(1, b)) - np.log(v)])

    a, b = np.exp(root(unlike, [start, start]).x)
    return float(a), float(b)


def risks(loss: Array, c: float, rng: np.random.Generator) -> Array:
    """Expected losses (draws,) of a model with losses ½ z²: q* is half a chi-squared quantile."""
    level = np.linspace(0.0, 1.0, 2**LEVELS + 1)
    q = np.quantile(loss, level)
    held = 0.5 * chi2.ppf(np.clip(level, 0.5 / loss.size, 1.0 - 0.5 / loss.size), 1)
    apart = np.abs(q - held)
    paths = np.empty((DRAWS, q.size))
    ends = q[[0, -1]] + np.sqrt(c) * apart[[0, -1]] * rng.standard_normal((DRAWS, 2))
    paths[:, 0], paths[:, -1] = np.clip(ends.min(axis=1), 0.0, None), ends.max(axis=1)
    for step in (2**n for n in range(LEVELS - 1, -1, -1)):
        for k in range(step, q.size - 1, 2 * step):
            before, after = max(q[k] - q[k - step], 1e-12), max(q[k + step] - q[k], 1e-12)
            a, b = beta_of(before / after, float(np.clip(2.0 * c * apart[k] ** 2, 1e-6, 1e4)))
            share = rng.beta(a, b, DRAWS)
            paths[:, k] = paths[:, k - step] + share * (paths[:, k + step] - paths[:, k - step])
    return np.asarray(np.trapezoid(paths, level, axis=1))


def unfalsified(losses: Sequence[Array], c: float, seed: int = 1) -> list[int]:
    """Models that none of the others is expected to beat in 95 % of the draws."""
    rng = np.random.default_rng(seed)
    drawn = [risks(loss, c, rng) for loss in losses]
    below = np.array([[np.mean(a[:, None] < b) for b in drawn] for a in drawn])
    return [i for i in range(len(losses)) if not np.any(np.delete(below[:, i], i) >= SURE)]


def choices(system: rt.System, train: rt.Record) -> dict[str, Any]:
    """First guess of residual correlation; what empirical discrepancy leaves of the best seven names and none."""
    nominal = rt.diagnosis.refit(system, train)
    scores = rt.diagnosis.score(nominal)
    short = rt.diagnosis.refit_short_list(nominal, scores)
    noise = np.array([system.sensors[name].noise for name in nominal.paths[0].one.sensors])
    fits = [nominal, *(entry.fit for entry in short.entries)]
    names: list[Any] = [None, *([entry.candidate.effect.name, list(entry.candidate.where)] for entry in short.entries)]
    losses = [0.5 * (fit.structure.paths(fit.v)[0].residual / noise).ravel() ** 2 for fit in fits]
    found = type("Found", (), {"nominal": nominal, "scores": scores})()
    return {"correlation": correlation(found), "best score": names[1] if len(names) > 1 else None,
            "discrepancy": {str(c): [names[i] for i in unfalsified(losses, c)] for c in SCALES}}
