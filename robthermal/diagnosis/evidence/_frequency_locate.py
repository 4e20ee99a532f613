"""Where data and model part in frequency: element and band; and how far, on records and responses alike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..._fitting import Data, rmse
from ..data import ResponseData
from ..fit import Refit, Whitened, start_of
from ..path import AlongResponse

Array = NDArray[np.float64]
_BANDS = 5


def bands(fit: Refit) -> tuple[str, ...]:
    """The band with the largest misfit of every element of every frequency response, in words.

    Parameters
    ----------
    fit : Refit
        From `refit`.

    Returns
    -------
    tuple of str
        One sentence per element.
    """
    out = []
    for z, path in zip(fit.innovations(), fit.paths, strict=True):
        if isinstance(path, AlongResponse):
            power = (z**2).reshape(2, -1, z.shape[1]).mean(axis=0)
            out += [_worst(name, path.one.frequencies, column)
                    for name, column in zip(path.one.sensors, power.T, strict=True)]
    return tuple(out)


def _worst(name: str, frequencies: Array, power: Array) -> str:
    edges = np.geomspace(frequencies[0], frequencies[-1] * (1 + 1e-12), _BANDS + 1)
    place = np.clip(np.searchsorted(edges, frequencies, side="right") - 1, 0, _BANDS - 1)
    means = [float(power[place == b].mean()) if np.any(place == b) else 0.0 for b in range(_BANDS)]
    worst = int(np.argmax(means))
    return (f"{name}: largest between {edges[worst]:.3g} and {edges[worst + 1]:.3g} Hz, {means[worst]:.3g} times the "
            "noise power there")


def response_rms(fit: Refit, data: Sequence[Data | ResponseData]) -> float:
    """Whitened root mean square on frequency responses the fit has not seen [standard deviations of their noise]."""
    own = tuple(one for one in data if isinstance(one, ResponseData))
    structure = replace(fit.structure, data=own, starts=tuple(start_of(fit.system, one) for one in own))
    known = fit.structure.n_parameters + fit.structure.n_effects
    z = Whitened(structure, [one.white for one in own]).residual(fit.v[:known])
    return rmse([z[:structure.n_readings]])
