"""What the reference records of a comparison name is added to the model first, where that is asked for.

A remainder of the healthy machine hides small changes and stands in for large ones; an effect that its records name by
themselves takes it away. One day is diagnosed and predicts the others: a common fit to several days leaves what
conductances differ by from day to day, and no effect of the catalog explains that.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Protocol

from ..errors import InputError
from ..fitting import Choice
from ..thermal import System
from ._found import Found
from ._judge import Name, Verdict
from ._with_names import with_fitted
from .data import Measured
from .evidence import Gap


class Answer(Protocol):
    """The part of a diagnosis that is looked at here."""

    @property
    def verdict(self) -> Verdict:
        """How it ended."""

    @property
    def effects(self) -> tuple[Found, ...]:
        """What it names."""

    @property
    def alternatives(self) -> tuple[tuple[Name, ...], ...]:
        """The same at neighboring places."""

    @property
    def gap(self) -> dict[str, Gap]:
        """Before and after."""


class Diagnosed(Protocol):
    """Diagnoses a system."""

    def __call__(self, system: System, records: Sequence[Measured], /, *, validation: Sequence[Measured] | None
                 ) -> Answer:
        """Names what records lack, tested on validation records."""


@dataclass(frozen=True, eq=False)
class Augmented:
    """What a diagnosis of the reference records alone has added to the model of a comparison.

    Parameters
    ----------
    verdict : str
        Of that diagnosis.
    effects : tuple of Found
        What it added: all that it names, unless the records cannot tell it from something else.
    without, rms : float
        Free-run residual of the first reference record, to which it was fitted, without and with these effects [K].
    system : System
        Nominal system with these effects.
    parameters : iterable or mapping, optional
        What is fitted in it, as in `rt.diagnose`.
    alternatives : tuple of tuple
        For every effect the same at neighboring places, as in `Diagnosis.alternatives`.

    Examples
    --------
    >>> import robthermal as rt
    >>> late = rt.diagnosis.Found("sensor_lag", ("T3",), {"time_constant": (30.0, 1.0, "s")}, 1e-9, 400.0)
    >>> nominal = rt.systems.two_module()
    >>> more = rt.diagnosis.with_named_effects(nominal, [late])
    >>> added = rt.diagnosis.Augmented("named", (late,), 0.42, 0.05, more)
    >>> print(added)
    The reference records alone name sensor_lag(T3): it is in the model of this comparison and in the system of the \
answer; what it leaves of the first one falls from 0.42 to 0.05 K.
    """

    verdict: Verdict
    effects: tuple[Found, ...]
    without: float
    rms: float
    system: System
    parameters: Choice = None
    alternatives: tuple[tuple[Name, ...], ...] = ()

    def __str__(self) -> str:
        if self.effects:
            names = " and ".join(map(self._named, range(len(self.effects))))
            several = len(self.effects) > 1
            return (f"The reference records alone name {names}: {'they are' if several else 'it is'} in the model of "
                    f"this comparison and in the system of the answer; what it leaves of the first one falls from "
                    f"{self.without:.2g} to {self.rms:.2g} K.")
        why = {"consistent": "lack nothing that they could show", "unexplained": "do not say what is missing",
               "ambiguous": "cannot tell what is missing from something else",
               }.get(self.verdict, "name what no system can have")
        return f"The reference records alone {why}: the model of this comparison has no effect added."

    def _named(self, place: int) -> str:
        """An effect; with other places where the records cannot tell them apart."""
        others = self.alternatives[place] if self.alternatives else ()
        label = self.effects[place].label
        if not others:
            return label
        listed = " or ".join(f"{name}({', '.join(at)})" for name, at in others)
        return f"{label} (or {listed})"

    def to_dict(self) -> dict[str, Any]:
        """What ``diagnosis.json`` holds under "augmented" of "reference".

        Returns
        -------
        dict
        """
        return {"verdict": self.verdict, "effects": [one.to_dict() for one in self.effects],
                "alternatives": [[{"effect": name, "where": list(at)} for name, at in others]
                                 for others in self.alternatives],
                "rms_without": self.without, "rms": self.rms}


def augmented(system: System, reference: Sequence[Measured], parameters: Choice, diagnosed: Diagnosed) -> Augmented:
    """Diagnose the reference records alone, and add to the model what they name.

    Parameters
    ----------
    system : System
        Nominal system, which gets what is named.
    reference : sequence of Record
        Of the healthy machine.
    parameters : iterable or mapping, optional
        Nominal parameters that are fitted.
    diagnosed : callable
        ``diagnosed(system, records, validation=...)`` diagnoses.
    """
    found = diagnosed(system, reference[:1], validation=reference[1:] or None)
    gap = found.gap["train"]
    if found.verdict in ("named", "named_with_remainder"):
        with suppress(InputError):  # a drift of an ambient, which no system has
            return Augmented(found.verdict, found.effects, gap.before, gap.after,
                             *with_fitted(system, found.effects, parameters), found.alternatives)
    return Augmented(found.verdict, (), gap.before, gap.before, system, parameters)
