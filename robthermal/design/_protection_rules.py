"""Rules by which readings contradict the current of a module, and what they remember from sample to sample."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

TRIPS = ("", "reading", "hot", "polarity", "runaway", "stuck")  # numbered as in the C source
READING, HOT, POLARITY, RUNAWAY, STUCK = range(1, 6)
CLEAR = 1.0  # K, by which a face must be above its surroundings to be heated by something


@dataclass(frozen=True)
class ProtectionRules:
    """Numbers of the rules for one module.

    Parameters
    ----------
    current, full : float
        Currents from which polarity and runaway are judged [A].
    delay : float
        Time after a start at which the polarity is judged [s].
    change : float
        Half of what the difference of the faces changes until then, by the model [K].
    rest : float
        Time without current before a start that is judged [s].
    rise : float
        Warming that a runaway or a stuck heater is told by [K].
    coldest, hottest : float
        Readings beyond `coldest` are faults; above `hottest` the module is switched off [K].
    """

    current: float
    full: float
    delay: float
    change: float
    rest: float
    rise: float
    coldest: float
    hottest: float


@dataclass(frozen=True)
class Watch:
    """Memory of one module: times [s] and temperatures at which they began [K]."""

    rested: float
    started: float = -1.0
    sign: float = 0.0
    across: float = 0.0
    full: bool = False
    full_cold: float = 0.0
    full_hot: float = 0.0
    idle: bool = False
    lowest: float = 0.0  # of the warmer face, since nothing is driven
    trip: int = 0


def step(rules: ProtectionRules, old: Watch, h: float, current: float, hot: float, cold: float, reference: float,
         ambient: float, idle: bool) -> Watch:
    """One sample of one module, line by line the C source.

    Parameters
    ----------
    rules : ProtectionRules
        Rules of the module.
    old : Watch
        Memory before the sample.
    h : float
        Time since the sample before [s].
    current, hot, cold, reference, ambient : float
        Current asked for [A], faces, set-point and warmest ambient [K].
    idle : bool
        Whether nothing of the machine is driven.
    """
    if old.trip:
        return old
    if not (rules.coldest <= hot and rules.coldest <= cold and np.isfinite(hot + cold + current)):
        return replace(old, trip=READING)
    if hot > rules.hottest or cold > rules.hottest:
        return replace(old, trip=HOT)
    sign = 1.0 if current > 0.0 else -1.0
    driven, across = abs(current) >= rules.current, hot - cold
    if not driven:
        new = replace(old, rested=old.rested + h, started=-1.0)
    elif old.rested >= rules.rest:  # a start after a rest
        new = replace(old, rested=0.0, started=0.0, sign=sign, across=across)
    else:
        new = replace(old, rested=0.0, started=old.started + h if old.started >= 0.0 and sign == old.sign else -1.0)
    if new.started >= rules.delay:
        if new.sign * (across - new.across) < -rules.change:
            return replace(new, trip=POLARITY)
        new = replace(new, started=-1.0)
    full = current >= rules.full and cold > reference
    if full and not old.full:
        new = replace(new, full_cold=cold, full_hot=hot)
    if full and old.full and cold - old.full_cold > rules.rise and hot - old.full_hot > rules.rise:
        return replace(new, trip=RUNAWAY)
    warmest = max(hot, cold)
    lowest = min(warmest, old.lowest) if old.idle else warmest
    if idle and warmest > ambient + CLEAR and warmest - lowest > rules.rise:
        return replace(new, trip=STUCK)
    return replace(new, full=full, idle=idle, lowest=lowest)
