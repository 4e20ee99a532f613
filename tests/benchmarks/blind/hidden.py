"""The effects of the contract as changes of the true plant, written here a second time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from .integrate import Hidden, Memory
from .plants import ROOM, Module, Plant

Values = dict[str, float]
Change = Callable[[Plant, tuple[str, ...], Values, int], tuple[Plant, Hidden]]  # last: number of the next memory


def _lump(plant: Plant, name: str) -> int:
    return list(plant.capacity).index(name)


def _column(plant: Plant, name: str) -> int:
    return plant.columns.index(name)


def _sensor(plant: Plant, name: str) -> int:
    return list(plant.sensors).index(name)


def _in_module(law: Callable[[Module, np.ndarray, np.ndarray, np.ndarray, float], tuple[np.ndarray, np.ndarray]],
               quantity: str) -> Change:
    """Heats (into the hot face, into the cold face) law(module, Th, Tc, current, value)."""

    def change(plant: Plant, where: tuple[str, ...], v: Values, first: int) -> tuple[Plant, Hidden]:
        module, k = plant.modules[where[0]], _column(plant, where[0])
        hot, cold = _lump(plant, module.hot), _lump(plant, module.cold)

        def heat(t, T, u, m, Q):
            into_hot, into_cold = law(module, T[:, hot], T[:, cold], u[:, k], v[quantity])
            Q[:, hot] += into_hot
            Q[:, cold] += into_cold

        return plant, Hidden(heats=(heat,))

    return change


def _seebeck(module, Th, Tc, current, slope):
    pump = slope * (0.5 * (Th + Tc) - ROOM) * current
    return pump * Th, -pump * Tc


def _resistance(module, Th, Tc, current, slope):
    joule = 0.5 * slope * (0.5 * (Th + Tc) - ROOM) * current**2
    return joule, joule


def _conductance(module, Th, Tc, current, slope):
    flow = slope * (0.5 * (Th + Tc) - ROOM) * (Tc - Th)
    return flow, -flow


def _thomson(module, Th, Tc, current, coefficient):
    taken = -0.5 * coefficient * current * (Th - Tc)
    return taken, taken


def _split(module, Th, Tc, current, split):
    moved = split * module.R * current**2
    return -moved, moved


def _exchange(law: Callable[[np.ndarray, np.ndarray, Values], np.ndarray]) -> Change:
    """Heat law(Ta, Tb) from ambient where[1] into lump where[0]."""

    def change(plant: Plant, where: tuple[str, ...], v: Values, first: int) -> tuple[Plant, Hidden]:
        i, k = _lump(plant, where[0]), _column(plant, where[1])

        def heat(t, T, u, m, Q):
            Q[:, i] += law(u[:, k], T[:, i], v)

        return plant, Hidden(heats=(heat,))

    return change


def _natural(Ta: np.ndarray, T: np.ndarray, v: Values) -> np.ndarray:
    return v["gain"] * np.abs(Ta - T) ** 0.25 * (Ta - T)


def _radiation(Ta: np.ndarray, T: np.ndarray, v: Values) -> np.ndarray:
    return v["coefficient"] * (Ta**4 - T**4)


def _link(plant: Plant, where: tuple[str, ...], v: Values, first: int) -> tuple[Plant, Hidden]:
    return replace(plant, links={**plant.links, where: v["conductance"]}), Hidden()


def _hidden_mass(plant: Plant, where: tuple[str, ...], v: Values, first: int) -> tuple[Plant, Hidden]:
    behind = f"behind {where[0]}"
    return replace(plant, capacity={**plant.capacity, behind: v["capacity"]},
                   links={**plant.links, (where[0], behind): v["capacity"] / v["time_constant"]}), Hidden()


def _path_mass(plant: Plant, where: tuple[str, ...], v: Values, first: int) -> tuple[Plant, Hidden]:
    lump, ambient = where[0].split("-")
    within, share = f"within {where[0]}", v["ratio"] / (1.0 + v["ratio"])
    links = {pair: G for pair, G in plant.links.items() if pair != (lump, ambient)}
    G = plant.links[lump, ambient]
    return replace(plant, capacity={**plant.capacity, within: v["capacity"]},
                   links={**links, (lump, within): G / share, (within, ambient): G / (1.0 - share)}), Hidden()


def _hysteresis(plant: Plant, where: tuple[str, ...], v: Values, first: int) -> tuple[Plant, Hidden]:
    k, cold = _column(plant, where[0]), _lump(plant, plant.modules[where[0]].cold)

    def heat(t, T, u, m, Q):
        Q[:, cold] += v["heat"] * m[:, first]

    memory = Memory(v["time_constant"], lambda T, u: np.sign(u[:, k]), from_zero=True)
    return plant, Hidden(heats=(heat,), memories=(memory,))


def _lead(plant: Plant, where: tuple[str, ...], v: Values, first: int) -> tuple[Plant, Hidden]:
    i, k = _lump(plant, where[0]), _column(plant, where[1])

    def heat(t, T, u, m, Q):
        Q[:, i] += v["resistance"] * u[:, k] ** 2

    return plant, Hidden(heats=(heat,))


def _periodic(plant: Plant, where: tuple[str, ...], v: Values, first: int) -> tuple[Plant, Hidden]:
    i = _lump(plant, where[0])

    def heat(t, T, u, m, Q):
        Q[:, i] += v["heat"] * np.sin(2 * np.pi * t / v["period"] + v["phase"])

    return plant, Hidden(heats=(heat,))


def _condensation(plant: Plant, where: tuple[str, ...], v: Values, first: int) -> tuple[Plant, Hidden]:
    i = _lump(plant, where[0])

    def heat(t, T, u, m, Q):
        Q[:, i] += v["conductance"] * np.maximum(0.0, v["dew_point"] - T[:, i])

    return plant, Hidden(heats=(heat,))


def _constant(plant: Plant, where: tuple[str, ...], v: Values, first: int) -> tuple[Plant, Hidden]:
    i = _lump(plant, where[0])

    def heat(t, T, u, m, Q):
        Q[:, i] += v["heat"]

    return plant, Hidden(heats=(heat,))


def _step(plant: Plant, where: tuple[str, ...], v: Values, first: int) -> tuple[Plant, Hidden]:
    a, b = next(pair for pair in plant.links if "-".join(pair) == where[0])
    extra, i = v["relative"] * plant.links[a, b], _lump(plant, a)
    j, k = (_lump(plant, b), None) if b in plant.capacity else (None, _column(plant, b))

    def heat(t, T, u, m, Q):
        flow = extra * (t >= v["time"]) * ((T[:, j] if k is None else u[:, k]) - T[:, i])
        Q[:, i] += flow
        if k is None:
            Q[:, j] -= flow

    return plant, Hidden(heats=(heat,))


def _saturation(plant: Plant, where: tuple[str, ...], v: Values, first: int) -> tuple[Plant, Hidden]:
    k = _column(plant, where[0])

    def drive(U):
        out = U.copy()
        out[..., k] -= v["cubic"] * U[..., k] ** 3
        return out

    return plant, Hidden(drives=(drive,))


def _offset(plant: Plant, where: tuple[str, ...], v: Values, first: int) -> tuple[Plant, Hidden]:
    k = _column(plant, where[0])

    def drive(U):
        out = U.copy()
        out[..., k] += v["offset"]
        return out

    return plant, Hidden(drives=(drive,))


def _input_lag(plant: Plant, where: tuple[str, ...], v: Values, first: int) -> tuple[Plant, Hidden]:
    return plant, Hidden(lags={_column(plant, where[0]): v["time_constant"]})


def _input_delay(plant: Plant, where: tuple[str, ...], v: Values, first: int) -> tuple[Plant, Hidden]:
    return plant, Hidden(delays={_column(plant, where[0]): v["delay"]})


def _power_slope(plant: Plant, where: tuple[str, ...], v: Values, first: int) -> tuple[Plant, Hidden]:
    i, k = _lump(plant, plant.heaters[where[0]][0]), _column(plant, where[0])

    def heat(t, T, u, m, Q):
        Q[:, i] += u[:, k] * v["slope"] * (T[:, i] - ROOM)

    return plant, Hidden(heats=(heat,))


def _feedthrough(plant: Plant, where: tuple[str, ...], v: Values, first: int) -> tuple[Plant, Hidden]:
    i, j, k = _lump(plant, plant.heaters[where[0]][0]), _lump(plant, where[1]), _column(plant, where[0])

    def heat(t, T, u, m, Q):
        Q[:, i] -= v["share"] * u[:, k]
        Q[:, j] += v["share"] * u[:, k]

    return plant, Hidden(heats=(heat,))


def _sensor_lag(plant: Plant, where: tuple[str, ...], v: Values, first: int) -> tuple[Plant, Hidden]:
    i, s = _lump(plant, plant.sensors[where[0]]), _sensor(plant, where[0])

    def reading(Y, m):
        out = Y.copy()
        out[..., s] = m[..., first]
        return out

    return plant, Hidden(memories=(Memory(v["time_constant"], lambda T, u: T[:, i]),), readings=(reading,))


def _sensor_gain(plant: Plant, where: tuple[str, ...], v: Values, first: int) -> tuple[Plant, Hidden]:
    s = _sensor(plant, where[0])

    def reading(Y, m):
        out = Y.copy()
        out[..., s] += v["gain"] * (Y[..., s] - ROOM)
        return out

    return plant, Hidden(readings=(reading,))


CHANGES: dict[str, Change] = {
    "seebeck_slope": _in_module(_seebeck, "slope"), "resistance_slope": _in_module(_resistance, "slope"),
    "conductance_slope": _in_module(_conductance, "slope"), "thomson": _in_module(_thomson, "coefficient"),
    "joule_split": _in_module(_split, "split"), "hysteresis": _hysteresis, "lead_heating": _lead,
    "natural_convection": _exchange(_natural), "radiation": _exchange(_radiation), "missing_link": _link,
    "missing_ambient_link": _link, "conductance_step": _step, "heat_source": _constant, "hidden_mass": _hidden_mass,
    "path_mass": _path_mass,
    "periodic_load": _periodic, "condensation": _condensation, "input_offset": _offset,
    "input_saturation": _saturation, "input_lag": _input_lag, "input_delay": _input_delay,
    "heater_power_slope": _power_slope, "input_feedthrough": _feedthrough, "sensor_lag": _sensor_lag,
    "sensor_gain": _sensor_gain}


def with_effects(plant: Plant, effects: list[tuple[str, tuple[str, ...], Values]]) -> tuple[Plant, Hidden]:
    """Plant with these effects, in order."""
    hidden = Hidden()
    for name, where, values in effects:
        plant, more = CHANGES[name](plant, where, values, len(hidden.memories))
        hidden = hidden + more
    return plant, hidden
