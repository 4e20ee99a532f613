"""What a model leaves beyond the noise: how much, where, in which band, and how large a heat would remove it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..fit import Refit
from ..path import LinearizedRecord, heat_splines
from ._adequacy import side_by_side
from ._hold_out import Gap, expected_squares
from ._line import Line, single_period

Array = NDArray[np.float64]
_HELD = 0.8  # of the power, in the band
_LOCATED = 0.1  # of the remainder, that a free heat into a lump must remove for it to sit there
_ELSEWHERE = 5.0  # times what the training records leave: where that sits says nothing of the validation records
_SMALL = 1e-3  # relative singular value of a heat that no reading shows


@dataclass(frozen=True)
class Left:
    """Remainder of one group of records.

    Parameters
    ----------
    rms : float
        √(mean square of the free-run residual less that of the noise), all sensors [K].
    share_explained : float
        1 − (after² − noise²)/(before² − noise²) [-].
    """

    rms: float
    share_explained: float


@dataclass(frozen=True)
class Remainder:
    """What is left beyond the noise after the named effects.

    Parameters
    ----------
    gaps : dict
        `Left` of "train" and, if given, "validation".
    sensors : dict
        Rms of every thermometer on the training records, noise subtracted [K].
    where : tuple of tuple
        (lump, share of the remainder that a free heat into it would remove), the largest first.
    low, high : float
        Narrowest band of octaves that holds 80 % of its power [Hz].
    share : float
        Part of its power in that band [-].
    heat : float
        Rms of the free heat into the first of these lumps [W].
    line : Line, optional
        A single period that holds most of what is left at a thermometer.
    trained : str
        What the records of the fit are called.
    voltages : dict
        The same as `sensors` of every voltage of a module that is off by more than its noise [V].
    noise : float
        What noise alone would leave of the training records [K].
    """

    gaps: dict[str, Left]
    sensors: dict[str, float]
    where: tuple[tuple[str, float], ...]
    low: float
    high: float
    share: float
    heat: float
    line: Line | None = None
    trained: str = "training records"
    voltages: dict[str, float] = field(default_factory=dict)
    noise: float = 0.0

    @property
    def located(self) -> bool:
        """Whether a free heat into one of the lumps would remove enough of it to say that it sits there."""
        return self.where[0][1] >= _LOCATED

    @property
    def elsewhere(self) -> bool:
        """Whether validation records are off by so much more that it is not what the training records leave."""
        validation = self.gaps.get("validation")
        return validation is not None and "train" in self.gaps and (
            validation.rms > _ELSEWHERE * max(self.gaps["train"].rms, self.noise))

    def __str__(self) -> str:
        """How much, at which sensor and lump, in which band, and whether a single period."""
        if self.elsewhere:
            return (f"{self.gaps['validation'].rms:.2g} K of the error on the validation records is not explained, of "
                    f"that on the {self.trained} {self.gaps['train'].rms:.2g} K: the validation records hold what the "
                    "model has never seen, their machine has changed, or they are read otherwise: look at the sign, "
                    "unit and column of every input.")
        seen = "validation" if "validation" in self.gaps and self.gaps["validation"].rms else "train"
        sensor = max(self.sensors, key=lambda name: self.sensors[name])
        kind = "validation records" if seen == "validation" else self.trained
        lump, share = self.where[0]
        removed = (f"a free heat of {self.heat:.2g} W rms into {lump} would remove {100 * share:.0f} % of it"
                   if self.located else f"no slow heat into a lump would remove more than {100 * share:.2g} % of it")
        said = (f"{self.gaps[seen].rms:.2g} K of the error on the {kind} is not explained, mostly at {sensor} between "
                f"{self.low:.2g} and {self.high:.2g} Hz; {removed}.")
        volts = "".join(f" In the {self.trained} the voltage {name} is off by {rms:.2g} V rms beyond its noise."
                        for name, rms in self.voltages.items())
        return said + volts if self.line is None else f"{said}{volts} {self.line}"

    def to_dict(self) -> dict[str, Any]:
        """As in ``diagnosis.json``; "line" is there where a single period was found, "voltages" where one is off.

        Returns
        -------
        dict
        """
        return {**{name: vars(left) for name, left in self.gaps.items()}, "sensors": self.sensors,
                "where": [{"lump": lump, "share": share} for lump, share in self.where],
                "band": {"low": self.low, "high": self.high, "share": self.share}, "heat": self.heat,
                **({} if self.line is None else {"line": vars(self.line)}),
                **({"voltages": self.voltages} if self.voltages else {})}


def remainder(fit: Refit, gaps: Mapping[str, Gap], trained: str = "training records") -> Remainder | None:
    """Remainder of a fit with the network taken to be right; None without any record of temperatures.

    Parameters
    ----------
    fit : Refit
        With the named effects, its noise levels no larger than declared.
    gaps : mapping
        `Gap` of "train" and, if given, "validation".
    trained : str
        What the records of the fit are called.
    """
    beyond, noise = _squares(fit)
    squares = {name: rms for name, rms in beyond.items() if name in fit.system.thermometers}
    if not squares:
        return None
    volts = {name: rms for name, rms in beyond.items() if name not in squares and rms > noise[name]}
    where, heat = _places(fit)
    return Remainder({name: left(gap) for name, gap in gaps.items()}, squares, where, *_band(fit), heat,
                     single_period(fit), trained, volts, gaps["train"].noise if "train" in gaps else 0.0)


def left(gap: Gap) -> Left:
    """Remainder of a gap.

    Parameters
    ----------
    gap : Gap
        Rms before and after, and that of the noise alone.
    """
    before, after = (max(value**2 - gap.noise**2, 0.0) for value in (gap.before, gap.after))
    return Left(float(np.sqrt(after)), 1.0 - after / before if before > 0 else 0.0)


def _squares(fit: Refit) -> tuple[dict[str, float], dict[str, float]]:
    """Rms beyond the noise of every sensor over all records, and what noise and random heat alone would give."""
    beyond: dict[str, float] = {}
    noise: dict[str, float] = {}
    rows: dict[str, int] = {}
    for path in fit.records:
        expected = len(path.residual) * np.asarray(expected_squares(fit, path))
        powers = zip(path.one.sensors, np.sum(path.residual**2, axis=0), expected, strict=True)
        for name, power, alone in powers:
            beyond[name] = beyond.get(name, 0.0) + float(power - alone)
            noise[name] = noise.get(name, 0.0) + float(alone)
            rows[name] = rows.get(name, 0) + len(path.residual)

    def rms(powers: dict[str, float]) -> dict[str, float]:
        return {name: float(np.sqrt(max(power / rows[name], 0.0))) for name, power in powers.items()}

    return rms(beyond), rms(noise)


def _places(fit: Refit) -> tuple[tuple[tuple[str, float], ...], float]:
    """Share that a spline of heat into every lump removes of what is left, and the rms of the best one [W]."""
    rest = float(fit.rest @ fit.rest)
    beyond = rest - fit.degrees_of_freedom  # nothing where healthy records raised the noise level above it
    beyond = beyond if beyond > _SMALL * rest else rest
    found: dict[str, tuple[float, float]] = {}
    basis = np.concatenate([heat_splines(path.time) for path in fit.records])
    for i, lump in enumerate(fit.system.lumps):
        J = fit.project(fit.whiten(side_by_side([path.splines(i) for path in fit.paths], fit.paths)))
        J = J[:, :basis.shape[1]]
        U, s, Vt = np.linalg.svd(J, full_matrices=False)
        kept = s > _SMALL * max(s[0], 1e-300)
        along = U[:, kept].T @ fit.rest
        size = Vt[kept].T @ (along / s[kept])
        found[lump] = (float(along @ along) / beyond, float(np.sqrt(np.mean((basis @ size) ** 2))))
    order = sorted(found, key=lambda name: -found[name][0])
    return tuple((name, min(found[name][0], 1.0)) for name in order), found[order[0]][1]


def _band(fit: Refit) -> tuple[float, float, float]:
    """Narrowest run of octaves that holds most of the power beyond the noise [Hz, Hz, share]."""
    longest = max(fit.records, key=lambda path: path.span)
    n_octaves = max(1, int(np.ceil(np.log2(len(longest.residual) / 2.0))))
    edges: Array = 0.5 / longest.h * 2.0 ** np.arange(-n_octaves, 1, dtype=np.float64)
    power = sum((_octaves(fit, path, edges) for path in fit.records), np.zeros(n_octaves))
    power = np.maximum(power, 0.0)
    total = float(power.sum())
    if total == 0.0:
        return float(edges[0]), float(edges[-1]), 1.0
    sums = np.concatenate([[0.0], np.cumsum(power)]) / total
    runs = [(b - a, float(sums[a] - sums[b]), a, b) for a in range(n_octaves) for b in range(a + 1, n_octaves + 1)
            if sums[b] - sums[a] >= _HELD - 1e-12]
    _, missed, a, b = min(runs)
    return float(edges[a]), float(edges[b]), -float(missed)


def _octaves(fit: Refit, path: LinearizedRecord, edges: Array) -> Array:
    """Power of the residual beyond white noise in every octave, all thermometers together."""
    own = np.array([name in fit.system.thermometers for name in path.one.sensors])
    r = path.residual[:, own]
    spectrum = np.sum(np.abs(np.fft.rfft(r, axis=0)[1:]) ** 2, axis=1)
    spectrum = spectrum - len(r) * float(np.sum(fit.levels.of(path, fit.floor)[0][own] ** 2))
    place = np.clip(np.searchsorted(edges, np.fft.rfftfreq(len(r), path.h)[1:], side="left") - 1, 0, len(edges) - 2)
    return np.asarray(np.bincount(place, weights=spectrum, minlength=len(edges) - 1), np.float64)
