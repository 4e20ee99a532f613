"""State feedback of the currents around an operating point: from which starts it is proven to work."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._checks import positive_number
from ..errors import InputError
from ..thermal import System
from ..verification import Certificate, establish
from ._sections import Currents, Interval, Temperatures, made_by, named_ranges, region_section, system_section
from ._surroundings import ambient_ranges

_SHARES = (0.95, 0.9, 0.8, 0.6, 0.4, 0.2, 0.1, 0.03)  # of the rate, claimed from sample to sample, in turn
_OFFSETS = tuple(step * 10.0**k for k in range(-7, 2) for step in (1, 2, 5))  # K, in turn


def scheduled(system: System, *, gain: ArrayLike, matrix: ArrayLike, level: float, rate: float,
              operating_temperatures: Mapping[str, float], operating_current: Mapping[str, float], current: Currents,
              temperature: Temperatures, ambient: Mapping[str, Interval] | None = None,
              heat: Mapping[str, Interval] | None = None, parameters: Mapping[str, Interval] | None = None,
              sample_time: float | None = None, sampled_rate: float | None = None) -> Certificate:
    """Certify a state feedback I = I0 + F (x - x0) of the currents, for the nonlinear network.

    From every start with (x - x0)'P(x - x0) <= level the temperatures stay in the box, the currents in their ranges,
    and the distance to the equilibrium decays with the rate.

    Parameters
    ----------
    system : System
        Network with at least one module.
    gain : array_like, shape (n_modules, n_lumps)
        Feedback F [A/K], modules and lumps in the order of the system.
    matrix : array_like, shape (n_lumps, n_lumps)
        P of V = (x - x0)'P(x - x0) [1/K²].
    level : float
        Largest V of a start [-].
    rate : float
        V of the distance to the equilibrium falls at least as exp(-2 rate t) [1/s].
    operating_temperatures, operating_current : mapping
        {lump: temperature} x0 [K] and {module: current} I0 [A], close to a steady state.
    current : mapping
        {module: (lower, upper)} [A], every module.
    temperature : tuple or mapping
        Box [K]: (lower, upper) for all lumps, or {lump: (lower, upper)}.
    ambient : mapping, optional
        {ambient: (lower, upper)} [K]; default its nominal temperature.
    heat : mapping, optional
        {lump: (lower, upper)} extra heat, heaters and loads [W]; default none.
    parameters : mapping, optional
        Uncertain numbers of links and modules as in `contraction`; capacities are not covered.
    sample_time : float, optional
        Time between two readings of the temperatures, the currents held in between [s]. Default: the currents follow
        at every moment.
    sampled_rate : float, optional
        Rate that is claimed from sample to sample, below `rate` [1/s]; default the largest share of it that is proven.

    Returns
    -------
    Certificate
        Kind "scheduled"; `reason` names what fails where it is not proven.

    Raises
    ------
    InputError
        Boxes, operating point or matrices that do not fit the system; a range of a capacity.

    Examples
    --------
    >>> import robthermal as rt
    >>> stage = rt.System(ambients={"room": {"temperature": 298.0}},
    ...     lumps={"plate": {"capacity": 60.0}, "sink": {"capacity": 90.0}},
    ...     links=[{"between": ("sink", "room"), "conductance": 4.0}],
    ...     modules={"m": {"hot": "sink", "cold": "plate", "seebeck": {"value": 0.052}, "resistance": {"value": 2.1},
    ...              "conductance": {"value": 0.5}, "reference_temperature": 298.0}})
    >>> rest = rt.thermal.steady_state(stage, {"m": 1.0}).equilibria[0]
    >>> cert = rt.certify.scheduled(stage, gain=[[0.01, 0.0]], matrix=[[1.0, 0.0], [0.0, 1.0]], level=25.0, rate=0.002,
    ...     operating_temperatures=rest.temperatures, operating_current={"m": 1.0}, current={"m": (0.5, 1.5)},
    ...     temperature=(240.0, 340.0))
    >>> cert.holds
    True
    """
    section = system_section(system)
    region: dict[str, Any] = region_section(system, current, temperature, parameters)
    uncertain = [name for name in region.get("parameters", {}) if name.startswith("lumps.")]
    if uncertain:
        raise InputError(f"a range of {uncertain[0]} cannot be covered", where="argument parameters",
                         expected="ranges of links and modules", remedy="Hold capacities at their values.")
    region["ambient"] = {name: list(pair) for name, pair in ambient_ranges(system, ambient, parameters).items()}
    if heat:
        region["heat"] = named_ranges(heat, system.lump_names, "heat", "lump")
    point = {"temperature": _named(operating_temperatures, system.lump_names, "operating_temperatures"),
             "current": _named(operating_current, system.module_names, "operating_current")}
    section |= {"gain": _matrix(gain, (len(system.modules), len(system.lumps)), "gain"), "operating": point}
    P = np.array(_matrix(matrix, (len(system.lumps),) * 2, "matrix"))
    evidence = {"matrix": ((P + P.T) / 2).tolist()}
    region |= {"level": float(level), "rate": float(rate)}
    if sample_time is None:
        return _established(section, region, evidence)
    region["sample_time"] = positive_number(sample_time, "sample_time", "s")
    shares = [float(f"{share * rate:.6g}") for share in _SHARES]
    for claimed in shares if sampled_rate is None else [positive_number(sampled_rate, "sampled_rate", "1/s")]:
        cert = _established(section, {**region, "sampled_rate": claimed}, evidence)
        if cert.holds or "1/s is left" not in cert.reason:
            break
    return cert


def _established(section: dict[str, Any], region: dict[str, Any], evidence: dict[str, Any]) -> Certificate:
    """The certificate with the smallest offset of the equilibrium that is proven."""
    for offset in _OFFSETS:
        cert = establish("scheduled", system=section, region={**region, "offset": offset}, evidence=evidence, margin={},
                         made_by=made_by("none", "feedback and matrix as given"))
        if cert.holds or "the equilibrium may be" not in cert.reason:
            break
    return cert


def _matrix(value: ArrayLike, shape: tuple[int, int], argument: str) -> list[list[float]]:
    try:
        found = np.asarray(value, float)
    except (TypeError, ValueError):
        found = np.full((0,), np.nan)
    if found.shape != shape or not np.isfinite(found).all():
        raise InputError(f"{argument} has shape {found.shape}", where=f"argument {argument}",
                         expected=f"finite numbers, shape {shape}")
    rows: list[list[float]] = found.tolist()
    return rows


def _named(values: Mapping[str, float], names: tuple[str, ...], argument: str) -> dict[str, float]:
    if not isinstance(values, Mapping) or set(values) != set(names):
        raise InputError(f"{argument} has not the names of the system", where=f"argument {argument}",
                         expected=f"a number for each of {', '.join(names)}")
    return {name: float(values[name]) for name in names}
