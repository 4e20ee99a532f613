"""The Jacobian of a network whose modules hold their cold lumps, reduced to the other lumps.

Module m holds lump c at x_c; v = S x_c I - R I²/2 is the heat it pumps. The balance of c gives v as a function of the
other temperatures, with slopes r_j = ∂(heat into c)/∂x_j, and the hot lump h feels v with the factor
κ = (S x_h + R I)/(S x_c - R I). Per module, with k = K(x_h), b = S' x_c I/2 - R' I²/4 (proof note, 12):
  J_hh gains a + (κ - 1) k,  a = S I + S' x_h I/2 + R' I²/4 - κ b;  J_hj gains κ r_j for all that c is linked to.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

from flint import fmpq

from ._fields import Interval
from ._lyapunov import link_slopes
from ._numbers import name_of, show
from ._slopes import exchange_slope, least_ambient_slope, radiation_slope
from ._system import Link, Quadratic, Region, ThermalSystem, peak
from ._vertices import Entries, clusters, count, describe, hull, vertices

Groups = list[list["Alternative"]]
_Pair = tuple[fmpq, fmpq]
_MOST = 5_000  # vertices of modules that share lumps


@dataclass(frozen=True)
class RegulatedNetwork:
    """A network in a box, and which module holds which lump; ``region`` has the set-points of held lumps."""

    system: ThermalSystem
    region: Region
    holder: Mapping[int, int]

    @property
    def free(self) -> list[int]:
        """Lumps that nothing holds."""
        return [k for k in range(len(self.system.lumps)) if k not in self.holder]


@dataclass(frozen=True)
class Alternative:
    """One value of a share of the Jacobian, and where in the box that is."""

    entries: Entries
    where: str


@dataclass(frozen=True)
class RegulatingModule:
    """A regulating module over its box: corners (a, κ) whose hull has all of them, the range of κ, the ends of k."""

    corners: tuple[_Pair, ...]
    factor: Interval
    conduction: Interval


def lost_regulation(network: RegulatedNetwork) -> str:
    """Return where S > 0 or S x_c - R I > 0 is not proven; empty if every module holds its lump over the whole box."""
    for c, k in network.holder.items():
        module, names = network.system.modules[k], network.system.lumps
        least = min(seebeck for _, seebeck in _resistances(network, k))
        if least <= 0:
            return f"S > 0 fails: the Seebeck coefficient of {name_of(module.name)} reaches {show(least)} V/K"
        highest = _times(network.region.current[k], _ratio(network, k))[1]
        coldest = network.region.temperature[c][0]
        if coldest <= highest:
            return (f"S x_c - R I > 0 fails or cannot be proven for {name_of(module.name)}: R I/S may reach "
                    f"{show(highest)} K, the set-point of {name_of(names[c])} {show(coldest)} K. More current does not "
                    "take more heat there, so no controller holds the cold lump")
    return ""


def shares(network: RegulatedNetwork, method: str, pieces: int) -> tuple[Entries, Groups, str]:
    """Return the reduced Jacobian: what is fixed, independent groups of alternatives, and what has no bound.

    The Jacobian lies in the hull of fixed part + one alternative of every group. Currents are cut in ``pieces``.
    """
    modules = {c: regulating_module(network, k, pieces) for c, k in network.holder.items()}
    fixed, nonlinear, missing = _links(network, method)
    others, missing = _other_modules(network, pieces) if not missing else ([], missing)
    if any(len(group) << len(_regulated_lumps(group, modules)) > 4 * _MOST for group in nonlinear + others):
        return {}, [], "too many combinations of modules that share lumps with cold faces to check them one by one"
    groups = [_passed_on(network, group, modules) for group in nonlinear + others]
    rows: dict[int, dict[int, fmpq]] = {c: {} for c in network.holder}
    for (i, j), value in fixed.items():
        if i in rows:
            rows[i][j] = value
    groups += [_holding(network, k, modules[c], rows[c]) for c, k in network.holder.items()]
    base = {place: value for place, value in fixed.items() if place[0] not in network.holder}
    return base, [group for group in groups if any(item.entries for item in group)], missing


def regulating_module(network: RegulatedNetwork, k: int, pieces: int) -> RegulatingModule:
    """Return what module k does to its hot lump; `lost_regulation` must have found nothing.

    On each piece of its current, a = p - κ b with p, κ and b anywhere in their own ranges: the corners of these.
    """
    module, region = network.system.modules[k], network.region
    hot, cold = region.temperature[module.hot], region.temperature[module.cold]
    corners: list[_Pair] = []
    for current in _cut(region.current[k], pieces):
        shift = _times(current, _ratio(network, k))  # R I/S [K]
        factor = _range([(x + t) / (y - t) for x, t, y in product(hot, shift, cold)])
        own, bend = _own_slopes(network, k, current)
        corners += [(p - f * b, f) for p, f, b in product(own, factor, bend)]
    conduction = _range([form.conductance[0] + form.conductance[1] * (x - module.reference)
                         for form in network.system.forms(k) for x in hot])
    return RegulatingModule(tuple(_outline(corners)), _range([factor for _, factor in corners]), conduction)


def _own_slopes(network: RegulatedNetwork, k: int, current: Interval) -> tuple[Interval, Interval]:
    """Return the exact ranges of p = S I + S' x_h I/2 + R' I²/4 and b = S' x_c I/2 - R' I²/4 over currents.

    Affine in each temperature and parameter for a given current, quadratic in the current.
    """
    module, box = network.system.modules[k], network.region.temperature
    own: list[fmpq] = []
    bend: list[fmpq] = []
    for form, x, y in product(network.system.forms(k), box[module.hot], box[module.cold]):
        (S, dS), dR = form.seebeck, form.resistance[1]
        own += _bounds((fmpq(0), S + dS * (x + y / 2 - module.reference), dR / 4), current)
        bend += _bounds((fmpq(0), dS * y / 2, -dR / 4), current)
    return _range(own), _range(bend)


def _bounds(quadratic: Quadratic, currents: Interval) -> Interval:
    a, b, c = quadratic
    return -peak((-a, -b, -c), currents)[0], peak(quadratic, currents)[0]


def _holding(network: RegulatedNetwork, k: int, own: RegulatingModule, slopes: Mapping[int, fmpq]) -> list[Alternative]:
    """Return the alternatives of one regulating module; ``slopes`` are the fixed r_j of its cold lump."""
    module = network.system.modules[k]
    h, found = module.hot, []
    for (a, factor), conduction in product(own.corners, sorted(set(own.conduction))):
        entries: Entries = {(h, j): factor * value for j, value in slopes.items()}
        _add(entries, {(h, h): a + (factor - 1) * conduction})
        found.append(Alternative(entries, f"{name_of(module.name)}: dQ_hot/dQ_cold = {show(factor)}"))
    return found


def _passed_on(network: RegulatedNetwork, group: Sequence[Alternative],
               modules: Mapping[int, RegulatingModule]) -> list[Alternative]:
    """Return alternatives with the rows of held lumps passed on to the hot lumps, with either end of their factors."""
    held = _regulated_lumps(group, modules)
    found = []
    for item, factors in product(group, product(*(sorted(set(modules[c].factor)) for c in held))):
        at = dict(zip(held, factors, strict=True))
        entries: Entries = {}
        for (i, j), value in item.entries.items():
            if i in at:
                _add(entries, {(network.system.modules[network.holder[i]].hot, j): at[i] * value})
            else:
                _add(entries, {(i, j): value})
        found.append(Alternative(entries, item.where))
    return found


def _regulated_lumps(group: Sequence[Alternative], modules: Mapping[int, RegulatingModule]) -> list[int]:
    """Return the held lumps that a group touches."""
    return sorted({i for item in group for i, _ in item.entries if i in modules})


def _links(network: RegulatedNetwork, method: str) -> tuple[Entries, Groups, str]:
    """Return the links without columns of held lumps: fixed part, ends of slopes that vary, and what has no bound.

    Where less slope is always worse (losses to ambients unless P is full; for "energy" all links between free lumps)
    the least one is taken.
    """
    fixed: Entries = {}
    rest = []
    for link in network.system.links:
        lumps = [node for node in link.nodes if isinstance(node, int)]
        if all(k in network.holder for k in lumps):
            continue  # heat that both trajectories share
        if method != "lyapunov" and len(lumps) == 1:
            _add(fixed, {(lumps[0], lumps[0]): -least_ambient_slope(link, lumps[0], network.region)})
        elif method == "energy" and not any(k in network.holder for k in lumps):
            _add(fixed, _above(link, lumps[0], lumps[1], network.region))
        else:
            rest.append(link)
    base, nonlinear, missing = link_slopes(replace(network.system, links=tuple(rest)), network.region)
    _add(fixed, _without(base, network))
    return fixed, [[Alternative(_without(entries, network), words) for entries, words, _ in items]
                   for items in nonlinear], missing


def _other_modules(network: RegulatedNetwork, pieces: int) -> tuple[Groups, str]:
    """Return the modules that hold nothing, with any currents of their ranges."""
    kept = [k for k in range(len(network.system.modules)) if k not in network.holder.values()]
    system = replace(network.system, modules=tuple(network.system.modules[k] for k in kept),
                     variants=tuple(network.system.forms(k) for k in kept))
    region = Region(network.region.temperature, tuple(network.region.current[k] for k in kept))
    points = [hull(interval, pieces) for interval in region.current]
    groups = []
    for cluster in clusters(system):
        if count(system, cluster, region, points) > _MOST:
            return [], "too many vertices of modules that share lumps to check them one by one"
        groups.append([Alternative(_without(vertex.entries, network), describe(system, cluster, vertex))
                       for vertex in vertices(system, region, cluster, points)])
    return groups, ""


def _resistances(network: RegulatedNetwork, k: int) -> list[_Pair]:
    """Return R and S of a module at all ends of its mean temperature and parameters."""
    module, box = network.system.modules[k], network.region.temperature
    found = []
    for hot, cold in zip(box[module.hot], box[module.cold], strict=True):
        offset = (hot + cold) / 2 - module.reference
        found += [(form.resistance[0] + form.resistance[1] * offset, form.seebeck[0] + form.seebeck[1] * offset)
                  for form in network.system.forms(k)]
    return found


def _ratio(network: RegulatedNetwork, k: int) -> Interval:
    """Return the exact range of R/S [K/A]: monotone in the temperature and in each parameter, so at their ends."""
    return _range([resistance / seebeck for resistance, seebeck in _resistances(network, k)])


def _above(link: Link, a: int, b: int, region: Region) -> Entries:
    """Return a matrix whose symmetric part is above that of the link's Jacobian (proof note, 3)."""
    here, there = region.temperature[a], region.temperature[b]
    g = link.conductance + exchange_slope(link, here, there)[0]
    u, v = radiation_slope(link, here), radiation_slope(link, there)
    return {(a, a): -g - u[0] + (v[1] - v[0]) / 4, (a, b): g + v[0],
            (b, b): -g - v[0] + (u[1] - u[0]) / 4, (b, a): g + u[0]}


