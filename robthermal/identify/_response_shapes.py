"""Shapes of everything a frequency response holds per bin."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from robthermal.errors import InputError


def shapes_of(n_y: int, n_u: int, n_f: int) -> dict[str, tuple[int, ...]]:
    """Shape of every array by its name, frequencies last."""
    return {
        "frequencies": (n_f,),
        "degrees_of_freedom": (n_f,),
        "suspect": (n_f,),
        "response": (n_y, n_u, n_f),
        "gram": (n_u, n_u, n_f),
        "covariance": (n_y * n_u, n_y * n_u, n_f),
        "noise_covariance": (n_y, n_y, n_f),
        "noise_variance": (n_y, n_f),
        "nonlinear_covariance": (n_y, n_y, n_f),
        "ratio_uncertainty": (n_y, n_u, n_f),
        "transient": (n_y, n_f),
        "coherence": (n_y, n_f),
    }


PER_BIN = tuple(shapes_of(1, 1, 1))


def check_shapes(arguments: Mapping[str, Any]) -> None:
    """Refuse arrays of another shape than names and frequencies say, and a response without any covariance."""
    if arguments["covariance"] is None and arguments["gram"] is None:
        raise InputError("neither covariance nor gram is given", where="covariance")
    n_y, n_u = len(arguments["output_names"]), len(arguments["input_names"])
    for name, shape in shapes_of(n_y, n_u, np.size(arguments["frequencies"])).items():
        value = arguments[name]
        if value is not None and not callable(value) and np.shape(value) != shape:
            raise InputError(f"{name} has shape {np.shape(value)}", where=name, expected=f"shape {shape}")
