"""Stage 6: name the effect, or the set of effects that the records cannot distinguish, or nothing."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ..evidence import ALPHA, BIC_GAP, SURE, reproducible
from ..fit import Refit, fitted
from ._short_list import Entry, ShortList, refiltered

_CONTENDERS = 60.0  # ΔBIC behind the best within which a candidate is refitted with the renewed filters


@dataclass(frozen=True, eq=False)
class Decision:
    """What one round of the search found.

    Parameters
    ----------
    before : Refit
        Fit without the new effect.
    best : Entry or None
        Best candidate, noise levels and filters renewed; None if no effect is beyond doubt.
    contenders : tuple of Entry
        Others whose BIC is within 10 of the best: the records cannot exclude them.
    ruled_out : tuple of Entry
        Those among them that the validation records exclude.
    """

    before: Refit
    best: Entry | None = None
    contenders: tuple[Entry, ...] = ()
    ruled_out: tuple[Entry, ...] = ()

    @property
    def alarm(self) -> bool:
        """Whether any effect is beyond doubt: p < 0.01 for the family and ΔBIC > 10."""
        return self.best is not None

    def __str__(self) -> str:
        if self.best is None:
            return "no candidate is beyond doubt"
        names = [self.best.candidate.label, *(c.candidate.label for c in self.contenders)]
        names += [c.label for entry in (self.best, *self.contenders) for c in entry.aliases]
        return f"{' or '.join(dict.fromkeys(names))}, ΔBIC {self.best.delta_bic:.1f}"

    def plot(self, ax: Any = None) -> Any:
        """Bars of ΔBIC of best and contenders; returns the matplotlib axes.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Axes to draw into; default new ones.
        """
        entries = () if self.best is None else (self.best, *self.contenders)
        return ShortList(self.before, entries, {}).plot(ax)


@dataclass(frozen=True, eq=False)
class Accepted(Decision):
    """A round that found an effect beyond doubt.

    Parameters
    ----------
    before : Refit
        Fit without the new effect.
    best : Entry
        Accepted candidate, noise levels and filters renewed.
    contenders : tuple of Entry
        Others whose BIC is within 10 of the best: the records cannot exclude them.
    ruled_out : tuple of Entry
        Those among them that the validation records exclude.
    beaten : tuple of Entry
        Others whose BIC is within 60 of the best: excluded beside the other effects as they are.
    """

    best: Entry = field(kw_only=True)
    beaten: tuple[Entry, ...] = ()


def decide(short: ShortList) -> Decision:
    """Decide on a short list.

    Parameters
    ----------
    short : ShortList
        Refitted candidates, from `refit_short_list`.

    Returns
    -------
    Decision
        `Accepted` if an effect is beyond doubt.

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 100.0}},
    ...                 links=[{"between": ("bar", "room"), "conductance": 0.5}], inputs={"heater": {"lump": "bar"}},
    ...                 sensors={"T": {"lump": "bar", "noise": 0.05}})
    >>> heater = np.repeat([4.0, 0.0, 6.0, 2.0], 50)
    >>> drive = rt.Record(sample_time=10.0, inputs=heater, outputs=np.zeros((200, 0)), input_names=["heater"],
    ...                   output_names=[])
    >>> run = rt.thermal.simulate(bar.with_parameters({"sensors.T.time_constant": 30.0}), drive)
    >>> noisy = run.with_outputs(run.outputs + 0.05 * np.random.default_rng(1).standard_normal((200, 1)))
    >>> fit = rt.diagnosis.refit(bar, noisy)
    >>> short = rt.diagnosis.refit_short_list(fit, rt.diagnosis.score(fit), length=3)
    >>> rt.diagnosis.decide(short).best.candidate.label
    'sensor_lag(T)'
    """
    sure = [entry for entry in short.entries if entry.p_value < ALPHA and entry.delta_bic > BIC_GAP]
    if not sure:
        return Decision(short.before)
    return settled(short.before, short.entries)


def settled(before: Refit, entries: tuple[Entry, ...]) -> Accepted:
    """Renew filters and noise levels at the best entry, refit those near it, and compare again."""
    best = entries[0]
    renewed = fitted(best.fit.structure, best.fit.v, best.fit.floor, best.fit.levels)
    near = [entry for entry in entries if best.delta_bic - entry.delta_bic < _CONTENDERS]
    again = sorted(refiltered(before, renewed, near), key=lambda entry: -entry.delta_bic)
    winner = again[0]
    others = tuple(entry for entry in again[1:] if _as_good(entry, winner))
    beaten = tuple(entry for entry in again[1:] if entry not in others)
    if winner.fit.structure is best.fit.structure:
        winner = Entry(winner.candidate, renewed, best.delta_bic, winner.p_value, winner.twins)
    else:
        own = fitted(winner.fit.structure, winner.fit.v, winner.fit.floor, winner.fit.levels)
        gain = next(e.delta_bic for e in entries if e.candidate.key == winner.candidate.key)
        winner = Entry(winner.candidate, own, gain, winner.p_value, winner.twins)
    for entry in (*others, *beaten):
        entry.fit.without_derivatives()
    return Accepted(before, best=winner, contenders=others, beaten=beaten)


def _as_good(entry: Entry, winner: Entry) -> bool:
    """Whether the records cannot exclude an entry; where the model is not exact the scatter over blocks decides too."""
    if winner.delta_bic - entry.delta_bic < BIC_GAP:
        return True
    return bool(winner.fit.structure.coarse) and reproducible(winner.fit, entry.fit) < SURE
