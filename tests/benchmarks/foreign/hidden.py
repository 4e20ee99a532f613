"""What is hidden in a machine: effects of the catalog at cells, never at lumps, and effects outside it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.signal import lfilter

from .field import Array, Heat
from .machines import ROOM, Machine


@dataclass
class Hidden:
    """Beside a changed field: heats, what the inputs become (n sub, columns), lags and gains of sensors."""

    heats: list[Heat] = field(default_factory=list)
    drive: Callable[[Array, float], Array] = lambda U, dt: U
    lags: dict[int, float] = field(default_factory=dict)
    gains: dict[int, float] = field(default_factory=dict)


def middle(cells: Array, share: float = 0.3) -> Array:
    """Patch in the middle of a zone."""
    n = max(1, round(share * len(cells)))
    first = (len(cells) - n) // 2
    return cells[first:first + n]


def _column(m: Machine, name: str) -> int:
    return m.plant.columns.index(name)


def missing_link(m: Machine, where: tuple[str, ...], size: float) -> Hidden:
    """A bridge between the middles of two lumps."""
    m.plant.bridge(middle(m.plant.zones[where[0]]), middle(m.plant.zones[where[1]]), size)
    return Hidden()


def missing_ambient_link(m: Machine, where: tuple[str, ...], size: float) -> Hidden:
    """A path from the middle of a lump to an ambient."""
    m.plant.lose(middle(m.plant.zones[where[0]]), where[1], size)
    return Hidden()


def _power(m: Machine, where: tuple[str, ...], law: Callable[[Array, float], Array]) -> Hidden:
    cells, k = m.plant.zones[where[0]], _column(m, where[1])

    def heat(t: float, T: Array, u: Array, Q: Array) -> None:
        Q[cells] += law(T[cells], u[k]) / len(cells)

    return Hidden([heat])


def radiation(m: Machine, where: tuple[str, ...], size: float) -> Hidden:
    """All cells of a lump radiate."""
    return _power(m, where, lambda T, a: size * (a**4 - T**4))


def natural_convection(m: Machine, where: tuple[str, ...], size: float) -> Hidden:
    """All cells of a lump convect with |ΔT|^(5/4)."""
    return _power(m, where, lambda T, a: size * np.abs(a - T) ** 0.25 * (a - T))


def hidden_mass(m: Machine, where: tuple[str, ...], size: float) -> Hidden:
    """A block of three cells behind a conductance that gives it a time constant of 3 min."""
    mass = m.plant.chain(3, size, 50.0 * size / 180.0)
    m.plant.bridge(middle(m.plant.zones[where[0]]), mass[:1], size / 180.0)
    return Hidden()


def sensor_lag(m: Machine, where: tuple[str, ...], size: float) -> Hidden:
    """A late sensor."""
    return Hidden(lags={list(m.plant.sensors).index(where[0]): size})


def sensor_gain(m: Machine, where: tuple[str, ...], size: float) -> Hidden:
    """A sensor with a wrong slope about the room temperature."""
    return Hidden(gains={list(m.plant.sensors).index(where[0]): size})


def input_lag(m: Machine, where: tuple[str, ...], size: float) -> Hidden:
    """A heater that follows its input with a lag."""
    k = _column(m, where[0])

    def drive(U: Array, dt: float) -> Array:
        U = U.copy()
        U[:, k] = lagged(U[:, k], size, dt)
        return U

    return Hidden(drive=drive)


def input_delay(m: Machine, where: tuple[str, ...], size: float) -> Hidden:
    """A heater that follows its input late."""
    k = _column(m, where[0])

    def drive(U: Array, dt: float) -> Array:
        U = U.copy()
        U[:, k] = np.interp(np.arange(len(U)) - size / dt, np.arange(len(U)), U[:, k])
        return U

    return Hidden(drive=drive)


def heater_power_slope(m: Machine, where: tuple[str, ...], size: float) -> Hidden:
    """A heater whose power depends on its own temperature."""
    k, cells = _column(m, where[0]), m.plant.heaters[where[0]]

    def heat(t: float, T: Array, u: Array, Q: Array) -> None:
        Q[cells] += u[k] * size * (T[cells] - ROOM) / len(cells)

    return Hidden([heat])


def input_feedthrough(m: Machine, where: tuple[str, ...], size: float) -> Hidden:
    """A share of the heat goes elsewhere."""
    k, here, there = _column(m, where[0]), m.plant.heaters[where[0]], middle(m.plant.zones[where[1]])

    def heat(t: float, T: Array, u: Array, Q: Array) -> None:
        Q[here] -= size * u[k] / len(here)
        Q[there] += size * u[k] / len(there)

    return Hidden([heat])


def periodic_load(m: Machine, where: tuple[str, ...], size: float) -> Hidden:
    """A machine nearby cycles every 10 min."""
    cells = middle(m.plant.zones[where[0]])

    def heat(t: float, T: Array, u: Array, Q: Array) -> None:
        Q[cells] += size * np.sin(2 * np.pi * t / 610.0) / len(cells)

    return Hidden([heat])


def seebeck_slope(m: Machine, where: tuple[str, ...], size: float) -> Hidden:
    """S of the legs depends on their temperature; the Thomson heat comes with it."""
    m.plant.legs = [replace(one, S_slope=one.S_slope + size) for one in m.plant.legs]
    return Hidden()


def fan(m: Machine, where: tuple[str, ...], size: float) -> Hidden:
    """Outside: the loss of a lump switches on and off."""
    times = np.cumsum(np.random.default_rng(5).uniform(250, 800, 100))
    return _modulated(m, where, lambda t: size * (np.searchsorted(times, t) % 2))


def wandering(m: Machine, where: tuple[str, ...], size: float) -> Hidden:
    """Outside: the loss of a lump wanders up and down."""
    return _modulated(m, where, lambda t: size * (np.sin(2 * np.pi * t / 2900.0) + np.sin(2 * np.pi * t / 1700.0 + 1)))


def _modulated(m: Machine, where: tuple[str, ...], share: Callable[[float], float]) -> Hidden:
    cells, k = m.plant.zones[where[0]], _column(m, where[1])

    def heat(t: float, T: Array, u: Array, Q: Array) -> None:
        Q[cells] += share(t) * (u[k] - T[cells]) / len(cells)

    return Hidden([heat])


def melting(m: Machine, where: tuple[str, ...], size: float) -> Hidden:
    """Outside: latent heat over two kelvin, held by a small block that takes it from the middle of a lump."""
    zone = middle(m.plant.zones[where[0]])
    store = m.plant.block(1, 1.0)
    level = ROOM + 8.0

    def heat(t: float, T: Array, u: Array, Q: Array) -> None:  # the block holds melted share as its "temperature"
        flow = size * np.tanh((T[zone].mean() - level) / 1.0)
        share = T[store[0]] - ROOM
        flow = flow if (flow > 0 and share < 60.0) or (flow < 0 and share > 0.0) else 0.0
        Q[store[0]] += flow
        Q[zone] -= flow / len(zone)

    return Hidden([heat])


def polarity(m: Machine, where: tuple[str, ...], size: float) -> Hidden:
    """Outside: heat that remembers for 10 min which of the inputs was on."""
    zone, store = middle(m.plant.zones[where[0]]), m.plant.block(1, 600.0)

    def heat(t: float, T: Array, u: Array, Q: Array) -> None:
        Q[store[0]] += (1.0 if u[0] > 4.0 else -1.0) - (T[store[0]] - ROOM)
        Q[zone] += size * (T[store[0]] - ROOM) ** 2 / len(zone)

    return Hidden([heat])


def doors(m: Machine, where: tuple[str, ...], size: float) -> Hidden:
    """Outside: bursts of cold at times nobody wrote down."""
    times = np.cumsum(np.random.default_rng(9).uniform(300, 1200, 60))
    cells = m.plant.zones[where[0]]

    def heat(t: float, T: Array, u: Array, Q: Array) -> None:
        since = t - times[max(np.searchsorted(times, t) - 1, 0)]
        Q[cells] -= size * np.exp(-since / 120.0) * (since >= 0) / len(cells)

    return Hidden([heat])


def lagged(x: Array, tau: float, dt: float) -> Array:
    """First order from its steady state, x linear within a step."""
    a = np.exp(-dt / tau)
    return np.asarray(lfilter([0.5 * (1 - a), 0.5 * (1 - a)], [1.0, -a], x - x[0]) + x[0])


# machine -> effect -> places of which one is drawn, and a first guess of the size
CATALOG: dict[str, dict[str, tuple[list[tuple[str, ...]], float]]] = {
    "bar": {"missing_link": ([("x1", "x4"), ("x2", "x6"), ("x1", "x5")], 0.1),
            "sensor_lag": ([("T1",), ("T4",)], 20.0),
            "hidden_mass": ([("x4",), ("x1",)], 20.0),
            "radiation": ([("x1", "room"), ("x4", "room")], 5e-10),
            "input_lag": ([("q1",), ("q2",)], 20.0),
            "heater_power_slope": ([("q1",), ("q2",)], 4e-3),
            "input_feedthrough": ([("q1", "x4"), ("q2", "x6")], 0.1),
            "periodic_load": ([("x3",), ("x5",)], 0.5)},
    "plate": {"missing_link": ([("p00", "p20"), ("p01", "p21"), ("p01", "p20")], 0.15),
              "sensor_lag": ([("Ta",), ("Tc",)], 20.0),
              "natural_convection": ([("p01", "room"), ("p20", "room")], 0.02),
              "input_delay": ([("q1",), ("q2",)], 15.0),
              "missing_ambient_link": ([("p01", "rail"), ("p21", "rail")], 0.05),
              "sensor_gain": ([("Tb",), ("Td",)], 0.03),
              "heater_power_slope": ([("q1",), ("q2",)], 4e-3),
              "periodic_load": ([("p11",), ("p20",)], 0.5)},
    "stack": {"missing_link": ([("spreader", "sink"), ("sample", "sink")], 0.1),
              "sensor_lag": ([("Ts",), ("Tp",)], 15.0),
              "seebeck_slope": ([("m1",)], 2e-3),
              "missing_ambient_link": ([("spreader", "room")], 0.05),
              "hidden_mass": ([("sample",)], 10.0),
              "input_lag": ([("heater",)], 20.0),
              "natural_convection": ([("sink", "room")], 0.3)},
    "housing": {"missing_link": ([("lid", "side"), ("board", "bottom")], 0.1),
                "sensor_lag": ([("Tb",), ("Tr",)], 25.0),
                "missing_ambient_link": ([("rack", "floor"), ("air", "room")], 0.1),
                "radiation": ([("board", "room")], 5e-10),
                "heater_power_slope": ([("q1",), ("q2",)], 4e-3),
                "periodic_load": ([("rack",)], 0.4)},
    "pair": {"missing_link": ([("block1", "block2"), ("bar", "far")], 0.3)}}
OUTSIDE: dict[str, dict[str, tuple[list[tuple[str, ...]], float]]] = {
    "bar": {"fan": ([("x1", "room"), ("x4", "room")], 0.1), "melting": ([("x1",)], 1.0),
            "doors": ([("x4",)], 2.0)},
    "plate": {"wandering": ([("p01", "room")], 0.1), "polarity": ([("p20",)], 1.0), "doors": ([("p11",)], 2.0)},
    "stack": {"fan": ([("sink", "room")], 0.5), "melting": ([("spreader",)], 1.0)},
    "housing": {"wandering": ([("air", "room")], 0.05), "polarity": ([("board",)], 0.5)}}
MAKE: dict[str, Callable[[Machine, tuple[str, ...], float], Hidden]] = {
    name: value for name, value in globals().items()
    if name in {effect for table in (CATALOG, OUTSIDE) for one in table.values() for effect in one}}
