"""Inputs of a controller at a sample."""

from __future__ import annotations

from dataclasses import dataclass

from ._modules import Array


@dataclass(frozen=True)
class ControllerInput:
    """Inputs of a controller at a sample.

    Parameters
    ----------
    reference, cold : ndarray, shape (n_modules,)
        Set-points and temperatures of the cold faces [K].
    temperatures : ndarray, shape (n_lumps,)
        All lumps, measured or estimated [K].
    around : ndarray
        Values of `ColdSide.around`, measured.
    """

    reference: Array
    cold: Array
    temperatures: Array
    around: Array
