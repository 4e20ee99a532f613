"""The problem of a loop certificate, as its proofs take it."""

from __future__ import annotations

from dataclasses import dataclass

from flint import fmpq

from ._observer import Sensor
from ._system import Region, ThermalSystem
from ._uncertain import Parameters

Rows = tuple[tuple[fmpq, ...], ...]


@dataclass(frozen=True)
class Controller:
    """v = C z + D x, z+ = A z + B x + windup (achieved - v), set-points apart."""

    A: Rows
    B: Rows
    C: Rows
    D: Rows
    windup: Rows


@dataclass(frozen=True)
class Loop:
    """The exact problem of one loop certificate."""

    system: ThermalSystem
    region: Region
    controller: Controller
    sample_time: fmpq
    plant: str
    drift: fmpq | None
    contraction: fmpq
    margin: fmpq
    matrix: Rows
    pieces: int
    weights: tuple[fmpq, ...]
    sizes: tuple[fmpq, ...]
    parameters: Parameters = ()
    start: tuple[Rows, ...] = ()
    sensors: tuple[Sensor, ...] | None = None
    gain: Rows = ()
