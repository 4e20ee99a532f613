"""Which machine a certificate is about: the short hash in its sentence, and the exact comparison of two machines.

Only what a checker reads counts: comments and other free keys of a file do not. The order of lumps and modules does,
because gain matrices, controllers and weights refer to it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from ._fields import get, mapping, sequence, text
from ._hash import Name, canonical, short_hash
from ._heaters import heaters_of
from ._system import link_names, read_system

if TYPE_CHECKING:
    from ._certificate import Certificate

_CONSTANTS = ("seebeck", "resistance", "conductance", "sink_conductance", "sink_temperature", "setpoint")
_SIZES = {"linear": ("A", "B", "C", "D", "sample_time"), "network": ("capacity", "rows", "cols", "values")}
_ADDED = ("gain", "controller", "operating")  # what observers, loops and feedbacks add to the section of a machine


def machine_hash(system_section: Mapping[str, Any]) -> str:
    """Return the short hash by which a claim names its machine.

    Parameters
    ----------
    system_section : mapping
        Section "system" of a certificate file, SI units; numpy arrays are allowed.

    Returns
    -------
    str
        The first 12 hexadecimal digits of the SHA-256 of every name and number that a checker reads.

    Raises
    ------
    InputError
        If the section is not that of any kind of certificate.

    Examples
    --------
    >>> rod = {"lumps": {"rod": {"capacity": 10.0}}, "ambients": ["room"], "modules": {},
    ...        "links": [{"between": ["rod", "room"], "conductance": 0.5}]}
    >>> machine_hash(rod) == machine_hash({**rod, "lumps": {"rod": {"capacity": "1e1", "comment": "brass"}}})
    True
    """
    return short_hash(_content(system_section))


def same_system(certificate: Certificate, system_section: Mapping[str, Any]) -> bool:
    """Return whether a certificate is about a machine: every name and every number equal, exactly.

    Parameters
    ----------
    certificate : Certificate
        Its section "system" is compared; an observer's gain or a controller only if the other section has one too.
    system_section : mapping
        Section "system" of the machine in hand, SI units.

    Returns
    -------
    bool
        False where any number, name, or the order of lumps or modules differs.

    Raises
    ------
    InputError
        If a section is not that of any kind of certificate.

    Examples
    --------
    >>> from robthermal.verification import establish
    >>> rod = {"lumps": {"rod": {"capacity": 10.0}}, "ambients": ["room"], "modules": {},
    ...        "links": [{"between": ["rod", "room"], "conductance": 0.5}]}
    >>> box = {"temperature": [250.0, 400.0], "current": {}}
    >>> c = establish("contraction", system=rod, region=box, evidence={"method": "energy", "rate": 0.04}, made_by={})
    >>> same_system(c, rod), same_system(c, {**rod, "lumps": {"rod": {"capacity": 10.1}}})
    (True, False)
    """
    own = {key: value for key, value in certificate.system.items() if key not in _ADDED or key in system_section}
    return b"".join(canonical(_content(own))) == b"".join(canonical(_content(system_section)))


def _content(section: Any) -> list[Any]:
    """Return what the hash is about, as a list whose first item is the family of the machine."""
    table = mapping(section, "system")
    if "lumps" in table:
        return _thermal(table)
    if "plant" in table:
        return [Name("closed_loop"), *(get(mapping(get(table, part, "system"), f"system.{part}"), key, f"system.{part}")
                                       for part in ("plant", "controller") for key in "ABCD"),
                *(get(table, key, "system") for key in ("n_meas", "n_ctrl", "sample_time"))]
    if "vertices" in table and not {"gain", "n_meas"} & set(table):
        return [Name("ellipsoid"), get(table, "vertices", "system"),
                *(table.get(key, {}) for key in ("measured", "controller", "performance")),
                get(table, "sample_time", "system")]
    if "vertices" in table:
        own = ["controller", "n_meas", "n_ctrl"] if "n_meas" in table else ["gain"]
        return [Name("polytope"), *(get(table, key, "system") for key in ("vertices", *own, "sample_time"))]
    for family, keys in _SIZES.items():
        if keys[0] in table:
            return [Name(family), *(get(table, key, "system") for key in keys)]
    return [Name("runaway"), Name(table.get("name", "")), *(get(table, key, "system") for key in _CONSTANTS)]


def _thermal(table: Mapping[str, Any]) -> list[Any]:
    system = read_system(table, heaters=True)
    nodes = [Name(lump) for lump in system.lumps]
    links = [[Name(name), *(nodes[end] if isinstance(end, int) else Name(end) for end in link.nodes),
              link.conductance, link.gain, link.exponent, link.radiation]
             for name, link in zip(link_names(table), system.links, strict=True)]
    modules = [[Name(module.name), nodes[module.hot], nodes[module.cold], *module.seebeck, *module.resistance,
                *module.conductance, module.reference] for module in system.modules]
    content = [Name("thermal"), Name(system.name), [[name, c] for name, c in zip(nodes, system.capacity, strict=True)],
               [Name(ambient) for ambient in system.ambients], links, modules]
    if heaters := heaters_of(table, system.lumps):
        content += [Name("inputs"), [[Name(one.name), nodes[one.lump], one.slope[0], one.reference] for one in heaters]]
    if "operating" in table:
        content += [Name("scheduled"), _operating(table, "temperature", system.lumps),
                    _operating(table, "current", [module.name for module in system.modules]),
                    get(table, "gain", "system")]
    elif "gain" in table:
        content += [Name("observer"), [_sensor(item) for item in sequence(table.get("sensors", ()), "system.sensors")],
                    table["gain"]]
    if "controller" in table:
        content += [Name("controller"), table["controller"]]
    return content


def _operating(table: Mapping[str, Any], key: str, names: Sequence[str]) -> list[Any]:
    """Return the numbers of an operating point, in the order of lumps or modules."""
    where = f"system.operating.{key}"
    found = mapping(get(mapping(table["operating"], "system.operating"), key, "system.operating"), where)
    return [get(found, name, where) for name in names]


def _sensor(value: Any) -> list[Any]:
    """Return name, lump and gain of a sensor; a text is a lump that is read as it is."""
    table = mapping({"lump": value} if isinstance(value, str) else value, "system.sensors")
    lump = text(get(table, "lump", "system.sensors"), "system.sensors.lump")
    return [Name(text(table.get("name", lump), "system.sensors.name")), Name(lump), table.get("gain", 1)]
