"""Effect: one kind of physics that a model may lack, and how it would show."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...thermal import System
from ._response import Response, Seen

if TYPE_CHECKING:
    from ..path import Along

Array = NDArray[np.float64]
Where = tuple[str, ...]
Add = Callable[[System, Where, Mapping[str, float]], System]
Grid = tuple[float, ...] | Callable[[Any, Where], Sequence[float]]  # of an `Along` or `AlongResponse`
Signature = Callable[["Along", Where, Mapping[str, float]], Response]


@dataclass(frozen=True)
class Quantity:
    """A number of an effect.

    Parameters
    ----------
    name, unit : str
        For example ``"conductance"``, ``"W/K"``.
    lower, upper : float
        What is physically possible; the same number twice: known.
    grid : tuple of float or callable
        Values tried when candidates are scored, or ``grid(along, where)`` that finds them. For a size it is empty if
        the readings are nearly linear in it.
    typical : float
        Size that is certainly small enough to be linear, for effects without a signature of their own.

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.diagnosis.Quantity("conductance", "W/K", 0.0, 100.0).lower
    0.0
    """

    name: str
    unit: str
    lower: float
    upper: float
    grid: Grid = ()
    typical: float = 1e-3


@dataclass(frozen=True)
class Effect:
    """One kind of missing physics. Make your own, then pass it to `register_effect`.

    Parameters
    ----------
    name : str
        As in ``diagnosis.json``.
    places : callable
        System to the `where` tuples at which the effect is possible and not yet present.
    quantities : tuple of Quantity
        The first is the size: 0 when the effect is absent. The others shape it.
    add : callable
        ``add(system, where, values)`` returns the system with the effect; `values` has every quantity.
    signature : callable, optional
        ``signature(along, where, values)`` returns the `Response` of the readings per unit of the size, linearised
        along the simulated record. Default: a small effect is added and the record simulated again (slower).
    confused_with : tuple of str
        Effects with a similar signature.
    separated_by : str
        The excitation that tells them apart.
    paired : str
        An angle among the quantities, with the grid (0, π/2): any other is a combination of these two.

    Examples
    --------
    A sensor that reports late, in ten lines:

    >>> import robthermal as rt
    >>> late = rt.diagnosis.Effect(
    ...     name="sensor_delay",
    ...     places=lambda system: [(name,) for name, s in system.sensors.items() if not s.delay],
    ...     quantities=(rt.diagnosis.Quantity("delay", "s", 0.0, 60.0, typical=0.5),),
    ...     add=lambda system, where, q: system.with_parameters({f"sensors.{where[0]}.delay": q["delay"]}),
    ...     confused_with=("sensor_lag",), separated_by="frequencies above 0.3/delay")
    >>> late.size.unit
    's'
    """

    name: str
    places: Callable[[System], Iterable[Where]]
    quantities: tuple[Quantity, ...]
    add: Add
    signature: Signature | None = None
    confused_with: tuple[str, ...] = ()
    separated_by: str = ""
    paired: str = ""

    @property
    def size(self) -> Quantity:
        """The quantity that is zero when the effect is absent."""
        return self.quantities[0]

    @property
    def free(self) -> tuple[Quantity, ...]:
        """Quantities that a refit estimates."""
        return tuple(q for q in self.quantities if q.lower < q.upper)


@dataclass(frozen=True)
class Candidate:
    """An effect at a place, with trial values of the quantities that shape it.

    Parameters
    ----------
    effect : Effect
        What.
    where : tuple of str
        Parts of the system it acts on.
    shape : dict
        Trial values of the quantities that have a grid.
    """

    effect: Effect
    where: Where
    shape: dict[str, float] = field(default_factory=dict)

    @property
    def key(self) -> tuple[str, Where]:
        """What makes two candidates the same name."""
        return self.effect.name, self.where

    @property
    def label(self) -> str:
        """For tables: ``sensor_lag(T6)``."""
        return f"{self.effect.name}({', '.join(self.where)})"

    def add(self, system: System, size: float) -> System:
        """System with this effect at its trial values.

        Parameters
        ----------
        system : System
            Without it.
        size : float
            Value of the effect's first quantity.

        Returns
        -------
        System
        """
        return self.effect.add(system, self.where, {**self.shape, self.effect.size.name: size})

    def trials(self, path: Seen) -> list[Candidate]:
        """The same with every combination of trial values, for one record.

        Parameters
        ----------
        path : Along or AlongResponse
            Simulated record, or frequency response.

        Returns
        -------
        list of Candidate
        """
        gridded = [q for q in self.effect.quantities if q.grid]
        values = [_possible(q, q.grid(path, self.where) if callable(q.grid) else q.grid, path) for q in gridded]
        return [replace(self, shape=dict(zip([q.name for q in gridded], combination, strict=True)))
                for combination in product(*values)]


def _possible(quantity: Quantity, grid: Sequence[float], path: Seen) -> list[float]:
    """Trial values; times only if the record can resolve them."""
    if quantity.unit != "s" or callable(quantity.grid):
        return list(grid)
    longest = path.span / 3
    return [value for value in grid if path.h / 2 <= value <= longest]


def check_effect(effect: Effect) -> None:
    """Refuse an effect that cannot work."""
    if not isinstance(effect, Effect):
        raise InputError(f"effect is a {type(effect).__name__}", where="argument effect",
                         expected="a robthermal.diagnosis.Effect")
    if not effect.quantities:
        raise InputError(f"effect {effect.name!r} has no quantity", where="argument effect",
                         expected="at least its size", remedy="Give quantities=(Quantity(...),).")
    for quantity in effect.quantities[1:]:
        if not quantity.grid:
            raise InputError(f"quantity {quantity.name!r} of effect {effect.name!r} has no grid",
                             where="argument effect", expected="trial values of every quantity but the size",
                             remedy="Give Quantity(..., grid=(10.0, 40.0, 160.0)).")
    if not effect.size.lower <= 0.0 <= effect.size.upper:
        raise InputError(f"the size of effect {effect.name!r} cannot be 0", where="argument effect",
                         expected="lower <= 0 <= upper: at 0 the effect is absent")
