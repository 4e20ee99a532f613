"""Means of samples: late or early against the mean over the step, by up to half a sample of the logger.

The mean of m samples at the beginnings of the m parts of a step is the mean over the step h, λ h earlier, λ = 1/(2m):

    M(t - λ h) = M(t) - λ h M'(t) + O(λ²),    h M'(t) = x(t) - x(t - h).

With samples at the ends of the parts it is as much later. How many samples a mean has is nowhere in a log, so that λ is
an unknown of every record of means.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...thermal import System

Array = NDArray[np.float64]
LATE_MEANS = "means.late"  # the unknown, beside numbers of the system


def late_means(system: System, sensors: Sequence[str], readings: Array, lumps: Array) -> Array:
    """Change of the readings where means are late, per step, (n, n_sensors) [K].

    The first mean is of a step that the record does not hold.

    Parameters
    ----------
    system : System
        Model beside the record.
    sensors : sequence of str
        Sensors of the record.
    readings : ndarray, shape (n, n_sensors)
        Modelled means of these [K].
    lumps : ndarray, shape (n, n_lumps)
        Simulated temperatures at the samples [K].
    """
    out = -np.gradient(readings, axis=0)
    for column, name in enumerate(sensors):
        sensor = system.sensors[name]
        if not sensor.time_constant and not sensor.delay:
            out[1:, column] = -sensor.gain * np.diff(lumps[:, system.lump_names.index(sensor.lump)])
    out[0] = 0.0
    return out