def _outline(points: Sequence[_Pair]) -> list[_Pair]:
    """Return the corners of the convex hull of points in the plane (monotone chain, exact)."""
    chain: list[_Pair] = []
    for ordered in (sorted(set(points)), sorted(set(points), reverse=True)):
        half: list[_Pair] = []
        for point in ordered:
            while len(half) > 1 and _turn(half[-2], half[-1], point) <= 0:
                half.pop()
            half.append(point)
        chain += half[:-1] if len(half) > 1 else half
    return list(dict.fromkeys(chain))


def _turn(o: _Pair, p: _Pair, q: _Pair) -> fmpq:
    return (p[0] - o[0]) * (q[1] - o[1]) - (p[1] - o[1]) * (q[0] - o[0])


def _cut(interval: Interval, pieces: int) -> list[Interval]:
    low, high = interval
    if low == high:
        return [interval]
    marks = [low + (high - low) * k / pieces for k in range(pieces + 1)]
    return list(zip(marks[:-1], marks[1:], strict=True))


def _range(values: Sequence[fmpq]) -> Interval:
    return min(values), max(values)


def _times(a: Interval, b: Interval) -> Interval:
    return _range([x * y for x, y in product(a, b)])


def _without(entries: Entries, network: RegulatedNetwork) -> Entries:
    """Drop the columns of held temperatures."""
    return {place: value for place, value in entries.items() if place[1] not in network.holder}


def _add(total: Entries, entries: Entries) -> None:
    for place, value in entries.items():
        total[place] = total.get(place, fmpq(0)) + value
