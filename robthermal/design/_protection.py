"""Protection: switches a module off whose readings contradict its current; the same rules in Python and in C99."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from .._checks import positive_number
from ..errors import InputError
from ..thermal import Stepper
from ._export_protection import export_protection
from ._linearization import FeedbackLinearization
from ._protection_rules import TRIPS, ProtectionRules, Watch, step

_TEST_CURRENT = 0.2  # of the largest current: from it on the polarity can be judged
_FULL = 0.95  # of the largest current: the module does what it can
_RESTS = 10.0  # of the delay: a start after a shorter rest is not judged, the faces still come together


@dataclass(frozen=True)
class Protection:
    """Rules that switch modules off; build it with `protection`.

    Parameters
    ----------
    names : tuple of str
        Modules, in the order of the currents.
    rules : tuple of ProtectionRules
        Rules of every module.

    Examples
    --------
    >>> import robthermal as rt
    >>> law = rt.design.feedback_linearization(rt.systems.two_module(), current_limits=(-0.5, 1.4))
    >>> guard = rt.design.protection(law)
    >>> guard.names, round(guard.rules[0].current, 3)
    (('m1', 'm2'), 0.28)
    """

    names: tuple[str, ...]
    rules: tuple[ProtectionRules, ...]

    def trips(self, current: ArrayLike, hot: ArrayLike, cold: ArrayLike, reference: ArrayLike, ambient: ArrayLike,
              sample_time: float, *, idle: ArrayLike | None = None) -> np.ndarray:
        """What trips in every sample of a run; a module that has tripped stays off.

        Parameters
        ----------
        current : array_like, shape (n, n_modules)
            Currents that were asked for [A]; 0 from the sample after a trip on.
        hot, cold : array_like, shape (n, n_modules)
            Readings or estimates of the faces [K].
        reference : array_like, shape (n, n_modules)
            Set-points of the cold faces [K].
        ambient : array_like, shape (n,)
            Temperature of the warmest ambient [K].
        sample_time : float
            Time between the samples [s].
        idle : array_like of bool, shape (n,), optional
            Samples in which nothing of the machine is driven, heaters included; default: no current of these modules.

        Returns
        -------
        ndarray of str, shape (n, n_modules)
            "" or "reading", "hot", "polarity", "runaway", "stuck".

        Raises
        ------
        InputError
            Arrays of different length, a sample time that is not positive.

        Examples
        --------
        >>> import numpy as np, robthermal as rt
        >>> law = rt.design.feedback_linearization(rt.systems.two_module(), "m1", current_limits=(-0.5, 1.4))
        >>> guard = rt.design.protection(law)
        >>> n = np.ones((3, 1))
        >>> hot = [[300.0], [np.nan], [300.0]]
        >>> guard.trips(0.5 * n, hot, 290.0 * n, 285.0 * n, 298.0 * n[:, 0], 1.0)[:, 0].tolist()
        ['', 'reading', 'reading']
        """
        h, m = positive_number(sample_time, "argument sample_time", "s"), len(self.names)
        arrays = [np.asarray(values, dtype=float) for values in (current, hot, cold, reference)]
        surroundings = np.asarray(ambient, dtype=float)
        if any(values.shape != (surroundings.size, m) for values in arrays) or surroundings.ndim != 1:
            raise InputError(f"arrays of shape {[values.shape for values in arrays]} and {surroundings.shape}",
                             where="Protection.trips", expected=f"(n, {m}) each, and (n,) for the ambient")
        nothing = (arrays[0] == 0.0).all(axis=1) if idle is None else np.asarray(idle, dtype=bool)
        watches = [Watch(rules.rest) for rules in self.rules]
        found = np.empty(arrays[0].shape, dtype=object)
        for k in range(surroundings.size):
            for i, rules in enumerate(self.rules):
                current_now, hot_now, cold_now, wanted = (float(values[k, i]) for values in arrays)
                watches[i] = step(rules, watches[i], h, current_now, hot_now, cold_now, wanted,
                                  float(surroundings[k]), bool(nothing[k]))
                found[k, i] = TRIPS[watches[i].trip]
        return found.astype(str)

    def export(self, path: str | Path, name: str = "protection") -> None:
        """Write the rules for other programs: .c or .h (C99 with a test vector), .mat or .json by suffix.

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
        >>> law = rt.design.feedback_linearization(rt.systems.two_module(), current_limits=(-0.5, 1.4))
        >>> rt.design.protection(law).export("guard.h", "guard")
        >>> "guard_step" in Path("guard.h").read_text()
        True
        """
        export_protection(self, path, name)


def protection(law: FeedbackLinearization, *, hottest: float = 358.15, coldest: float = 213.15, rise: float = 3.0,
               delay: float = 30.0) -> Protection:
    """Rules that switch a module off when its readings contradict its current.

    A module trips, and stays off until the program starts again, when a reading is no number or below `coldest`
    (reading); a face is above `hottest` (hot); `delay` after a start from rest the difference of its faces has
    changed the wrong way by more than half of what the model says (polarity); both faces have warmed by more than
    `rise` while it cools with its full current and is above the set-point (runaway); or a face above all surroundings
    warms by more than `rise` while nothing is driven (stuck: a bridge or heater that does not switch off).

    Parameters
    ----------
    law : FeedbackLinearization
        Feedback law with current limits: its upper ends are the full currents.
    hottest, coldest : float, optional
        Temperatures of a face beyond which it trips [K].
    rise : float, optional
        Warming that a runaway or a stuck heater is told by; more than loads that are allowed cause [K].
    delay : float, optional
        Time after a start at which the polarity is judged [s].

    Returns
    -------
    Protection

    Raises
    ------
    InputError
        A law without current limits, numbers that are not positive, a model whose faces do not part until `delay`.

    Examples
    --------
    >>> import robthermal as rt
    >>> law = rt.design.feedback_linearization(rt.systems.two_module(), current_limits=(-0.5, 1.4))
    >>> guard = rt.design.protection(law)
    >>> rules = guard.rules[0]
    >>> round(rules.change, 1)  # K, half of what 30 s with a fifth of 1.4 A part the faces by
    3.0
    """
    for name, value in (("hottest", hottest), ("coldest", coldest), ("rise", rise), ("delay", delay)):
        positive_number(value, f"argument {name}", "s" if name == "delay" else "K")
    if not coldest < hottest:
        raise InputError(f"coldest = {coldest:g} K, hottest = {hottest:g} K", where="protection",
                         expected="coldest below hottest", remedy="Both in kelvin.")
    high = law.current_high
    if not (np.isfinite(high) & (high > 0.0)).all():
        raise InputError("the feedback law has a module without an upper current limit", where="argument law",
                         expected="current limits", remedy="Give current_limits; rt.certify.usable_current has them.")
    rules = []
    for i, name in enumerate(law.names):
        current = _TEST_CURRENT * float(high[i])
        change = 0.5 * _parted(law, i, current, delay)
        if not change > 0.0:
            raise InputError(f"the faces of {name!r} do not part within {delay:g} s at {current:.3g} A",
                             where="argument delay", expected="a longer time")
        rules.append(ProtectionRules(current, _FULL * float(high[i]), delay, change, _RESTS * delay, rise, coldest,
                                     hottest))
    return Protection(law.names, tuple(rules))


def _parted(law: FeedbackLinearization, module: int, current: float, delay: float) -> float:
    """Change of the difference of the faces after a start from rest in nominal surroundings, by the model [K]."""
    system, part = law.modules.system, law.modules.parts[module]
    rest = float(np.mean([ambient.temperature for ambient in system.ambients.values()]))
    lumps = Stepper(system, delay, initial=dict.fromkeys(system.lumps, rest)).step({law.names[module]: current})
    hot, cold = (system.lump_names.index(name) for name in (part.hot, part.cold))
    return float(lumps[hot] - lumps[cold])
