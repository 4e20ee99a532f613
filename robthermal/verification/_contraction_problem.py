"""The problem of a contraction certificate, as its methods take it."""

from __future__ import annotations

from dataclasses import dataclass

from flint import fmpq

from ._heaters import Heater
from ._system import Region, ThermalSystem
from ._uncertain import Parameters


@dataclass(frozen=True)
class Contraction:
    """The exact problem of one contraction certificate."""

    system: ThermalSystem
    region: Region
    method: str
    rate: fmpq
    margin: fmpq
    weights: tuple[fmpq, ...]
    matrix: tuple[tuple[fmpq, ...], ...]
    parameters: Parameters = ()
    heaters: tuple[Heater, ...] = ()
