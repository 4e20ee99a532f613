"""How far a free run of the model is from a record."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._arrays import Floats
from ..fitting import Data, rmse_by_sensor


@dataclass(frozen=True)
class Score:
    """Free-run agreement with one record.

    Parameters
    ----------
    record : str
        Name of the record.
    rmse : dict
        Root mean square residual (measured − modelled) by sensor [K or V].
    fit_percent : dict
        100 (1 - ‖y - ŷ‖ / ‖y - mean y‖), by sensor [%], as in Matlab's `compare`; nan for a constant signal.
    """

    record: str
    rmse: dict[str, float]
    fit_percent: dict[str, float]


def score_of(one: Data, residual: Floats) -> Score:
    """Score of residuals (n, n_sensors) [K or V]."""
    by_sensor = {name: one.of_sensor(residual, i) for i, name in enumerate(one.sensors)}
    percent = {name: _percent(one.readings[:, i], residual[:, i]) for i, name in enumerate(one.sensors)}
    return Score(one.label, rmse_by_sensor([by_sensor]), percent)


def _percent(y: Floats, residual: Floats) -> float:
    spread = float(np.linalg.norm(y - y.mean()))
    return 100.0 * (1.0 - float(np.linalg.norm(residual)) / spread) if spread else float("nan")
