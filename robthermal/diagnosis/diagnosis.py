"""Diagnosis: what was found, how sure it is, and what to do next."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._digits import probability
from .._html import short_table
from ..errors import Outcome
from ..thermal import System
from ._changed import Compared
from ._differing import Differing
from ._file import write_json
from ._found import Found
from ._judge import Name, Verdict
from ._refinement import Refinement
from .data import NoiseEstimate
from .effects import Candidate
from .evidence import Adequacy, Gap, HoldOut, Location, Remainder, Scores, UnknownHeat
from .fit import FoundAmbient, Refit
from .plan import NextExperiment, Resolving
from .search import Accepted, JointCheck, ruled_out


@dataclass(frozen=True, eq=False, kw_only=True)
class Diagnosis:
    """Result of `diagnose`.

    Parameters
    ----------
    verdict : {"named", "named_with_remainder", "ambiguous", "consistent", "unexplained"}
        One set of effects explains the records down to the noise; one set is reproducibly better than every other, and
        something is left beyond the noise; several sets are; nothing is missing; nothing known explains them.
    effects : tuple of Found
        In order of acceptance; empty unless named or ambiguous.
    alternatives : tuple of tuple
        For every effect, the (effect, where) the records cannot exclude; beside "named_with_remainder" the same heat
        path at neighboring lumps.
    system : System
        Nominal parameters refitted, with the effects added.
    gap : dict
        `Gap` of "train" and, if given, "validation".
    located : Location
        Where the nominal system's misfit sits.
    not_testable : dict
        What these records could not have shown, by (effect, where), with the reason.
    next_experiment : NextExperiment or None
        What separates the alternatives; None if there are none.
    outcome : Outcome
        Code as the verdict; not ok if ambiguous or unexplained.
    provisional : tuple of Found
        Effects that helped but do not explain everything: no names.
    noise_floor, nominal, fit, scores, rounds, adequacy, hold_out
        Results of the stages.
    joint : JointCheck or None
        Two effects or more compared with a selection of all at once; None with fewer.
    unknown_heat : UnknownHeat or None
        If nothing known explains the records: the heat into the most suspect lump that would; None otherwise.
    remainder : Remainder or None
        What is left beyond the noise; None if nothing is.
    resolving : Resolving or None
        Which sensor, which input and which lump to split would resolve the remainder; None without one.
    reference : Compared or None
        What the records of the healthy machine say; None without any.
    refinement : Refinement or None
        What splitting a lump does to the remainder, if it was asked for and there is one; the rest of the answer is of
        the network as it is.
    means : str
        How else the log may be read, as means over a step or with its commands in another row, where that explains as
        much or more; else empty.
    caveats : tuple of str
        What to hold against a name, a sentence each; the outcome's text has them too.
    nearest : str
        Where nothing is named: what came nearest, what it takes off the error, and why it is no name; empty if nothing
        did. The outcome's text has it, too.
    differing : Differing or None
        That a common fit does not reach noise because numbers of the machine differ from record to record; with a name,
        the answer is that of the first record, which all others test. None where a common fit is about as good.
    ambients : tuple of FoundAmbient
        Ambients that a training record does not hold, as its readings say them; `system` keeps its own.
    """

    verdict: Verdict
    effects: tuple[Found, ...]
    alternatives: tuple[tuple[Name, ...], ...]
    system: System
    gap: dict[str, Gap]
    located: Location
    not_testable: dict[Name, str]
    next_experiment: NextExperiment | None
    outcome: Outcome
    provisional: tuple[Found, ...]
    noise_floor: NoiseEstimate
    nominal: Refit
    fit: Refit
    scores: Scores
    rounds: tuple[Accepted, ...]
    adequacy: Adequacy
    hold_out: HoldOut | None
    joint: JointCheck | None = None
    unknown_heat: UnknownHeat | None = None
    remainder: Remainder | None = None
    resolving: Resolving | None = None
    reference: Compared | None = None
    refinement: Refinement | None = None
    means: str = ""
    caveats: tuple[str, ...] = ()
    nearest: str = ""
    differing: Differing | None = None
    ambients: tuple[FoundAmbient, ...] = ()

    @property
    def ruled_out(self) -> tuple[Candidate, ...]:
        """Effects that only training and validation records together exclude."""
        return ruled_out(self.rounds)

    def __str__(self) -> str:
        lines = [f"verdict: {self.verdict}"]
        for found, others in zip(self.effects, self.alternatives, strict=True):
            lines.append(f"  {found.label}: {found.quantities}   ΔBIC {found.delta_bic:.1f}, "
                         f"{probability(found.p_value)}")
            lines += [f"    or {effect}({', '.join(where)})" for effect, where in others]
        for name, gap in self._gaps():
            lines.append(f"{name}: rms {gap.before:.4g} before, {gap.after:.4g} after, {gap.noise:.4g} noise "
                         f"[{gap.unit}]")
        silent = len(self.not_testable)
        lines.append(f"could not have been seen: {silent} candidate{'s' * (silent != 1)}")
        lines += [] if self.refinement is None else [f"finer network: {self.refinement}"]
        return "\n".join([*lines, str(self.outcome)])

    def _repr_html_(self) -> str:
        rows: list[tuple[str, str]] = [("verdict", self.verdict)]
        rows += [(found.label, found.quantities) for found in self.effects]
        rows += [(f"rms, {name}", f"{gap.before:.4g} before, {gap.after:.4g} after, {gap.noise:.4g} noise [{gap.unit}]")
                 for name, gap in self._gaps()]
        return short_table("Diagnosis", rows, str(self.outcome))

    def _gaps(self) -> list[tuple[str, Gap]]:
        """As they are printed: between two days nothing was trained on the new records."""
        return [("new" if name == "train" and self.reference is not None else name, gap)
                for name, gap in self.gap.items()]

    def plot(self) -> NDArray[Any]:
        """Residuals of the first training record [K, V], or response, before and after; returns the matplotlib axes."""
        from matplotlib import pyplot as plt  # heavy, only when a picture is wanted

        _, axes = plt.subplots(2, 1, sharex=True, sharey=True, layout="constrained")
        for ax, fit, what in zip(axes, (self.nominal, self.fit), ("before", "after"), strict=True):
            fit.paths[0].draw(ax, fit.residuals[0])
            ax.set(title=f"{what}: rms {fit.rms:.3g} {fit.unit}")
        axes[0].legend(fontsize="small")
        axes[0].set(xlabel="")
        return np.asarray(axes)

    def to_dict(self) -> dict[str, Any]:
        """What ``diagnosis.json`` holds.

        Returns
        -------
        dict
        """
        plan = self.next_experiment
        return {
            "format": "robthermal-diagnosis/2",
            "verdict": self.verdict,
            "effects": [found.to_dict() for found in self.effects],
            "alternatives": [[{"effect": effect, "where": list(where)} for effect, where in others]
                             for others in self.alternatives],
            "located": {"lumps": self.located.lumps, "sensors": self.located.sensors,
                        "conditions": "; ".join(self.located.conditions)},
            "gap": {name: vars(gap) for name, gap in self.gap.items()},
            "not_testable": [{"effect": effect, "where": list(where), "why": why}
                             for (effect, where), why in self.not_testable.items()],
            "next_experiment": {} if plan is None else {
                "advice": plan.advice, "expected_delta_bic": plan.expected, "present_delta_bic": plan.present,
                "sample_time": plan.record.sample_time,
                **({} if plan.measurement is None else {"measure": vars(plan.measurement)}),
                "inputs": {name: plan.record[name].tolist() for name in plan.record.input_names}},
            "provisional": [found.to_dict() for found in self.provisional],
            "remainder": None if self.remainder is None else self.remainder.to_dict(),
            "resolving": None if self.resolving is None else self.resolving.to_dict(),
            "ambients": list(map(_with_unit, self.ambients)),
            "outcome": vars(self.outcome),
            **{key: one.to_dict() for key, one in
               (("reference", self.reference), ("differing", self.differing), ("refinement", self.refinement),
                ("unknown_heat", self.unknown_heat)) if one is not None},
        }

    def save(self, path: str | Path) -> None:
        """Write ``diagnosis.json``.

        Parameters
        ----------
        path : str or Path
            File to write.
        """
        write_json(path, self.to_dict())


def _with_unit(one: FoundAmbient) -> dict[str, Any]:
    return {**vars(one), "warmest": one.warmest if math.isfinite(one.warmest) else None, "unit": "K"}
