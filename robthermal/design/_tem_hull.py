"""The slopes ∂f/∂x and ∂f/∂I of a network with modules over a box, as points whose hull holds them all; in floats."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from .._arrays import Places
from .._control import control
from ..certify import claim_box
from ..errors import InputError
from ..thermal import Equations, Module, System
from ._modules import Array

_MOST = 4096  # joint vertices of `tem_polytope`
_CONSTANT = (".heat", ".self_heating")  # heats without slopes
_SAME = 1e-12  # relative: two control points closer than this are one
_CHUNK = 2048


@dataclass(frozen=True)
class TemHull:
    """E⁻¹ (base + one part of every group): slopes (A, B) [1/s, K/(s A)].

    base: (n, n); groups: per group parts of A (k, n, n) and of B (k, n, m).
    """

    base: Array
    groups: tuple[tuple[Array, Array], ...]

    @property
    def count(self) -> int:
        """Number of joint vertices."""
        return int(np.prod([float(len(parts)) for parts, _ in self.groups]))

    def at(self, numbers: Places) -> tuple[Array, Array]:
        """A and B of some joint vertices."""
        n, m = len(self.base), self.groups[0][1].shape[2]
        A, B = np.repeat(self.base[None], len(numbers), axis=0), np.zeros((len(numbers), n, m))
        rest = np.asarray(numbers)
        for parts, inputs in self.groups:
            rest, own = np.divmod(rest, len(parts))
            A += parts[own]
            B += inputs[own]
        return A, B

    def chunks(self) -> Iterator[tuple[Places, Array, Array]]:
        """All joint vertices, some at a time: their numbers, A and B."""
        for first in range(0, self.count, _CHUNK):
            numbers = np.arange(first, min(first + _CHUNK, self.count))
            yield numbers, *self.at(numbers)


def tem_hull(system: System, box: Mapping[str, Mapping[str, Sequence[float]]]) -> TemHull:
    """Hull over a box with ranges of every lump, module and ambient, as `read_box` returns it."""
    temperature, current = box["temperature"], box["current"]
    ambient, parameters = box["ambient"], box["parameters"]
    worst = system.with_parameters({name: low for name, (low, _) in parameters.items() if name.startswith("links.")})
    eq, index = Equations(worst), {name: k for k, name in enumerate(system.lumps)}
    n, m = len(index), len(system.modules)
    base, groups = eq.A.toarray(), []
    for k, (name, module) in enumerate(worst.modules.items()):
        h, c, K = index[module.hot], index[module.cold], module.conductance.value
        base[[h, c], [h, c]] += K
        base[[h, c], [c, h]] -= K
        own = {key: sorted(set(pair)) for key, pair in parameters.items() if key.startswith(f"modules.{name}.")}
        forms = [worst.with_parameters(dict(zip(own, values, strict=True))).modules[name]
                 for values in product(*own.values())]
        points = np.concatenate([control_points(form, temperature[module.hot], temperature[module.cold], current[name])
                                 for form in forms])
        A, B = np.zeros((len(points), n, n)), np.zeros((len(points), n, m))
        A[:, h, h], A[:, h, c], A[:, c, h], A[:, c, c] = points[:, :4].T
        B[:, h, k], B[:, c, k] = points[:, 4:].T
        groups.append((A, B))
    still = np.zeros((1, n, m))
    for link in worst.links:
        ends = [(index.get(name, -1), temperature[name] if name in index else ambient[name]) for name in link.between]
        for slopes, entries in _link(link, ends, parameters):
            part = np.zeros((len(slopes), n, n))
            for i, j, sign in entries:
                part[:, i, j] += sign * slopes
            groups.append((part, np.repeat(still, len(slopes), axis=0)))
    capacity = eq.capacity[:, None]
    return TemHull(base / capacity, tuple((A / capacity, B / capacity) for A, B in groups))


def _link(link: Any, ends: list[tuple[int, Sequence[float]]], parameters: Mapping[str, Sequence[float]]
          ) -> Iterator[tuple[Array, list[tuple[int, int, float]]]]:
    """Ends of every slope that varies, and where it enters."""
    def of(key: str, value: float) -> tuple[float, float]:
        low, high = parameters.get(f"links.{link.name}.{key}", (value, value))
        return float(low), float(high)

    lumps = [i for i, _ in ends if i >= 0]
    exchange = [(i, j, -1.0 if i == j else 1.0) for i in lumps for j in lumps]
    (_, (a, b)), (_, (c, d)) = ends
    low, high = of("conductance", link.conductance)
    steep = np.array([0.0, high - low])
    if link.natural is not None:
        far, near = max(abs(a - d), abs(b - c)), 0.0 if a - d <= 0 <= b - c else min(abs(a - d), abs(b - c))
        gains, e = of("natural.gain", link.natural.gain), link.natural.exponent
        steep = steep + np.array([gains[0] * near**e, gains[1] * far**e]) * (1 + e)
    if steep.any() and lumps:
        yield np.unique(steep), exchange
    if link.radiation is not None:
        weak, strong = of("radiation", link.radiation)
        for i, pair in ends:
            if i >= 0:
                yield (np.unique([4 * weak * pair[0] ** 3, 4 * strong * pair[1] ** 3]),
                       [(row, column, sign) for row, column, sign in exchange if column == i])


def control_points(module: Module, hot: Sequence[float], cold: Sequence[float], current: Sequence[float]) -> Array:
    """Bernstein's control points of (J_hh, J_hc, J_ch, J_cc, ∂f_h/∂I, ∂f_c/∂I), of degree two at most in each of the
    temperatures and the current: their hull holds all slopes. Shape (k, 6)."""
    axes = [np.unique([low, (low + high) / 2, high]) for low, high in (hot, cold, current)]
    values = _slopes(module, *np.meshgrid(*axes, indexing="ij"))
    for axis in range(3):
        if values.shape[axis] == 3:
            low, middle, high = (np.take(values, k, axis) for k in range(3))
            chord = (low + high) / 2
            raised = 2 * middle - chord
            linear = np.abs(raised - chord).max() <= _SAME * np.abs(values).max()
            values = np.stack([low, high] if linear else [low, raised, high], axis)
    return np.unique(values.reshape(-1, 6), axis=0)


def _slopes(module: Module, hot: Array, cold: Array, current: Array) -> Array:
    dT = (hot + cold) / 2 - module.reference_temperature
    S, R, K = (part.value + part.slope * dT for part in (module.seebeck, module.resistance, module.conductance))
    dS, dR, dK = (part.slope / 2 for part in (module.seebeck, module.resistance, module.conductance))
    joule, flow = dR * current**2 / 2, dK * (cold - hot)
    return np.stack([flow - K + S * current + dS * hot * current + joule, flow + K + dS * hot * current + joule,
                     -flow + K - dS * cold * current + joule, -flow - K - S * current - dS * cold * current + joule,
                     S * hot + R * current, R * current - S * cold], axis=-1)


def tem_polytope(system: System, *, temperature: Any, current: Any, covariance: Any = None, probability: float = 0.95,
                 ambient: Mapping[str, tuple[float, float]] | None = None) -> list[control.StateSpace]:
    """Linear plants whose convex hull holds every slope (∂f/∂x, ∂f/∂I) of a network over a box.

    Parameters
    ----------
    system : System
        Network with at least one module.
    temperature : tuple or mapping
        Box [K]: (lower, upper) for all lumps, or {lump: (lower, upper)}.
    current : tuple or mapping
        (lower, upper) for every module, or {module: (lower, upper)} [A].
    covariance : Estimates or mapping, optional
        Result of a calibration, whose joint ranges at `probability` are covered, or {parameter: (lower, upper)};
        of links, modules and capacities.
    probability : float
        Probability of the ranges of a calibration [-].
    ambient : mapping, optional
        {ambient: (lower, upper)} [K], for convection to it; default its nominal temperature.

    Returns
    -------
    list of control.StateSpace
        Vertices: states are the temperatures of the lumps, inputs the currents of the modules, outputs the states. In
        floats: `rt.certify.scheduled` builds its own hull.

    Raises
    ------
    InputError
        Boxes that do not fit the system, more than 4096 vertices, effects whose slopes the hull does not hold.

    References
    ----------
    Farouki, The Bernstein polynomial basis: a centennial retrospective, Computer Aided Geometric Design 29 (2012).

    Examples
    --------
    >>> import robthermal as rt
    >>> plants = rt.design.tem_polytope(rt.systems.two_module(), temperature=(280.0, 320.0), current=(0.0, 1.0))
    >>> len(plants), plants[0].nstates, plants[0].input_labels
    (729, 18, ['m1', 'm2'])
    """
    box = read_box(system, temperature, current, covariance, probability, ambient, capacities=True)
    _refuse_effects(system)
    hull, shares = tem_hull(system, box), _capacity_shares(system, box["parameters"])
    if hull.count * len(shares) > _MOST:
        raise InputError(f"{hull.count * len(shares)} vertices", where="argument system", expected=f"at most {_MOST}",
                         remedy="rt.design.tem_feedback takes up those that matter; or take fewer uncertain numbers.")
    names, eye = list(system.lump_names), np.eye(len(system.lumps))
    zero = np.zeros((len(names), len(system.modules)))
    return [control.ss(share * A, share * B, eye, zero, states=names, inputs=list(system.module_names), outputs=names)
            for share in shares for A, B in zip(*hull.at(np.arange(hull.count)), strict=True)]


def _refuse_effects(system: System) -> None:
    """A hull that leaves out the slope of a heat holds those of another machine."""
    for name in system.effects:
        if not name.endswith(_CONSTANT) or name.endswith(".hysteresis.heat"):
            raise InputError(f"{name} = {system.parameter(name):g} has slopes that this hull does not hold",
                             where="argument system", expected="a network of links, modules and lumps only",
                             remedy="Set it to 0; a conductance that it changes can be a range of `covariance`.")


def _capacity_shares(system: System, parameters: Mapping[str, Sequence[float]]) -> list[Array]:
    """Nominal over uncertain capacity of every lump, columns, at all corners of the ranges.

    E⁻¹J is affine in every 1/c_i and in J: the corners of both make vertices of all of it.
    """
    ends = [[lump.capacity / value for value in sorted(set(parameters.get(f"lumps.{name}.capacity", [lump.capacity])))]
            for name, lump in system.lumps.items()]
    return [np.array(corner)[:, None] for corner in product(*ends)]


def read_box(system: System, temperature: Any, current: Any, covariance: Any, probability: float,
             ambient: Mapping[str, tuple[float, float]] | None, capacities: bool = False
             ) -> dict[str, dict[str, Sequence[float]]]:
    """Check a box against the system: what the certificate will say of it; `capacities`: may have ranges."""
    if not isinstance(system, System) or not system.modules:
        raise InputError("a system without modules" if isinstance(system, System) else f"a {type(system).__name__}",
                         where="argument system", expected="a robthermal.System with at least one module")
    currents = current if isinstance(current, Mapping) else dict.fromkeys(system.module_names, current)
    box = claim_box(system, current=currents, temperature=temperature, ambient=ambient,
                    parameters=parameter_ranges(covariance, probability))
    uncertain = [name for name in box["parameters"] if name.startswith("lumps.")]
    if uncertain and not capacities:
        raise InputError(f"a range of {uncertain[0]} cannot be covered", where="argument covariance",
                         expected="ranges of links and modules",
                         remedy='Hold capacities at their values: leave "lumps..." out of fit.ranges(probability) and '
                                "give the rest. rt.design.tem_polytope takes ranges of capacities.")
    return box


def parameter_ranges(covariance: Any, probability: float) -> dict[str, tuple[float, float]]:
    """Ranges of uncertain numbers, from a calibration or as given."""
    if covariance is None:
        return {}
    if isinstance(covariance, Mapping):
        return dict(covariance)
    if not hasattr(covariance, "ranges"):
        raise InputError(f"covariance is a {type(covariance).__name__}", where="argument covariance",
                         expected="the result of rt.calibrate, or {parameter: (lower, upper)}")
    found: dict[str, tuple[float, float]] = covariance.ranges(probability)
    return found
