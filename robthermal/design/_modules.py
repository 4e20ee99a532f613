"""The modules a feedback law drives: their faces, and S, R, K at the mean temperature of the faces."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from ..thermal import Module, System

Array = NDArray[np.floating]
_COLDEST = 150.0  # K: below, a temperature is in Celsius


class Properties(NamedTuple):
    """Properties of every module at given temperatures; each (..., n_modules)."""

    S: Array
    R: Array
    K: Array
    hot: Array
    cold: Array


@dataclass(frozen=True)
class ModuleSet:
    """Some of the modules of a system, in a fixed order.

    Parameters
    ----------
    system : System
        System that contains the modules.
    names : tuple of str
        Names of the modules, in order.
    """

    system: System
    names: tuple[str, ...]

    @classmethod
    def of(cls, system: System, modules: Iterable[str] | str | None) -> ModuleSet:
        """Check the names; all modules by default."""
        check_system(system)
        if not system.modules:
            raise InputError(f"{system.name!r} has no thermoelectric module", where="argument system",
                             remedy="Add a [modules.NAME] table, or control its heaters directly.")
        names = system.module_names if modules is None else (modules,) if isinstance(modules, str) else tuple(modules)
        for name in names:
            if name not in system.modules:
                raise InputError(f"there is no module {name!r}", where="argument modules",
                                 expected="some of " + ", ".join(system.modules))
        if not names or len(set(names)) < len(names):
            raise InputError(f"modules = {list(names)!r}", where="argument modules",
                             expected="at least one module, none twice")
        return cls(system, names)

    @cached_property  # these are asked for at every sample of a simulated loop
    def parts(self) -> list[Module]:
        """The modules themselves."""
        return [self.system.modules[name] for name in self.names]

    @cached_property
    def hot(self) -> list[int]:
        """Lump index of every hot face."""
        return [self.system.lump_names.index(part.hot) for part in self.parts]

    @cached_property
    def cold(self) -> list[int]:
        """Lump index of every cold face."""
        return [self.system.lump_names.index(part.cold) for part in self.parts]

    @cached_property
    def _lines(self) -> tuple[Array, tuple[tuple[Array, Array], ...]]:
        """Reference temperatures; value there and slope of S, of R, of K: each (n_modules,)."""
        at = np.array([part.reference_temperature for part in self.parts])
        pairs = [[(getattr(part, key).value, getattr(part, key).slope) for part in self.parts]
                 for key in ("seebeck", "resistance", "conductance")]
        return at, tuple((np.array([v for v, _ in one]), np.array([s for _, s in one])) for one in pairs)

    def properties(self, temperatures: ArrayLike | Mapping[str, ArrayLike]) -> Properties:
        """S, R, K at T_avg = (x_h + x_c)/2, and the temperatures of the faces.

        Parameters
        ----------
        temperatures : array_like, shape (..., n_lumps), or mapping
            Lump temperatures [K]; a mapping needs the faces of these modules only.
        """
        hot, cold = self.faces(temperatures)
        at, lines = self._lines
        dT = 0.5 * (hot + cold) - at
        S, R, K = (value + slope * dT for value, slope in lines)
        for symbol, values in (("S", S), ("R", R), ("K", K)):
            if not (values > 0).all():
                self._refuse(symbol, values, hot, cold)
        return Properties(S, R, K, hot, cold)

    def _refuse(self, symbol: str, values: Array, hot: Array, cold: Array) -> None:
        where = np.unravel_index(int(np.argmin(values)), values.shape)
        mean = 0.5 * (hot[where] + cold[where])
        raise InputError(f"{symbol} of module {self.names[where[-1]]!r} is {values[where]:.4g} at {mean:.2f} K",
                         where="argument temperatures", expected=f"temperatures at which {symbol} is positive",
                         remedy="Its slope is too steep for this temperature: check slope and reference_temperature, "
                                "and that the temperatures are kelvin.")

    def faces(self, temperatures: ArrayLike | Mapping[str, ArrayLike]) -> tuple[Array, Array]:
        """Temperatures of the hot and the cold faces, (..., n_modules) [K]."""
        if isinstance(temperatures, Mapping):
            hot, cold = ([_face(temperatures, getattr(part, face)) for part in self.parts] for face in ("hot", "cold"))
            both = np.broadcast_arrays(*hot, *cold)
            x_h, x_c = np.stack(both[:len(hot)], axis=-1), np.stack(both[len(hot):], axis=-1)
        else:
            try:
                x = np.asarray(temperatures, float)
            except (TypeError, ValueError):
                x = np.array(np.nan)
            if x.ndim == 0 or x.shape[-1] != len(self.system.lumps):
                raise InputError(f"temperatures has shape {x.shape}", where="argument temperatures",
                                 expected=f"(..., {len(self.system.lumps)}): every lump of the system, in file order",
                                 remedy="Or give a mapping of lump to temperature with the modules' faces.")
            x_h, x_c = x[..., self.hot], x[..., self.cold]
        for values, part in ((x_h, "hot"), (x_c, "cold")):
            if not (np.isfinite(values).all() and values.min(initial=np.inf) >= _COLDEST):
                raise InputError(f"a {part} face is at {values.min():.6g} K", where="argument temperatures",
                                 expected="finite temperatures in kelvin",
                                 remedy="Add 273.15 to degrees Celsius; a sensor that reads nothing must switch the "
                                        "module off.")
        return x_h, x_c

    def vector(self, values: ArrayLike | Mapping[str, ArrayLike], argument: str, unit: str) -> Array:
        """One number per module, (..., n_modules), from an array, a mapping, or one number for all."""
        try:
            return self._vector(values, argument, unit)
        except InputError:
            raise
        except (TypeError, ValueError):  # text, or arrays that do not fit together
            raise InputError(f"{argument} = {values!r}", where=f"argument {argument}",
                             expected=f"numbers [{unit}], one for each of " + ", ".join(self.names)) from None

    def _vector(self, values: ArrayLike | Mapping[str, ArrayLike], argument: str, unit: str) -> Array:
        m = len(self.names)
        if isinstance(values, Mapping):
            extra, missing = set(values) - set(self.names), [name for name in self.names if name not in values]
            if extra or missing:
                name = missing[0] if missing else sorted(extra)[0]
                raise InputError(f"module {name!r} {'is missing' if missing else 'is not driven here'}",
                                 where=f"argument {argument}", expected=f"one number [{unit}] for each of "
                                 + ", ".join(self.names))
            out = np.stack(np.broadcast_arrays(*(np.asarray(values[name], float) for name in self.names)), axis=-1)
        else:
            out = np.asarray(values, float)
            if out.ndim == 0:
                out = np.full(m, float(out))
        if out.shape[-1] != m or not np.isfinite(out).all():
            raise InputError(f"{argument} has shape {out.shape}" if out.shape[-1] != m else f"{argument} is not finite",
                             where=f"argument {argument}", expected=f"finite numbers (..., {m}) [{unit}], one for each "
                             "of " + ", ".join(self.names))
        return out

    def ranges(self, limits: Mapping[str, tuple[float, float]] | tuple[float, float] | None, argument: str,
               unit: str) -> tuple[Array, Array]:
        """Lower and upper limit of every module, infinite where there is none."""
        low, high = np.full(len(self.names), -np.inf), np.full(len(self.names), np.inf)
        given = {} if limits is None else limits if isinstance(limits, Mapping) else dict.fromkeys(self.names, limits)
        for name, pair in given.items():
            if name not in self.names:
                raise InputError(f"module {name!r} is not driven here", where=f"argument {argument}",
                                 expected="some of " + ", ".join(self.names))
            low[self.names.index(name)], high[self.names.index(name)] = _pair(pair, f"{argument}[{name!r}]", unit)
        return low, high


def check_system(system: System) -> None:
    """Refuse what is no system."""
    if not isinstance(system, System):
        raise InputError(f"system is a {type(system).__name__}", where="argument system",
                         expected="a robthermal.System", remedy="Read one with rt.read_system(path).")


def _face(temperatures: Mapping[str, ArrayLike], lump: str) -> Array:
    if lump not in temperatures:
        raise InputError(f"no temperature for lump {lump!r}", where="argument temperatures",
                         expected="the hot and the cold face of every module", remedy="Measure or estimate it "
                         "(rt.design.observer).")
    return np.asarray(temperatures[lump], float)


def _pair(pair: object, where: str, unit: str) -> tuple[float, float]:
    try:
        low, high = (float(value) for value in pair)  # type: ignore[attr-defined]  # refused below if it is no pair
    except (TypeError, ValueError):
        low = high = np.nan
    if not (low <= 0 <= high and low < high):
        raise InputError(f"{pair!r}", where=f"argument {where}",
                         expected=f"(lower, upper) [{unit}], lower <= 0 <= upper",
                         remedy="The feedback law must be able to switch the module off.")
    return low, high
