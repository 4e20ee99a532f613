"""What the verdict asks of measured data and of a diagnosis: plain facts that can be kept in a file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..._celsius import ZERO_CELSIUS
from ...calibration import Estimates
from ...diagnosis import Diagnosis
from ...signals import Record
from ...thermal import System
from ..certify import converged
from ._misfit import Misfit
from ._result import Comparison


@dataclass(frozen=True)
class DataFacts:
    """Measured data beside the model.

    Parameters
    ----------
    kinds : tuple of str
        "train" and "validation", as far as there are such data.
    misfits : tuple of Misfit
        How far the model is from every reading of every record.
    inputs : dict
        Range of every input [unit], module current [A] and ambient [K] in the records.
    constant : tuple of str
        Inputs, currents and ambients that never change in the records that were fitted.
    readings : tuple of float or None
        Coldest and hottest reading of sensors and ambients [K]; None without records.
    silent : tuple of str
        Measured sensors whose noise is not stated.
    resampled : tuple of str
        Files whose samples were not on a uniform grid.
    unrecorded : tuple of str
        Ambients that some record does not hold, and that are not calibrated, with what they were taken to be.
    stopped : str
        What happened where the calibration ended before it converged; empty otherwise.
    """

    kinds: tuple[str, ...] = ()
    misfits: tuple[Misfit, ...] = ()
    inputs: Mapping[str, tuple[float, float]] | None = None
    readings: tuple[float, float] | None = None
    silent: tuple[str, ...] = ()
    resampled: tuple[str, ...] = ()
    constant: tuple[str, ...] = ()
    unrecorded: tuple[str, ...] = ()
    stopped: str = ""

    def currents(self, system: System) -> dict[str, tuple[float, float]]:
        """Range of every module's current in the records [A]; empty without records.

        Parameters
        ----------
        system : System
            With the modules.
        """
        return {name: (self.inputs or {}).get(name, (0.0, 0.0)) for name in system.modules if self.readings}


@dataclass(frozen=True)
class DiagnosisFacts:
    """Result of a diagnosis, as far as the verdict asks for it.

    Parameters
    ----------
    verdict : str
        "named", "ambiguous", "consistent" or "unexplained".
    names : str
        Effects with what could not be told from them, in words; what the readings say of an ambient that they lack.
    adopted : bool
        Whether the certified system has them.
    """

    verdict: str
    names: str
    adopted: bool = False


def data_facts(system: System, comparisons: Sequence[Comparison], misfits: Sequence[Misfit],
               kinds: Sequence[str] = (), fit: Estimates | None = None) -> DataFacts:
    """Facts about records beside a model.

    Parameters
    ----------
    system : System
        Model of the comparisons.
    comparisons : sequence of Comparison
        One per record.
    misfits : sequence of Misfit
        Of the same records.
    kinds : sequence of str
        Kinds of data that are no records.
    fit : Estimates or None
        Calibration of the model; None if nothing was calibrated.
    """
    records = [one.record for one in comparisons]
    names = dict.fromkeys(name for record in records for name in record.input_names)
    sensors = dict.fromkeys(name for record in records for name in record.output_names)
    ends = [_range(records, name) for name in (
        *(name for name in sensors if system.sensor_units.get(name, "K") == "K"),
        *(name for name in names if name in system.ambients))]
    actions = [(report.file, action["what"]) for record in records if (report := record.imported)
               for action in report.actions]
    return DataFacts(
        tuple(dict.fromkeys([*(one.kind for one in comparisons), *kinds])), tuple(misfits),
        {name: _range(records, name) for name in names},
        (min(low for low, _ in ends), max(high for _, high in ends)) if ends else None,
        tuple(name for name in sensors if name in system.sensors and not system.sensors[name].noise),
        tuple(dict.fromkeys(file for file, what in actions if what == "resampled")), _constant(comparisons),
        _unrecorded(system, records, fit),
        "" if converged(fit) else str(fit.outcome) if fit else "")


def _unrecorded(system: System, records: Sequence[Record], fit: Estimates | None) -> tuple[str, ...]:
    """Ambients that some record does not hold and that are not calibrated, with what they were taken to be."""
    fitted = [] if fit is None else [one for name in fit.parameters for one in name.split(" = ")]
    return tuple(f"{name}, taken to be {ambient.temperature - ZERO_CELSIUS:.4g} °C" for name, ambient
                 in system.ambients.items() if f"ambients.{name}.temperature" not in fitted
                 and any(name not in record.input_names for record in records))


def _constant(comparisons: Sequence[Comparison]) -> tuple[str, ...]:
    """Where nothing was fitted, of the records that there are."""
    fitted = [one.record for one in comparisons if one.kind == "train"] or [one.record for one in comparisons]
    names = dict.fromkeys(name for record in fitted for name in record.input_names)
    return tuple(name for name in names if len(set(_range(fitted, name))) == 1)


def diagnosis_facts(found: Diagnosis, adopted: bool = False) -> DiagnosisFacts:
    """Facts about a diagnosis.

    Parameters
    ----------
    found : Diagnosis
        What was found.
    adopted : bool
        Whether the certified system has the effects.
    """
    if found.verdict == "consistent" and found.caveats:  # an ambient far from what the system says, or something else
        return DiagnosisFacts("ambiguous", " ".join(found.caveats).rstrip("."), adopted)
    names = ", ".join(" or ".join([effect.label, *(f"{name}({', '.join(where)})" for name, where in others
                                                   if (name, where) != (effect.effect, effect.where))])
                      for effect, others in zip(found.effects, found.alternatives, strict=True))
    return DiagnosisFacts(found.verdict, names, adopted)


def _range(records: Sequence[Record], name: str) -> tuple[float, float]:
    values = [record[name] for record in records if name in (*record.input_names, *record.output_names)]
    ends = [(float(np.nanmin(v)), float(np.nanmax(v))) for v in values if np.isfinite(v).any()]
    return (min(a for a, _ in ends), max(b for _, b in ends)) if ends else (0.0, 0.0)
