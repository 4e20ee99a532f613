"""Effect: one kind of physics that a model may lack, all that is known about it in one object."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from ...errors import InputError
from .._system import System
from ._builders import Builder
from ._response import Signature, Values, Where

Add = Callable[[System, Where, Values], System]
Grid = tuple[float, ...] | Callable[[Any, Where], Sequence[float]]  # of a `TrialContext`, or a `RecordContext`
LAST = 10_000  # place in the catalog of an effect that asks for none


def _visible(system: System, where: Where) -> str:
    """A frequency response can show the effect: no reason why not.

    Parameters
    ----------
    system : System
        System without the effect.
    where : tuple of str
        Place of the effect.
    """
    return ""


def _any(system: System, where: Where) -> float:
    """Readings of any range [K] may show the effect.

    Parameters
    ----------
    system : System
        System without the effect.
    where : tuple of str
        Place of the effect.
    """
    return 0.0


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
        Values tried when candidates are scored, or ``grid(record, where)`` that finds them. For a size it is empty if
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
    """One kind of missing physics. Make your own, then pass it to `rt.diagnosis.register_effect`.

    Parameters
    ----------
    name : str
        Name as in ``diagnosis.json``.
    places : callable
        System to the `where` tuples at which the effect is possible and not yet present.
    quantities : tuple of Quantity
        The first is the size: 0 when the effect is absent. The others shape it.
    add : callable
        ``add(system, where, values)`` returns the system with the effect; `values` has every quantity.
    signature : callable, optional
        ``signature(record, where, values)`` returns the `Response` of the readings per unit of the size, linearized
        along the simulated record. Default: a small effect is added and the record simulated again (slower).
    confused_with : tuple of str
        Effects with a similar signature.
    separated_by : str
        The excitation that separates them.
    paired : str
        An angle among the quantities, with the grid (0, π/2): any other is a combination of these two.
    where : tuple of str
        Kinds of the parts that it names, in order: "module", "lump", "ambient", "link", "sensor", "input",
        "input or module" or "lump or ambient"; empty for an effect of your own.
    meaning : str
        One sentence that says what physics it is.
    measure : str
        What to measure instead where no input separates it; ``{0}`` stands for the first part of `where`.
    nonnegative : tuple of str
        Quantities that a system refuses below zero.
    units : mapping
        Units of quantities that are more general in a system than in the search.
    hidden : callable
        ``hidden(system, where)`` says why a frequency response cannot show the effect; empty if it can.
    span : callable
        ``span(system, where)``: range of the readings [K] from which it is tried; in a smaller one another effect is
        as good.
    forms : tuple of Effect
        Further forms of the same effect under the same name.
    rank : int
        Place in the catalog: of effects whose signatures are the same, the first is named.

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
    >>> rt.thermal.effects()["lead_heating"].where
    ('lump', 'module')
    """

    name: str
    places: Callable[[System], Iterable[Where]]
    quantities: tuple[Quantity, ...]
    add: Add | Builder
    signature: Signature | None = None
    confused_with: tuple[str, ...] = ()
    separated_by: str = ""
    paired: str = ""
    where: tuple[str, ...] = field(default=(), kw_only=True)
    meaning: str = field(default="An effect of your own.", kw_only=True)
    measure: str = field(default="", kw_only=True)
    nonnegative: tuple[str, ...] = field(default=(), kw_only=True)
    units: Mapping[str, str] = field(default_factory=dict, kw_only=True)
    hidden: Callable[[System, Where], str] = field(default=_visible, kw_only=True)
    span: Callable[[System, Where], float] = field(default=_any, kw_only=True)
    forms: tuple[Effect, ...] = field(default=(), kw_only=True)
    rank: int = field(default=LAST, kw_only=True)

    @property
    def size(self) -> Quantity:
        """The quantity that is zero when the effect is absent."""
        return self.quantities[0]

    @property
    def free(self) -> tuple[Quantity, ...]:
        """Quantities that a refit estimates."""
        return tuple(q for q in self.quantities if q.lower < q.upper)

    @property
    def all_forms(self) -> Iterator[Effect]:
        """The effect, then its further forms."""
        yield self
        yield from self.forms

    @property
    def parameters(self) -> dict[str, str]:
        """Quantity of any form to its unit."""
        return {q.name: self.units.get(q.name, q.unit) for form in self.all_forms for q in form.quantities}

    @property
    def sizes(self) -> tuple[str, ...]:
        """Quantities that are zero when the effect is absent (a clip: when it is left out), one per form."""
        return tuple(form.size.name for form in self.all_forms)


def check_effect(effect: Effect) -> None:
    """Refuse an effect that cannot work.

    Parameters
    ----------
    effect : Effect
        Effect of a user.

    Raises
    ------
    InputError
        Not an effect, no quantity, a quantity without trial values, a size that cannot be zero.
    """
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
