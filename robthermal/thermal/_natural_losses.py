"""Losses to the surroundings by air that moves by itself, instead of constant conductances."""

from __future__ import annotations

from collections.abc import Collection

from ..errors import InputError
from ._parts import FitRange, Link, Natural
from ._system import System


def constant_losses(system: System) -> tuple[str, ...]:
    """Links to an ambient that have a constant conductance and nothing else.

    Parameters
    ----------
    system : System
        Network of lumps, links and ambients.

    Returns
    -------
    tuple of str
        Names of the links.

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.thermal.constant_losses(rt.systems.two_module())[:3]
    ('x1-room', 'x2-room', 'x5-room')
    """
    return tuple(link.name for link in system.links
                 if link.conductance > 0 and any(end in system.ambients for end in link.between)
                 and not (link.natural or link.radiation or link.step or link.follow or link.temperature_law))


def natural_losses(system: System, links: Collection[str] | None = None, *, exponent: float = 0.25) -> System:
    """Take conductances G to an ambient as natural convection: the heat is ``G (|ΔT| / 10 K)^exponent ΔT``.

    A conductance holds at a difference of 10 K; its range in the fit table becomes one of the gain.

    Parameters
    ----------
    system : System
        With conductances to ambients; it is not changed.
    links : collection of str, optional
        Names of links to an ambient with a conductance and nothing else; default all of them.
    exponent : float
        Power of the difference [-]: 1/4 for laminar flow, 1/3 for turbulent flow (Churchill and Chu 1975).

    Returns
    -------
    System

    Raises
    ------
    InputError
        If a link does not exist, joins no ambient, or has more than a constant conductance.

    Examples
    --------
    >>> import robthermal as rt
    >>> bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 100.0}},
    ...                 links=[{"between": ("bar", "room"), "conductance": 0.5}])
    >>> airy = rt.thermal.natural_losses(bar)
    >>> round(airy.parameter("links.bar-room.natural.gain") * 10.0**0.25, 12)
    0.5
    """
    possible = constant_losses(system)
    chosen = possible if links is None else tuple(links)
    if unknown := [name for name in chosen if name not in possible]:
        raise InputError(f"link {unknown[0]!r} is no constant conductance to an ambient", where="argument links",
                         expected="some of " + (", ".join(possible) or "none: there are no such links"),
                         remedy="Name links between a lump and an ambient that have a conductance alone.")
    scale = Natural.as_much_as(1.0, exponent).gain
    changed = [_convective(link, exponent) if link.name in chosen else link for link in system.links]
    moved = {f"links.{name}.conductance": f"links.{name}.natural.gain" for name in chosen}
    fit = {moved.get(name, name): _scaled(one, scale) if name in moved else one for name, one in system.fit.items()}
    return system.model_copy(update={"links": tuple(changed), "fit": fit})


def _convective(link: Link, exponent: float) -> Link:
    return Link(between=link.between, name=link.name, natural=Natural.as_much_as(link.conductance, exponent))


def _scaled(one: FitRange, scale: float) -> FitRange:
    return FitRange(lower=one.lower * scale, upper=one.upper * scale,
                    sigma=None if one.sigma is None else one.sigma * scale)
