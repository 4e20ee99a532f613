"""Systems of a certificate with uncertain parameters: names, random ranges, machines drawn from them."""

from __future__ import annotations

import copy


def names_of(system, nonlinear=False):
    """Links and module properties that can be uncertain, with ``nonlinear`` natural convection and radiation too."""
    links = ["-".join(link["between"]) for link in system["links"]]
    once = [(name, link) for name, link in zip(links, system["links"], strict=True) if links.count(name) == 1]
    more = [f"links.{name}.{key}" for name, link in once for key, part in (("natural.gain", "natural"),
                                                                           ("radiation", "radiation")) if part in link]
    return [f"links.{name}.conductance" for name, _ in once] + more * nonlinear + [
        f"modules.m0.{prop}.{key}" for prop in ("seebeck", "resistance", "conductance") for key in ("value", "slope")]


def spans(system, names, rng, count, least=0.4, most=1.8):
    """Random ranges around some of the values."""
    found = {}
    for name in rng.choice(names, count, replace=False):
        value = value_of(system, str(name))
        found[str(name)] = sorted((value * float(rng.uniform(least, 1)), value * float(rng.uniform(1, most))))
    return found


def machines(system, ranges, rng, count):
    """Systems of the ranges, most at the ends."""
    for _ in range(count):
        other = copy.deepcopy(system)
        for name, pair in ranges.items():
            value = float(rng.choice(pair) if rng.random() < 0.8 else pair[0] + rng.random() * (pair[1] - pair[0]))
            table, rest = name.split(".", 1)
            if table == "lumps":
                other["lumps"][rest.removesuffix(".capacity")]["capacity"] = value
            elif table == "inputs":
                other["inputs"][rest.removesuffix(".power_slope")]["power_slope"] = value
            elif table == "links":
                table, key = link_number(other, rest)
                table[key] = value
            else:
                part, prop, key = rest.split(".")
                other["modules"][part][prop][key] = value
        yield other


def link_number(system, rest):
    """The table that holds a number of a link, and its key there."""
    link = next(li for li in system["links"] if rest.startswith(li.get("name", "-".join(li["between"])) + "."))
    return (link["natural"], "gain") if rest.endswith(".natural.gain") else (link, rest.rpartition(".")[2])


def value_of(system, name):
    table, rest = name.split(".", 1)
    if table == "lumps":
        return system["lumps"][rest.removesuffix(".capacity")]["capacity"]
    if table == "links":
        found, key = link_number(system, rest)
        return found[key]
    part, prop, key = rest.split(".")
    return system["modules"][part][prop][key]
