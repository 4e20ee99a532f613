"""Two usual ways to guess what is missing, on the same data: residual correlation, and regression on derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.signal import savgol_filter

import robthermal as rt

from .plants import H

WINDOW, DEGREE = 15, 3  # samples, Savitzky-Golay
THRESHOLD = 0.25  # of STLSQ, as a share of the largest contribution
Name = tuple[str, tuple[str, ...]]
Column = tuple[str, tuple[str, ...], int, np.ndarray]  # effect, where, lump, heat [W]


def peers(found: rt.diagnosis.Diagnosis, truth: Sequence[Sequence[Any]]) -> dict[str, Any]:
    """First guesses of both, from the refitted nominal model and its simulated faces.

    `expressible` says whether the library of the regression holds what was hidden.
    """
    terms, library = regression(found)
    return {"correlation": correlation(found), "regression": terms,
            "expressible": any((name, tuple(where)) in library for name, where, *_ in truth)}


def correlation(found: rt.diagnosis.Diagnosis) -> list[Any]:
    """Candidate whose change of the readings correlates best with the free-run residual, nothing projected off."""
    path, residual = found.nominal.paths[0], found.nominal.residuals[0]
    residual = residual / residual.std(axis=0)
    best: tuple[float, list[Any]] = (0.0, [])
    for candidate in found.scores.candidates:
        assert candidate.effect.signature is not None
        change = path.readings_of([candidate.effect.signature(path, candidate.where, candidate.shape)])[..., 0]
        change = change / found.nominal.residuals[0].std(axis=0)
        length = float(np.linalg.norm(change))
        if length > 0:
            cosine = abs(float(np.sum(change * residual))) / length / float(np.linalg.norm(residual))
            best = max(best, (cosine, [candidate.effect.name, list(candidate.where)]))
    return best[1]


def regression(found: rt.diagnosis.Diagnosis) -> tuple[list[list[Any]], list[Name]]:
    """SINDy-style: derivative of the readings less the nominal rate, regressed on library heats by STLSQ.

    Lumps without a sensor are simulated with the nominal model. Returns all terms kept, the largest first, and
    the whole library.
    """
    system, path = found.nominal.system, found.nominal.paths[0]
    measured = {sensor.lump: path.one.readings[:, path.one.sensors.index(name)]
                for name, sensor in system.sensors.items()}
    T = path.x[:, :len(system.lumps)].copy()
    slopes = {}
    for lump, readings in measured.items():
        T[:, system.lump_names.index(lump)] = savgol_filter(readings, WINDOW, DEGREE)
        slopes[system.lump_names.index(lump)] = savgol_filter(readings, WINDOW, DEGREE, deriv=1, delta=H)
    equations = rt.thermal.Equations(system)
    record = path.one.record
    u = np.column_stack([record[name] for name in system.exogenous_names])
    rate = equations.heat(T, u)
    rows = list(slopes)
    y = np.concatenate([equations.capacity[i] * slopes[i] - rate[:, i] for i in rows])
    grouped: dict[Name, np.ndarray] = {}
    for effect, where, lump, heat in _library(system, T, record, rows):
        column = grouped.setdefault((effect, where), np.zeros(len(y)))
        column[rows.index(lump) * len(T):(rows.index(lump) + 1) * len(T)] += heat
    return [[name, list(where)] for name, where in _stlsq(grouped, y)], list(grouped)


def _library(system: rt.System, T: np.ndarray, record: rt.Record, rows: list[int]) -> list[Column]:
    """Heats into measured lumps that a thermal engineer would offer."""
    names, out = list(system.lump_names), []
    for i in rows:
        lump = names[i]
        out.append(("heat_source", (lump,), i, np.ones(len(T))))
        for ambient in system.ambients:
            Ta = record[ambient]
            dT = Ta - T[:, i]
            out += [("missing_ambient_link", (lump, ambient), i, dT),
                    ("natural_convection", (lump, ambient), i, np.abs(dT) ** 0.25 * dT),
                    ("radiation", (lump, ambient), i, 1e-9 * (Ta**4 - T[:, i] ** 4))]
        out += [("missing_link", tuple(sorted((lump, other), key=names.index)), i, T[:, j] - T[:, i])
                for j, other in enumerate(names) if j != i]
        out.append(("condensation", (lump,), i, np.maximum(0.0, np.median(T[:, i]) - T[:, i])))
        out += [("lead_heating", (lump, module), i, record[module] ** 2) for module in system.modules]
        for heater, part in system.inputs.items():
            if part.lump == lump:
                out.append(("heater_power_slope", (heater,), i, record[heater] * (T[:, i] - 298.15)))
                out.append(("input_saturation", (heater,), i, -record[heater] ** 3))
            else:
                out.append(("input_feedthrough", (heater, lump), i, np.asarray(record[heater])))
    joined = {frozenset(link.between) for link in system.links if link.conductance > 0}
    return [column for column in out if column[0] not in ("missing_link", "missing_ambient_link")
            or frozenset(column[1]) not in joined]


def _stlsq(columns: dict[Name, np.ndarray], y: np.ndarray) -> list[Name]:
    """Sequentially thresholded least squares on columns of unit length; keys kept, the largest first."""
    keys = list(columns)
    X = np.column_stack([columns[key] / np.linalg.norm(columns[key]) for key in keys])
    keep, c = np.ones(len(keys), bool), np.zeros(len(keys))
    for _ in range(10):
        c[:] = 0.0
        c[keep] = np.linalg.lstsq(X[:, keep], y, rcond=1e-8)[0]
        new = np.abs(c) >= THRESHOLD * np.abs(c).max()
        if (new == keep).all():
            break
        keep = new
    return [keys[i] for i in np.argsort(-np.abs(c)) if keep[i]]
