"""Stage 1: what sensor noise and random heat alone would leave."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._drawing import axes_for
from ...errors import InputError, Outcome
from ...fitting import Data, Measured, declared_noise, quantum, read_while_changing, smallest_noise
from ...thermal import System
from .._outcomes import DiagnosisCode
from ._glitches import counted
from ._measured import as_measured, records_of, responses_of
from ._remarks import quiet, remarks

Array = NDArray[np.float64]
SHORTEST = 50  # samples
_LONGER = ("Measure longer, or sample faster. Where missing values have cut a file into parts, "
           'gaps = "fill" under [record] of the system file bridges short gaps, and shortest = 50 leaves out short '
           "parts.")
_DIFFERENCE = np.array([1.0, -3.0, 3.0, -1.0])  # kills parabolas: what is left of a slow signal is its noise


@dataclass(frozen=True)
class NoiseEstimate:
    """Noise of the sensors and random heat of the lumps, before any model has been fitted.

    Parameters
    ----------
    noise : dict
        Standard deviation of every sensor in the records, in its unit.
    estimated : tuple of str
        Sensors whose noise was not declared, and was read off third differences of the record.
    disturbance : dict
        Declared random heat of every lump [W/√Hz].
    rough : dict
        Noise read off third differences, of every sensor in its unit; for comparison.
    outcome : Outcome
        Code "declared", "estimated" or "doubtful" (a declared noise far from what the record shows).
    glitches : dict
        Number of isolated outliers of every sensor that has any; no fit sees them.
    quantized : tuple of str
        Sensors whose steps are more than two standard deviations of their noise: their errors are no white noise.
    units : dict
        Unit of every sensor: "K", or "V" of a voltage; "-" of a frequency response, whose noise is relative.
    remarks : tuple of str
        What the records cannot show whatever the model, a sentence each: stuck, held or saturated readings, inputs that
        never change, restarts.
    quiet : bool
        Whether no thermometer ever leaves its noise: then nothing can be named.
    """

    noise: dict[str, float]
    estimated: tuple[str, ...]
    disturbance: dict[str, float]
    rough: dict[str, float]
    outcome: Outcome
    glitches: dict[str, int] = field(default_factory=dict)
    quantized: tuple[str, ...] = ()
    units: dict[str, str] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    quiet: bool = False

    def __str__(self) -> str:
        lines = [f"{'sensor':<12} {'noise':>10} {'differences':>12}  unit"]
        lines += [f"{name:<12} {level:>10.4g} {self.rough[name]:>12.4g}  {self.units.get(name, 'K')}"
                  for name, level in self.noise.items()]
        lines += [f"{name}: {n} isolated outliers left out" for name, n in self.glitches.items()]
        lines += [f"{name}: quantized; its errors count as noise of step/√12, and are not tested for whiteness"
                  for name in self.quantized]
        lines += self.remarks
        return "\n".join([*lines, str(self.outcome)])

    def plot(self, ax: Any = None) -> Any:
        """Bars of both noise levels; returns the matplotlib axes.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Axes to draw into; default new ones.
        """
        ax = axes_for(ax)
        place = np.arange(len(self.noise))
        ax.bar(place - 0.2, list(self.noise.values()), 0.4, label="used")
        ax.bar(place + 0.2, list(self.rough.values()), 0.4, label="third differences")
        units = [self.units.get(name, "K") for name in self.noise]
        labels = [f"{name} [{unit}]" if len(set(units)) > 1 else name
                  for name, unit in zip(self.noise, units, strict=True)]
        ax.set(xticks=place, xticklabels=labels, ylabel=f"noise [{', '.join(dict.fromkeys(units))}]", yscale="log")
        ax.legend()
        return ax


def noise_floor(system: System, records: Measured | Sequence[Measured], *,
                noise: Mapping[str, float] | float | None = None,
                operating_point: Mapping[str, float] | None = None) -> NoiseEstimate:
    """Find the noise of every sensor: declared, or else read off the record.

    Parameters
    ----------
    system : System
        With the declared `noise` of its sensors and `disturbance` of its lumps.
    records : Record, FrequencyResponse, or list of them
        Measured. Of a frequency response every element "output/input" is listed with its median relative standard
        deviation, as estimated with the response.
    noise : mapping or float, optional
        Overrides the declared noise [K, or V of a voltage].
    operating_point : mapping, optional
        As in `refit`.

    Returns
    -------
    NoiseEstimate

    Raises
    ------
    InputError
        Fewer than 50 samples; a noise that is neither declared nor visible.

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 100.0}},
    ...                 links=[{"between": ("bar", "room"), "conductance": 0.5}], sensors={"T": {"lump": "bar"}})
    >>> y = 295.0 + 0.02 * np.random.default_rng(0).standard_normal((400, 1))
    >>> record = rt.Record(sample_time=1.0, inputs=np.full(400, 295.0), outputs=y, input_names=["room"],
    ...                    output_names=["T"])
    >>> floor = rt.diagnosis.noise_floor(bar, record)
    >>> floor.outcome.code, round(floor.noise["T"], 3)
    ('estimated', 0.02)
    """
    measured = as_measured(system, records, "records", operating_point)
    relative = {name: float(level) for one in responses_of(measured)
                for name, level in zip(one.sensors, one.noise, strict=True)}
    data: list[Data] = [*records_of(measured)]
    if not data and noise is not None:
        raise InputError("noise is given with a frequency response", where="argument noise",
                         remedy="Leave it out: the response brings its covariance.")
    if not data:
        outcome = DiagnosisCode.ESTIMATED.outcome(
            "Noise of the elements as estimated with the frequency response, relative to its size.")
        return NoiseEstimate(relative, (), {}, relative, outcome, units=dict.fromkeys(relative, "-"))
    _refuse_short(data)
    levels = declared_noise(system, data, noise)
    rough = {name: _rough(data, name) for name in levels}
    unknown = tuple(name for name, level in levels.items() if not level)
    _refuse_invisible(system, {name: rough[name] for name in unknown})
    noise_of = {name: level or rough[name] for name, level in levels.items()}
    units = {name: system.sensors[name].unit for name in noise_of}
    disturbance = {name: lump.disturbance for name, lump in system.lumps.items()}
    clean = [one.without_outliers(system, noise_of) for one in records_of(measured)]
    return NoiseEstimate({**noise_of, **relative}, unknown, disturbance, {**rough, **relative},
                         _outcome(noise_of, rough, unknown, units), counted(system, clean),
                         _quantized(data, noise_of),
                         {**units, **dict.fromkeys(relative, "-")},
                         (*remarks(system, data, noise_of), *read_while_changing(system, clean)),
                         quiet(system, data, noise_of))


def _refuse_short(data: Sequence[Data]) -> None:
    for one in data:
        if len(one.record) < SHORTEST:
            raise InputError(f"the record {one.label!r} has {len(one.record)} samples", where="argument records",
                             expected=f"at least {SHORTEST}", remedy=_LONGER)


def _refuse_invisible(system: System, rough: Mapping[str, float]) -> None:
    """Noise that is not declared has to be visible."""
    for name, level in rough.items():
        if level < smallest_noise(system, name):
            raise InputError(f"the noise of sensor {name!r} is not declared, and none is visible in the record",
                             where=f"[sensors.{name}] noise",
                             expected=f"a positive standard deviation [{system.sensors[name].unit}]",
                             remedy="Declare it, or pass noise={...}: without it no misfit can be called large.")


def _outcome(noise: dict[str, float], rough: dict[str, float], unknown: tuple[str, ...], units: Mapping[str, str]
             ) -> Outcome:
    far = [name for name in noise if rough[name] and not 1 / 3 < noise[name] / rough[name] < 3]
    if far:
        listed = ", ".join(f"{name} (declared {noise[name]:.3g} {units[name]}, record {rough[name]:.3g} {units[name]})"
                           for name in far)
        return DiagnosisCode.DOUBTFUL.outcome(f"The declared noise is far from what the record shows: {listed}.")
    if unknown:
        return DiagnosisCode.ESTIMATED.outcome(f"Noise of {', '.join(unknown)} estimated from third differences.")
    return DiagnosisCode.DECLARED.outcome()


def _quantized(data: list[Data], noise: dict[str, float]) -> tuple[str, ...]:
    """Sensors whose noise is nothing but their steps: q/√12 of them is most of it."""
    steps = {name: max(quantum(one.readings[:, one.sensors.index(name)]) for one in data if name in one.sensors)
             for name in noise}
    return tuple(name for name, step in steps.items() if step / 12**0.5 > 0.7 * noise[name])


def _rough(data: list[Data], name: str) -> float:
    """Noise from third differences, robustly; a quantized reading has at least step/√12."""
    pieces, step = [], 0.0
    for one in data:
        if name in one.sensors:
            y = one.readings[:, one.sensors.index(name)]
            pieces.append(np.convolve(y, _DIFFERENCE, "valid"))
            step = max(step, quantum(y))
    d = np.abs(np.concatenate(pieces))
    return max(1.4826 * float(np.median(d)) / float(np.linalg.norm(_DIFFERENCE)), step / 12**0.5)
