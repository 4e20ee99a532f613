"""Certificates of sampled closed loops: feedback linearization, limits, integrators and the nonlinear plant."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import block_diag

from ..errors import InputError
from ..thermal import System
from ..verification import Certificate, establish, not_certified
from ._flow import Builder
from ._flow_search import Forms
from ._flow_search import contraction as flow_contraction
from ._flow_search import search as flow_search
from ._loop_parameters import Plant, check_loop_parameters, refuse_uncertain_sensors
from ._loop_picture import Picture, picture
from ._loop_search import Candidate, contraction, frozen, search, sides
from ._lyapunov import check_choice, short_matrices
from ._observer import gain_matrix, sensor_list
from ._sections import Currents, Interval, Temperatures, made_by, region_section, system_section

Array = NDArray[np.floating[Any]]
_SOLVER = "Clarabel semidefinite program, cutting planes"
_KEYS = ("A", "B", "C", "D", "windup")
_PIECES = (1, 3)  # per current range
_FLOW_PIECES = (1, 2, 4)
_FLOW_CASES = 6  # of free and limited modules, with a form for each; above it one form for all
_FLOW_SIZE = 26  # temperatures, estimates, currents and controller states; larger ones would be searched for hours
_MOST = 5_000  # combinations of slopes
_SLACK = ((0.02, 1.002), (0.1, 1.01), (0.3, 1.03), (0.6, 1.1))  # share of the way to 1 given up; sizes enlarged
_DIGITS = 4  # of the multipliers


def loop(system: System, *, current: Currents, temperature: Temperatures, sample_time: float,
         controller: Mapping[str, ArrayLike], plant: Plant = "continuous", drift: float | None = None,
         gain: ArrayLike | None = None, sensors: Sequence[str] = (),
         parameters: Mapping[str, Interval] | None = None, large: bool = False) -> Certificate:
    """Certify that a sampled closed loop forgets its start, limits active or not.

    The controller is v = C z + D x, z⁺ = A z + B x + windup (achieved - v), set-points apart: v the heats wanted into
    the cold faces, achieved what the modules give within their limits. Feedback linearisation at the true temperatures
    turns v into currents; they are limited to the ranges and held over a sample.

    Parameters
    ----------
    system : System
        Network; every module is driven, in file order.
    current : mapping
        {module: (lower, upper)} [A]: the limits of the law.
    temperature : tuple or mapping
        Box of temperatures [K], as in `contraction`.
    sample_time : float
        Time between two samples [s].
    controller : mapping
        A (q, q), B (q, n_lumps) [W/K or own units], C (n_modules, q), D (n_modules, n_lumps) [W/K], windup
        (q, n_modules); `rt.design.certify_loop` takes them from a controller.
    plant : {"continuous", "held"}
        Temperatures move continuously between samples, or as the observer's sampled model says: x⁺ = A_d x + Γ f(x, I).
        A claim about the sampled model is not one about the machine.
    drift : float, optional
        Claim it only for trajectories on which no face of a module moves further than this within a sample [K]; by an
        older proof, which reaches less far without such an assumption.
    gain : array_like, shape (n_lumps, n_sensors), optional
        L of an observer x̂⁺ = A_d x̂ + Γ f(x̂, I) + L (y - C x̂), as in `observer`: feedback law and controller then
        read its estimates, for plant "continuous". The plant moves continuously, only the observer's model
        holds the heat.
    sensors : sequence of str
        What that observer reads.
    parameters : mapping, optional
        Uncertain conductances of links, {"links.NAME.conductance": (lower, upper)} [W/K], for plant "continuous" and
        without observer. What the feedback law knows (the modules) and what is not offered here (capacities, natural
        convection, radiation) is refused by name; what no loop depends on (a sensor that is not read, a start)
        is ignored.
    large : bool
        Search a dense P for more than 40 lumps too, which may take hours.

    Returns
    -------
    Certificate
        `holds` tells whether it is proven; if not, `reason` tells why. It says nothing about leaving the box: that is
        `invariance`, with the same ranges.

    Raises
    ------
    InputError
        Matrices of another shape, bad ranges, a system without modules, a large system.

    References
    ----------
    Evers (2021), (5.15)-(5.19) with the errata; Lohmiller and Slotine, Automatica 34 (1998).

    Examples
    --------
    >>> import robthermal as rt
    >>> system = rt.System(ambients={"room": {"temperature": 298.15}},
    ...     lumps={"hot": {"capacity": 50.0}, "cold": {"capacity": 20.0}},
    ...     links=[{"between": ("hot", "room"), "conductance": 2.0}, {"between": ("cold", "room"), "conductance": 0.1}],
    ...     modules={"m": {"hot": "hot", "cold": "cold", "seebeck": {"value": 0.05}, "resistance": {"value": 4.0},
    ...                    "conductance": {"value": 0.3}, "reference_temperature": 298.15}})
    >>> pi = {"A": [[1.0]], "B": [[0.0, -0.01]], "C": [[1.0]], "D": [[0.0, -1.0]], "windup": [[0.01]]}
    >>> cert = rt.certify.loop(system, current={"m": (0.0, 0.5)}, temperature=(285.0, 310.0), sample_time=1.0,
    ...                        controller=pi, plant="held")
    >>> cert.holds, rt.verify(cert).valid
    (True, True)
    """
    section = system_section(system)
    if not system.modules:
        raise InputError(f"{system.name!r} has no module", where="argument system", expected="modules to drive")
    check_choice(system, "full", large)
    section["controller"] = _controller(controller, len(system.lumps), len(system.modules))
    region = region_section(system, current, temperature, parameters)
    check_loop_parameters(system, parameters, plant, observer=gain is not None)
    region["sample_time"] = _number(sample_time, "sample_time", "s")
    if plant not in ("continuous", "held"):
        raise InputError(f"plant = {plant!r}", where="argument plant", expected='"continuous" or "held"')
    region["plant"] = plant
    if gain is not None:
        _observer_fits(plant, drift)
        section["sensors"] = sensor_list(system, sensors)
        refuse_uncertain_sensors(system, sensors, parameters or {})
        section["gain"] = gain_matrix(gain, len(system.lumps), len(section["sensors"]))
    if drift is not None:
        region["drift"] = _number(drift, "drift", "K")
    parts: dict[str, Any] = {"system": section, "region": region}
    least = system.with_parameters({name: low for name, (low, _) in region.get("parameters", {}).items()})
    if plant == "continuous" and drift is None:
        return _continuous(system, least, parts)
    reason, solves = "", 0
    for pieces in _PIECES:
        if (8 * pieces + 8) ** len(system.modules) > _MOST:
            reason = reason or "too many combinations of slopes to check one by one"
            break
        seen = picture(least, section, region, pieces)
        reason = _refused(system, seen)
        if reason:
            break
        for pattern in _patterns(system, section):
            found = search(seen, region["sample_time"], _scale(seen, section), pattern, held=plant == "held")
            solves += found.solves
            if found.contraction < 1:
                return _prove(parts, seen, found, pieces, solves)
        reason = ("no matrix P was found for which e'Pe shrinks at every combination of slopes, although no frozen map "
                  "of the box is unstable. Narrow the currents or temperatures, or lower the gains"
                  + ("." if plant == "held" or drift is not None else
                     ", or claim it for trajectories that move less within a sample (drift=)."))
    return not_certified("loop", **parts, evidence={}, reason=reason, made_by=made_by(_SOLVER, f"{solves} solved"))


def _continuous(system: System, least: System, parts: dict[str, Any]) -> Certificate:
    """Certificate by a form that changes along the sample; ``least`` has every uncertain link at its least."""
    section, region = parts["system"], parts["region"]
    n, m, q = len(system.lumps), len(system.modules), len(section["controller"]["A"])
    seen = "gain" in section
    reason = _refused(system, None if seen else picture(least, section, region, 1))
    if not reason and n * (1 + seen) + m + q > _FLOW_SIZE:
        reason = (f"{n * (1 + seen) + m + q} temperatures, estimates, currents and controller states: too many for the "
                  f"search, which takes {_FLOW_SIZE}. Reduce the system, or leave the observer out")
    solves = 0
    for pieces in _FLOW_PIECES if not reason else ():
        builder = Builder(least, section, region)
        alone = (pieces + 2) ** m <= _FLOW_CASES
        cases, time = builder.cases(pieces), region["sample_time"]
        forms = flow_search(cases if alone else [builder.merged()], time, builder.scale())
        solves += 1
        c = flow_contraction(cases, time, forms)
        if c < 1:
            cert = _prove_flow(parts, builder, forms, pieces, solves)
            if cert.holds:
                return cert
            reason = cert.reason
        if not alone:
            break
    return not_certified("loop", **parts, evidence={}, made_by=made_by(_SOLVER, f"{solves} solved"), reason=reason or (
        "no matrices were found for which e'Pe shrinks at every combination of slopes of the box, although no frozen "
        "map that was looked at is unstable. Narrow the currents or temperatures, or lower the gains."))


def _prove_flow(parts: dict[str, Any], builder: Builder, forms: Forms, pieces: int, solves: int) -> Certificate:
    """The first certificate that the checker proves, with more digits and less decay in turn."""
    time, cases = parts["region"]["sample_time"], builder.cases(pieces)
    reason, width = "what the solver found does not survive rounding", len(forms.end)
    for (slack, _), matrix in zip(_SLACK, short_matrices(block_diag(forms.end, *forms.starts)), strict=True):
        rows, size = np.array(matrix), len(forms.starts[0])
        marks = [width + k * size for k in range(len(forms.starts))]
        rounded = Forms(rows[:width, :width], [rows[k:k + size, k:k + size] for k in marks])
        c = flow_contraction(cases, time, rounded)
        if not c < 1:
            continue
        evidence = {"matrix": rounded.end.tolist(), "start": [S.tolist() for S in rounded.starts], "pieces": pieces,
                    "contraction": float(np.ceil((1 - (1 - c) * (1 - slack)) * 1e9) / 1e9)}
        status = f"{solves} matrix inequalities; {100 * slack:g} % of the decay given up for the proof"
        cert = establish("loop", **parts, evidence=evidence, made_by=made_by(_SOLVER, status), margin={})
        if cert.holds:
            return cert
        reason = cert.reason
    return not_certified("loop", **parts, evidence={}, reason=reason, made_by=made_by(_SOLVER, f"{solves} solved"))


def _observer_fits(plant: str, drift: float | None) -> None:
    if plant != "continuous" or drift is not None:
        raise InputError("an observer in the loop", where="argument gain", expected='plant="continuous", no drift',
                         remedy="Certify loop and observer of the sampled model apart, or the loop without observer.")


def _prove(parts: dict[str, Any], seen: Picture, found: Candidate, pieces: int, solves: int) -> Certificate:
    """The first certificate that the checker proves, more digits and a larger share of the decay given up in turn."""
    top = float(np.abs(found.matrix).max())
    weights = [float(f"{value / top:.{_DIGITS}g}") for value in found.weights]
    reason = "what the solver found does not survive rounding"
    for (slack, larger), matrix in zip(_SLACK, short_matrices(found.matrix), strict=True):
        sizes = [float(f"{larger * value / top:.{_DIGITS}g}") for value in found.sizes]
        c = contraction(seen, parts["region"]["sample_time"], np.array(matrix), np.array(weights), np.array(sizes))
        if not c < 1:
            continue
        evidence: dict[str, Any] = {"matrix": matrix, "pieces": pieces,
                                    "contraction": float(np.ceil((1 - (1 - c) * (1 - slack)) * 1e9) / 1e9)}
        if weights:
            evidence |= {"weights": weights, "sizes": sizes}
        status = f"{solves} matrix inequalities; {100 * slack:g} % of the decay given up for the proof"
        cert = establish("loop", **parts, evidence=evidence, made_by=made_by(_SOLVER, status), margin={})
        if cert.holds:
            return cert
        reason = cert.reason
    return not_certified("loop", **parts, evidence={}, reason=reason, made_by=made_by(_SOLVER, f"{solves} solved"))


def _refused(system: System, seen: Picture | None) -> str:
    """Why no certificate exists; empty where nothing is against one."""
    for link in system.links:
        if link.natural is not None and any(node in system.ambients for node in link.between):
            return (f"natural convection of link {link.name!r} to an ambient has no bounded slope: leave it out, or "
                    "replace it by its least conductance")
    radius = 0.0 if seen is None else frozen(seen.real)
    if not radius < 1:
        return (f"with temperatures and currents frozen at a corner of the box the sampled loop grows by {radius:.6g} "
                "per sample: no certificate exists. Narrow the currents or temperatures, lower the gains or sample "
                "faster.")
    return ""


def _patterns(system: System, section: Mapping[str, Any]) -> list[NDArray[np.bool_]]:
    """First P without entries between hot and cold side, then all entries."""
    names = system.lump_names
    links = [(names.index(a), names.index(b)) for a, b in (link.between for link in system.links)
             if a in names and b in names]
    C = np.array(section["controller"]["C"], float).reshape(len(system.modules), -1)
    own = sides(links, len(names), C, [names.index(part.cold) for part in system.modules.values()])
    return [own, np.ones_like(own)] if not own.all() else [own]


def _scale(seen: Picture, section: Mapping[str, Any]) -> Array:
    """√E of every lump; for a controller state what moves as much heat as one kelvin does."""
    root = np.sqrt(seen.capacity)
    C, D = (np.abs(np.array(section["controller"][key], float)) for key in ("C", "D"))
    heat = D.max(initial=0.0) or 1.0
    states = C.reshape(len(D), -1).max(axis=0, initial=0.0)
    return np.concatenate([root, np.where(states > 0, states, heat) * root.mean() / heat])


def _controller(value: Mapping[str, ArrayLike], n: int, m: int) -> dict[str, list[list[float]]]:
    if not isinstance(value, Mapping) or set(value) != set(_KEYS):
        raise InputError("controller has not the matrices " + ", ".join(_KEYS), where="argument controller",
                         expected="a mapping with exactly these", remedy="Use rt.design.certify_loop.")
    q = len(np.atleast_1d(np.asarray(value["A"], float)))
    shapes = {"A": (q, q), "B": (q, n), "C": (m, q), "D": (m, n), "windup": (q, m)}
    found = {}
    for key, shape in shapes.items():
        matrix = np.asarray(value[key], float)
        if matrix.size == 0 and 0 in shape:
            matrix = matrix.reshape(shape)
        if matrix.shape != shape or not np.isfinite(matrix).all():
            raise InputError(f"{key} has shape {matrix.shape}", where=f"argument controller[{key!r}]",
                             expected=f"finite numbers, {shape}")
        found[key] = matrix.tolist()
    return found


def _number(value: float, name: str, unit: str) -> float:
    if not (np.isfinite(value) and value > 0):
        raise InputError(f"{name} = {value!r}", where=f"argument {name}", expected=f"a positive number [{unit}]")
    return float(value)
