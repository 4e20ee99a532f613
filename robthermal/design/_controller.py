"""Outer loops in discrete time: what a controller sees, and what it must be able to do."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from ._modules import Array


@dataclass(frozen=True)
class Seen:
    """What a controller sees at a sample.

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


class Controller(Protocol):
    """An outer loop: heats v from what is seen; its state is one vector, advanced with the heat *achieved*."""

    @property
    def sample_time(self) -> float:
        """[s]."""

    def start(self, seen: Seen, heat: Array) -> Array:
        """State from which the output stays at `heat` while the reference is the temperature."""

    def heat(self, state: Array, seen: Seen) -> Array:
        """Wanted heats v [W]."""

    def advance(self, state: Array, seen: Seen, wanted: Array, achieved: Array) -> Array:
        """State at the next sample; wanted and achieved heats differ while a limit is active."""
