"""Stage 9: the input, within limits, that best separates what the records could not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..calibration._data import Data
from ..errors import Diverged
from ..signals import Record
from ..thermal import simulate
from ._refit import Refit, filters, whitened
from ._score import columns
from ._short_list import Entry

Array = NDArray[np.float64]
_DWELLS = (4, 10, 30, 100)  # samples
_ENOUGH = 20.0  # expected ΔBIC that makes a name nearly certain


@dataclass(frozen=True, eq=False)
class NextExperiment:
    """What to measure next.

    Parameters
    ----------
    record : Record
        Inputs to apply; its outputs are what the best candidate predicts [K].
    expected : float
        Expected squared distance of the closest two candidates on it, nominal parameters profiled out: about the ΔBIC.
    present : float
        The same of the present records' inputs.
    pairs : dict
        Expected distance of every pair, by labels.
    advice : str
        In words.
    """

    record: Record
    expected: float
    present: float
    pairs: dict[tuple[str, str], float]
    advice: str

    def __str__(self) -> str:
        return self.advice

    def plot(self) -> Any:
        """Plot the inputs to apply; returns the matplotlib axes."""
        return self.record.plot()


def next_experiment(entries: Sequence[Entry], *, trials: int = 16, seed: int = 0) -> NextExperiment:
    """Find an input that separates candidates.

    Linearised T-optimality (Hunter and Reiner 1965) with the nominal parameters profiled out: the smallest over the
    pairs of β² ‖J'‖² (1 - c²) is made as large as `trials` random staircases within the limits allow.

    Parameters
    ----------
    entries : sequence of Entry
        Two candidates or more that the records cannot tell apart.
    trials : int
        Random inputs tried.
    seed : int
        Of the random numbers.

    Returns
    -------
    NextExperiment

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 100.0}},
    ...                 links=[{"between": ("bar", "room"), "conductance": 0.5}],
    ...                 inputs={"heater": {"lump": "bar", "limits": (0.0, 8.0)}},
    ...                 sensors={"T": {"lump": "bar", "noise": 0.05}})
    >>> heater = np.repeat([4.0, 0.0, 6.0, 2.0], 50)
    >>> drive = rt.Record(sample_time=10.0, inputs=heater, outputs=np.zeros((200, 0)), input_names=["heater"],
    ...                   output_names=[])
    >>> run = rt.thermal.simulate(bar.with_parameters({"sensors.T.time_constant": 30.0}), drive)
    >>> noisy = run.with_outputs(run.outputs + 0.05 * np.random.default_rng(1).standard_normal((200, 1)))
    >>> fit = rt.diagnosis.refit(bar, noisy)
    >>> short = rt.diagnosis.refit_short_list(fit, rt.diagnosis.score(fit), length=3)
    >>> plan = rt.diagnosis.next_experiment(short.entries[:2], trials=4)
    >>> plan.expected > plan.present
    True
    """
    best = entries[0]
    rng = np.random.default_rng(seed)
    one = best.fit.structure.data[0]
    present = separations(entries, one.record)
    tried = []
    for number in range(trials):
        record = staircase(best.fit, one, _DWELLS[number % len(_DWELLS)], rng)
        try:
            found = separations(entries, record)
        except Diverged:
            continue
        tried.append((min(found.values()), number, found, record))
    now = min(present.values())
    if not tried:
        return NextExperiment(one.record, now, now, present, "Every trial input runs away: set limits of the inputs.")
    expected, _, pairs, record = max(tried, key=lambda item: item[:2])
    hints = {entry.candidate.effect.separated_by for entry in entries if entry.candidate.effect.separated_by}
    advice = (f"Apply the inputs of this plan: expected ΔBIC {expected:.0f} between the closest two candidates "
              f"(the present inputs: {now:.0f})." if expected > _ENOUGH else
              f"No input within the limits separates them well (expected ΔBIC {expected:.0f}); try: "
              f"{'; '.join(sorted(hints))}.")
    return NextExperiment(simulate(best.fit.system, record), expected, now, pairs, advice)


def staircase(fit: Refit, one: Data, dwell: int, rng: np.random.Generator) -> Record:
    """Random steps of every input within its limits (of the record where none are declared); ambients as measured."""
    record, system = one.record, fit.system
    limits = {**system.input_limits, **system.current_limits}
    inputs = np.array(record.inputs, float)
    n = len(record)
    for column, name in enumerate(record.input_names):
        if name in limits:
            low, high = limits[name] or (float(inputs[:, column].min()), float(inputs[:, column].max()))
            steps = rng.uniform(low, high, n // dwell + 2)
            inputs[:, column] = np.repeat(steps, dwell)[:n]
    return Record(sample_time=record.sample_time, inputs=inputs, outputs=record.outputs,
                  input_names=record.input_names, output_names=record.output_names, name="next experiment")


def separations(entries: Sequence[Entry], record: Record) -> dict[tuple[str, str], float]:
    """Squared distance of every pair of candidates on a record, in whitened units, nominal parameters profiled out."""
    fit = entries[0].fit
    one = fit.structure.data[0]
    trial = Data(record, one.sensors, one.columns, one.readings)
    own = replace(fit.structure, data=(trial,), starts=fit.structure.starts[:1])
    bare = own.with_effects(fit.structure.effects[:-1])
    v = bare.start(fit.structure.ranges.values(fit.v[:bare.n_parameters]), fit.structure.quantities(fit.v)[:-1])
    paths, whiteners = filters(bare, v, fit.floor, fit.levels)
    J0 = whitened(bare, v, whiteners)[1]
    signatures, sizes = [], []
    for entry in entries:
        value = entry.values
        shape = {name: value[name][0] for name in entry.candidate.shape}
        signatures.append(columns(paths[0], [replace(entry.candidate, shape=shape)]))
        sizes.append(value[entry.candidate.effect.size.name][0])
    J = np.zeros((len(J0), len(entries)))
    J[:trial.readings.size] = whiteners[0](np.concatenate(signatures, axis=2)).reshape(-1, len(entries)) * sizes
    scale = np.linalg.norm(J0, axis=0)
    U, s, _ = np.linalg.svd(J0 / np.where(scale > 0, scale, 1.0), full_matrices=False)
    U = U[:, s > 1e-9 * s[0]]
    J = J - U @ (U.T @ J)
    out = {}
    for i, j in combinations(range(len(entries)), 2):
        a, b = J[:, i], J[:, j]
        cos2 = float(a @ b) ** 2 / max(float(a @ a) * float(b @ b), 1e-300)
        out[entries[i].candidate.label, entries[j].candidate.label] = min(float(a @ a), float(b @ b)) * (1.0 - cos2)
    return out
