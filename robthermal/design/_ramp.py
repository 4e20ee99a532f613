"""Set-points that move no faster than a stated rate: in Python, and as C99 with a test vector."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._checks import positive_number
from ..errors import InputError
from ..export import Program, comment, doubles, identifier, write_export

FORMAT = "robthermal-ramp/1"
Array = NDArray[np.float64]

_ABOUT = """\
Set-points that move no faster than a stated rate.

Modules, in this order: {names}.

    {p}_step(reference, h, target);

reference: set-point of the controller [K], moved towards target [K] by one sample of h [s]. Start it at the measured
temperature. A target that is not finite leaves the reference where it is."""

_BODY = """\
static const double {p}_up[{m}] = {up}, {p}_down[{m}] = {down}; /* K/s */

static inline void {p}_step(double reference[{m}], double h, const double target[{m}])
{{
    for (int i = 0; i < {m}; i++) {{
        double low = reference[i] - {p}_down[i] * h, high = reference[i] + {p}_up[i] * h;
        if (isfinite(target[i]))
            reference[i] = target[i] < low ? low : target[i] > high ? high : target[i];
    }}
}}
"""


@dataclass(frozen=True)
class SetpointRamp:
    """Rates at which set-points may move; build it with `setpoint_ramp`.

    Parameters
    ----------
    names : tuple of str
        Modules, in the order of the set-points.
    up, down : tuple of float
        Largest rates of warming and of cooling [K/s].

    Examples
    --------
    >>> import robthermal as rt
    >>> ramp = rt.design.setpoint_ramp(["m1"], 0.05)  # 3 K per minute
    >>> ramp.sequence(295.0, 288.0, samples=4, sample_time=10.0)[:, 0].tolist()
    [295.0, 294.5, 294.0, 293.5]
    """

    names: tuple[str, ...]
    up: tuple[float, ...]
    down: tuple[float, ...]

    def step(self, reference: ArrayLike, target: ArrayLike, sample_time: float) -> Array:
        """Set-points one sample later.

        Parameters
        ----------
        reference, target : array_like, shape (n_modules,)
            Where the set-points are, and where they are to go [K]; a target that is not finite changes nothing.
        sample_time : float
            Time of one sample [s].

        Returns
        -------
        ndarray, shape (n_modules,)

        Examples
        --------
        >>> import robthermal as rt
        >>> rt.design.setpoint_ramp(["m1"], 0.5).step([295.0], [295.2], 1.0).tolist()
        [295.2]
        """
        at, wanted = self._row(reference, "reference"), self._row(target, "target")
        h = positive_number(sample_time, "argument sample_time", "s")
        low, high = at - np.array(self.down) * h, at + np.array(self.up) * h
        return np.where(np.isfinite(wanted), np.clip(wanted, low, high), at)

    def sequence(self, start: ArrayLike, target: ArrayLike, *, samples: int, sample_time: float) -> Array:
        """Set-points of a run, for `simulate_loop`.

        Parameters
        ----------
        start : array_like
            Set-points of the first sample, the measured temperatures: one number, or one per module [K].
        target : array_like
            Where they are to go: one number, one per module, or (samples, n_modules) [K].
        samples : int
            Number of rows.
        sample_time : float
            Time between the samples [s].

        Returns
        -------
        ndarray, shape (samples, n_modules)

        Raises
        ------
        InputError
            Shapes that do not fit, numbers that are not positive.

        Examples
        --------
        >>> import robthermal as rt
        >>> ramp = rt.design.setpoint_ramp({"m1": 0.1, "m2": 0.2})
        >>> ramp.sequence(295.0, [294.0, 300.0], samples=3, sample_time=5.0).tolist()
        [[295.0, 295.0], [294.5, 296.0], [294.0, 297.0]]
        """
        if isinstance(samples, bool) or not isinstance(samples, int) or samples < 1:
            raise InputError(f"samples = {samples!r}", where="argument samples", expected="a whole number, at least 1")
        given = np.asarray(target, dtype=float)
        if given.ndim == 2 and given.shape != (samples, len(self.names)):
            raise InputError(f"target has shape {given.shape}", where="argument target",
                             expected=f"({samples}, {len(self.names)}), one row per sample")
        wanted = given if given.ndim == 2 else np.tile(self._row(given, "target"), (samples, 1))
        found = [self._row(start, "start")]
        for row in wanted[1:]:
            found.append(self.step(found[-1], row, sample_time))
        return np.array(found)

    def export(self, path: str | Path, name: str = "ramp") -> None:
        """Write the ramp for other programs: .c or .h (C99 with a test vector), .mat or .json by suffix.

        Parameters
        ----------
        path : str or Path
            File to write; its suffix says which format.
        name : str, optional
            Prefix of every identifier in the C source.

        Raises
        ------
        InputError
            Another suffix, a file that cannot be written.

        Examples
        --------
        >>> from pathlib import Path
        >>> import robthermal as rt
        >>> rt.design.setpoint_ramp(["m1"], 0.05).export("ramp.h")
        >>> "ramp_step" in Path("ramp.h").read_text()
        True
        """
        write_export(path, lambda: self._document(name), lambda: self._program(name))

    def _row(self, values: ArrayLike, argument: str) -> Array:
        row = np.asarray(values, dtype=float)
        if row.shape not in ((), (len(self.names),)):
            raise InputError(f"{argument} has shape {row.shape}", where=f"argument {argument}",
                             expected=f"one number, or one for each of {', '.join(self.names)}")
        return np.broadcast_to(row, (len(self.names),)).copy()

    def _document(self, name: str) -> dict[str, Any]:
        return {"format": FORMAT, "name": name, "modules": [
            {"name": module, "up": up, "down": down} for module, up, down in zip(self.names, self.up, self.down,
                                                                                 strict=True)]}

    def _program(self, name: str) -> Program:
        """Inputs of the test: h, references, targets; outputs: references one sample later."""
        p, m = identifier(name, "ramp"), len(self.names)
        call = (f"        for (int k = 0; k < {m}; k++)\n            out[k] = in[1 + k];\n"
                f"        {p}_step(out, in[0], in + {1 + m});")
        columns = ["h", *(f"{what} {module}" for what in ("reference", "target", "next") for module in self.names)]
        body = _BODY.format(p=p, m=m, up=doubles(self.up), down=doubles(self.down))
        return Program(p, "RAMP_TEST", _ABOUT.format(p=p, names=comment(", ".join(self.names))), body,
                       list(self._test_vector()), 1 + 2 * m, "", call, columns)

    def _test_vector(self) -> Iterator[list[float]]:
        """Targets on both sides, near and far."""
        rng = np.random.default_rng(0)
        reference = np.full(len(self.names), 295.0)
        for k in range(64):
            h = float(rng.choice([0.1, 1.0, 10.0]))
            reach = np.where(rng.random(len(self.names)) < 0.5, 0.5, 5.0) * h * np.array(self.up)
            target = reference + reach * rng.uniform(-1.0, 1.0, len(self.names))
            moved = self.step(reference, target, h)
            yield [h, *reference.tolist(), *target.tolist(), *moved.tolist()]
            reference = moved if k % 16 else np.full(len(self.names), 295.0)


def setpoint_ramp(modules: Mapping[str, float] | list[str] | tuple[str, ...], rate: float | None = None, *,
                  cooling: float | None = None) -> SetpointRamp:
    """Set-points that move no faster than a stated rate.

    Parameters
    ----------
    modules : mapping of module to float, or sequence of str
        Modules with a rate each [K/s], or their names with one `rate` for all.
    rate : float, optional
        Largest rate of all modules [K/s], where `modules` are names.
    cooling : float, optional
        Largest rate of cooling [K/s]; default that of warming.

    Returns
    -------
    SetpointRamp

    Raises
    ------
    InputError
        No module, no rate, rates that are not positive.

    Examples
    --------
    >>> import robthermal as rt
    >>> ramp = rt.design.setpoint_ramp(["m1", "m2"], 2.0 / 60.0, cooling=1.0 / 60.0)
    >>> ramp.names
    ('m1', 'm2')
    """
    rates = dict(modules) if isinstance(modules, Mapping) else dict.fromkeys(modules, rate)
    if not rates or (rate is not None) == isinstance(modules, Mapping):
        raise InputError(f"modules = {modules!r}, rate = {rate!r}", where="setpoint_ramp",
                         expected="names with one rate, or a mapping of names to rates [K/s]")
    up = tuple(positive_number(value, f"rate of {name!r}", "K/s") for name, value in rates.items())
    down = up if cooling is None else (positive_number(cooling, "argument cooling", "K/s"),) * len(up)
    return SetpointRamp(tuple(rates), up, down)
