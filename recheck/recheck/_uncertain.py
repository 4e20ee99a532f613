"""Uncertain numbers of a network: intervals of capacities and links, combinations of ends for modules."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from itertools import product
from typing import Any

from ._exact import ZERO, Interval, Malformed, NotCovered, short
from ._hash import link_name
from ._thermal import PROPERTIES, Form, Link, Network, read_nominal

_MOST = 300  # uncertain numbers


def read_network(system: Mapping[str, Any], region: Mapping[str, Any], *, gains: bool = False,
                 heaters: bool = False) -> Network:
    """Return network and box of a certificate; ``gains``: also gain and radiation of links may be uncertain.

    ``heaters``: the claim takes heaters into account whose power follows temperature.
    """
    network = read_nominal(system, region, heaters=heaters)
    if len(network.parameters) > _MOST:
        raise NotCovered(f"{len(network.parameters)} uncertain numbers are too many, at most {_MOST}")
    index: dict[str, list[int]] = {}
    for k, link in enumerate(system["links"]):
        index.setdefault(link_name(link), []).append(k)
    links = {name: found[0] for name, found in index.items() if len(found) == 1}
    for parameter, box in network.parameters.items():
        table, _, rest = parameter.partition(".")
        part, _, key = rest.rpartition(".")
        owner, _, last = part.rpartition(".")
        if table == "lumps" and key == "capacity":
            network = _capacity(network, part, box)
        elif table == "links" and part in links and key == "conductance":
            network = _link(network, links[part], box, key)
        elif gains and table == "links" and part in links and key == "radiation":
            network = _link(network, links[part], box, key)
        elif gains and (table, last, key) == ("links", "natural", "gain") and owner in links:
            network = _link(network, links[owner], box, key)
        elif (table, key) == ("inputs", "power_slope") and part in [heater.name for heater in network.heaters]:
            network = _slope(network, part, box)
        elif not (table == "modules" and last in PROPERTIES and key in ("value", "slope")):
            raise Malformed(f"region.parameters[{short(parameter)}]: no such number can be uncertain")
    return _with_forms(network)


def _capacity(network: Network, name: str, box: Interval) -> Network:
    if name not in network.lumps or box[0] <= 0:
        raise Malformed(f"region.parameters: no lump {short(name)}, or its capacity may be 0 or less")
    k = network.lumps.index(name)
    _contains(box, network.capacity[k][0], name)
    return replace(network, capacity=(*network.capacity[:k], box, *network.capacity[k + 1:]))


def _link(network: Network, k: int, box: Interval, key: str) -> Network:
    link = network.links[k]
    given, nominal = {"conductance": (replace(link, conductance=box), link.conductance),
                      "radiation": (replace(link, radiation=box), link.radiation),
                      "gain": (replace(link, gain=box), link.gain)}[key]
    _contains(box, nominal[0], key)
    if box[0] < 0:
        raise Malformed(f"region.parameters: a {key} may be negative")
    return replace(network, links=(*network.links[:k], given, *network.links[k + 1:]))


def _slope(network: Network, name: str, box: Interval) -> Network:
    own = next(heater for heater in network.heaters if heater.name == name)
    _contains(box, own.slope[0], name)
    return replace(network, heaters=tuple(replace(heater, slope=box) if heater is own else heater
                                          for heater in network.heaters))


def with_rises(network: Network) -> Network:
    """Return the network with the slope of every heat of a heater as a link to somewhere, of conductance below zero."""
    links = [Link((heater.lump, ""), (-heater.rise[1], -heater.rise[0]), (ZERO, ZERO), ZERO, (ZERO, ZERO))
             for heater in network.heaters]
    return replace(network, links=(*network.links, *links))


def _with_forms(network: Network) -> Network:
    """Return the network with the combinations of the ends of all uncertain numbers of modules."""
    chosen: dict[str, dict[tuple[int, int], Interval]] = {module.name: {} for module in network.modules}
    for parameter, box in network.parameters.items():
        if parameter.startswith("modules."):
            owner, key = parameter.removeprefix("modules.").rsplit(".", 1)
            name, _, last = owner.rpartition(".")
            if name not in chosen:
                raise Malformed(f"region.parameters[{short(parameter)}]: no such module")
            chosen[name][PROPERTIES.index(last), ("value", "slope").index(key)] = box
    modules = []
    for module in network.modules:
        for (row, column), box in chosen[module.name].items():
            _contains(box, module.nominal[row][column], module.name)
        modules.append(replace(module, forms=_forms(module.nominal, chosen[module.name])))
    return replace(network, modules=tuple(modules))


def _forms(nominal: Form, own: Mapping[tuple[int, int], Interval]) -> tuple[Form, ...]:
    found = []
    for values in product(*(sorted(set(box)) for box in own.values())):
        table: list[list[Fraction]] = [list(pair) for pair in nominal]
        for (row, column), value in zip(own, values, strict=True):
            table[row][column] = value
        found.append(_form(table))
    return tuple(found)


def _form(table: Sequence[Sequence[Fraction]]) -> Form:
    S, R, K = ((pair[0], pair[1]) for pair in table)
    return S, R, K


def _contains(box: Interval, nominal: Fraction, name: str) -> None:
    if not box[0] <= nominal <= box[1]:
        raise Malformed(f"region.parameters: the range does not contain the number of the system ({short(name)})")
