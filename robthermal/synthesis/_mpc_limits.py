"""Limits of a predictive controller: rows of states and controls together, and bounds of the currents by a function."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .._arrays import Array
from .._checks import quoted
from ..errors import InputError

Bounds = Callable[[Array], Any]
_KEYS = ("control", "state", "rows")


@dataclass(frozen=True)
class Limits:
    """G x + H u <= g, and control bounds ``function(x)``, (low, high), where they are no constants; words per row."""

    G: Array
    H: Array
    g: Array
    words: tuple[str, ...]
    function: Bounds | None

    def with_controls(self, low: Array, high: Array) -> Limits:
        """The same with constant bounds of the controls added."""
        n, m = self.G.shape[1], self.H.shape[1]
        G, H, g, words = _box(low, high, n, m, "control")
        return Limits(np.vstack([self.G, G]), np.vstack([self.H, H]), np.concatenate([self.g, g]),
                      (*self.words, *words), self.function)

    def bounds(self, x: Array) -> tuple[Array, Array]:
        """Low and high of the controls at a state, by the function."""
        m = self.H.shape[1]
        if self.function is None:
            return np.full(m, -np.inf), np.full(m, np.inf)
        low, high = _pair(self.function(x), m, "limits of the controls at a state")
        if not (low <= high).all():
            raise InputError(f"bounds {quoted(low.tolist())} to {quoted(high.tolist())}",
                             where=f"limits of the controls at state {quoted(np.asarray(x).tolist())}",
                             expected="low at most high")
        return low, high


def read_limits(limits: Any, n: int, m: int) -> Limits:
    """Limits of x and u in deviations from the operating point, which lies inside all of them."""
    where = "argument limits"
    if callable(limits):
        limits = {"control": limits}
    elif not isinstance(limits, Mapping):
        size = _vector(limits, m, where)
        limits = {"control": (-size, size)}
    if not limits or any(key not in _KEYS for key in limits):
        raise InputError(f"limits = {quoted(limits)}", where=where,
                         expected=f"numbers for the controls, a function of the state, or a mapping with {list(_KEYS)}")
    found = Limits(np.zeros((0, n)), np.zeros((0, m)), np.zeros(0), (), None)
    parts = [found]
    if "state" in limits:
        parts.append(Limits(*_box(*_pair(limits["state"], n, f"{where}['state']"), n, m, "state"), None))
    if "rows" in limits:
        parts.append(_rows(limits["rows"], n, m))
    function = limits.get("control") if callable(limits.get("control")) else None
    if "control" in limits and function is None:
        parts.append(Limits(*_box(*_pair(limits["control"], m, f"{where}['control']"), n, m, "control"), None))
    whole = Limits(np.vstack([one.G for one in parts]), np.vstack([one.H for one in parts]),
                   np.concatenate([one.g for one in parts]), sum((one.words for one in parts), ()), function)
    if not len(whole.g) and function is None:
        raise InputError("no finite limit", where=where, expected="at least one",
                         remedy="Without limits the optimal control is linear: control.dlqr.")
    if not (whole.g > 0).all():
        first = whole.words[int(np.argmin(whole.g))]
        raise InputError(f"the operating point, x = 0 and u = 0, is not strictly inside {first}", where=where,
                         expected="limits in deviations from the operating point")
    return whole


def _rows(value: Any, n: int, m: int) -> Limits:
    where = "argument limits['rows']"
    try:
        G, H, g = (np.asarray(part, float) for part in value)
    except (TypeError, ValueError):
        G, H, g = np.zeros((1, 0)), np.zeros((1, 0)), np.zeros(1)
    if G.ndim != 2 or G.shape != (len(G), n) or H.shape != (len(G), m) or g.shape != (len(G),) or not len(G) or not (
            np.isfinite(np.hstack([G, H])).all() and np.isfinite(g).all()):
        raise InputError(f"rows = {quoted(value)}", where=where,
                         expected=f"(G, H, g) of finite numbers, shapes (k, {n}), (k, {m}), (k,): G x + H u <= g")
    return Limits(G, H, g, tuple(f"row {k} of limits" for k in range(len(g))), None)


def _box(low: Array, high: Array, n: int, m: int, what: str) -> tuple[Array, Array, Array, tuple[str, ...]]:
    """Rows of a box of states or controls; infinite ends are left out."""
    eye = np.eye(len(low))
    rows, bounds = np.vstack([eye, -eye]), np.concatenate([high, -low])
    words = [f"the {side} of {what} {k}" for side in ("upper limit", "lower limit") for k in range(len(low))]
    kept = np.flatnonzero(np.isfinite(bounds))
    zero = np.zeros((len(kept), m if what == "state" else n))
    G, H = (rows[kept], zero) if what == "state" else (zero, rows[kept])
    return G, H, bounds[kept], tuple(words[k] for k in kept)


def _pair(value: Any, size: int, where: str) -> tuple[Array, Array]:
    if not isinstance(value, (list, tuple, np.ndarray)) or len(value) != 2:
        raise InputError(f"{quoted(value)} is no pair", where=where, expected="(low, high)")
    return _vector(value[0], size, where), _vector(value[1], size, where)


def _vector(value: Any, size: int, where: str) -> Array:
    try:
        found = np.broadcast_to(np.asarray(value, float), (size,)).astype(float)
    except (TypeError, ValueError):
        found = np.full(size, np.nan)
    if np.isnan(found).any():
        raise InputError(f"{quoted(value)}", where=where, expected=f"one number or {size}")
    return found
