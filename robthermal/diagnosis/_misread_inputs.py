"""Rows of heaters and currents that the readings did not follow are left out, and said.

Docs: Measured files.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from ..fitting import measured_of, mended
from ..signals import Record
from ..thermal import System
from .data import Measured
from .diagnosis import Diagnosis

Data = Measured | Sequence[Measured] | None


@dataclass
class MisreadRows:
    """Rows of the inputs of a diagnosis that did not act: asked before it, and where that did not tell, after it.

    Parameters
    ----------
    system : System
        As the file describes it.
    records, validation, reference : Record, FrequencyResponse, list of them, or None
        As `diagnose` takes them.
    again : callable
        Diagnoses other records, with other validation and reference.
    doubted : tuple of str
        Of which rows the readings did not tell when they were asked last.
    replaced : bool
        Whether rows were left out.
    """

    system: System
    records: Data
    validation: Data
    reference: Data
    again: Callable[..., Diagnosis]
    doubted: tuple[str, ...] = ()
    replaced: bool = False

    def left_out(self, fitted: Callable[[list[Record]], System]) -> Diagnosis | None:
        """The answer without the rows that did not act, which says so; None if there are none.

        Parameters
        ----------
        fitted : callable
            Fits the system to records.
        """
        (old, _), (new, responses), (beside, beside_responses) = (
            ([], []) if data is None else measured_of(data, where)
            for data, where in ((self.reference, "reference"), (self.records, "records"),
                                (self.validation, "validation")))
        rows = mended(self.system, [*old, *new], beside, fitted)
        self.doubted, self.replaced = rows.doubted, bool(rows.said)
        if not rows.said:
            return None
        found = self.again(self.system, [*rows.records[len(old):], *responses],
                           validation=None if self.validation is None else [*rows.validation, *beside_responses],
                           reference=None if self.reference is None else rows.records[:len(old)])
        return _saying(found, rows.said)

    def left_out_beside(self, found: Diagnosis) -> Diagnosis:
        """The answer, with what is said of rows in doubt; without these, where its effects show that they did not act.

        Parameters
        ----------
        found : Diagnosis
            Answer about all rows.
        """
        if not self.doubted:
            return found
        return self.left_out(lambda held: found.fit.system) or _saying(found, self.doubted)


def _saying(found: Diagnosis, said: tuple[str, ...]) -> Diagnosis:
    """The answer that says what was replaced, or what is in doubt."""
    return replace(found, caveats=(*said, *found.caveats),
                   outcome=replace(found.outcome, text=" ".join([found.outcome.text, *said])))
