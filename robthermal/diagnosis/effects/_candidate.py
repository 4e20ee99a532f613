"""Candidates: every effect of the catalog at every place of a system where it is possible."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from itertools import product

from ...errors import InputError
from ...thermal import System
from ...thermal.effects import Effect, Quantity, TrialContext, effects
from ._ambient_drift import LIKE, ambient_drift, as_slow, conductances
from ._scale import to_scale

Where = tuple[str, ...]


@dataclass(frozen=True)
class Candidate:
    """An effect at a place, with trial values of the quantities that shape it.

    Parameters
    ----------
    effect : Effect
        Effect of the catalog.
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
    def unknowns(self) -> tuple[str, Where, tuple[str, ...]]:
        """What makes their numbers the same ones: an effect may have several forms, each with its own."""
        return *self.key, tuple(quantity.name for quantity in self.effect.free)

    @property
    def label(self) -> str:
        """For tables: ``sensor_lag(T6)``."""
        return f"{self.effect.name}({', '.join(self.where)})"

    def add(self, system: System, size: float) -> System:
        """System with this effect at its trial values.

        Parameters
        ----------
        system : System
            System without the effect.
        size : float
            Value of the effect's first quantity.

        Returns
        -------
        System
        """
        return self.effect.add(system, self.where, {**self.shape, self.effect.size.name: size})

    def displaces(self, other: Candidate) -> bool:
        """Whether both take heat of one input to a lump, each to its own: a system has one of them at a time.

        Parameters
        ----------
        other : Candidate
            What has been added to a system.
        """
        return (self.effect.where == ("input", "lump") and self.effect.name == other.effect.name
                and self.where[0] == other.where[0] and self.where != other.where)

    def trials(self, context: TrialContext) -> list[Candidate]:
        """The same with every combination of trial values, for one record.

        Parameters
        ----------
        context : TrialContext
            Simulated record, or frequency response at its steady state.

        Returns
        -------
        list of Candidate
        """
        gridded = [q for q in self.effect.quantities if q.grid]
        values = [_possible(q, q.grid(context, self.where) if callable(q.grid) else q.grid, context) for q in gridded]
        return [replace(self, shape=dict(zip([q.name for q in gridded], combination, strict=True)))
                for combination in product(*values)]


def _possible(quantity: Quantity, grid: Sequence[float], context: TrialContext) -> list[float]:
    """Trial values; times only if the record can resolve them."""
    if quantity.unit != "s" or callable(quantity.grid):
        return list(grid)
    longest = context.span / 3
    return [value for value in grid if context.h / 2 <= value <= longest]


def chosen_effects(names: Iterable[str] | None) -> list[Effect]:
    """Effects by name in all their forms; all of them by default."""
    known = effects()
    names = list(known) if names is None else list(names)
    unknown = [name for name in names if name not in known]
    if unknown:
        raise InputError(f"there is no effect {unknown[0]!r}", where="argument effects",
                         expected="some of " + ", ".join(known),
                         remedy="Register your own with robthermal.diagnosis.register_effect.")
    return [form for name in names for form in known[name].all_forms]


def candidates(system: System, names: Iterable[str] | None = None, unrecorded: Sequence[str] = ()) -> list[Candidate]:
    """Every effect at every place where it is possible.

    Parameters
    ----------
    system : System
        Nominal system to search.
    names : iterable of str, optional
        Effects; default all.
    unrecorded : sequence of str
        Ambients that some record does not hold: where a periodic heat is tried, that they swing or drift is, too.

    Returns
    -------
    list of Candidate
        Without trial values; scoring tries the grid of each.

    Examples
    --------
    >>> import robthermal as rt
    >>> found = rt.diagnosis.candidates(rt.systems.two_module(), ["thomson", "seebeck_slope"])
    >>> [candidate.label for candidate in found if candidate.effect.name == "seebeck_slope"]
    ['seebeck_slope(m1)', 'seebeck_slope(m2)']
    """
    chosen = chosen_effects(names)
    found = [Candidate(_with_units(to_scale(effect, system), system, tuple(where)), tuple(where))
             for effect in chosen for where in effect.places(system)]
    if unrecorded and any(effect.name == LIKE for effect in chosen):
        return _with_drifts(found, system, unrecorded)
    return found


def _with_drifts(found: list[Candidate], system: System, unrecorded: Sequence[str]) -> list[Candidate]:
    """Candidates with those ambients that may swing or drift, and periodic heats beside them as slow as they are."""
    drift = ambient_drift()
    drifts = [Candidate(drift, where) for where in drift.places(system) if where[0] in unrecorded]
    joined = {lump for one in drifts for lump in conductances(system, one.where[0])}
    slow = [replace(one, effect=as_slow(one.effect)) if one.effect.name == LIKE and one.where[0] in joined else one
            for one in found]
    return slow + drifts


def _with_units(effect: Effect, system: System, where: tuple[str, ...]) -> Effect:
    """With the unit of the column it acts on, where that is known: A of a module, W of a heater with gain 1."""
    column = next((name for name in where if name in system.modules or name in system.inputs), "")
    heater = system.inputs.get(column)
    unit = "A" if column in system.modules else heater and (heater.unit or ("W" if heater.gain == 1.0 else None))
    if not unit or not any("unit" in quantity.unit for quantity in effect.quantities):
        return effect
    inside = f"({unit})" if "/" in unit else unit
    return replace(effect, quantities=tuple(
        replace(one, unit=unit if one.unit == "unit" else one.unit.replace("unit", inside))
        for one in effect.quantities))

