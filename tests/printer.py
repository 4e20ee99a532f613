"""A printer's hot end and heated bed, by finite volumes of their own: what a user's three lumps leave out.

The hot end (6 cells and a thermistor in a bead) is heated, and cooled by a fan; the bed (36 cells and a glass) loses
heat by natural convection and radiation. Temperatures are controlled: the duties follow the readings.
"""

from __future__ import annotations

import numpy as np

import robthermal as rt

STEP, SUB = 2.0, 4  # s, and steps of the integration in it
_SIGMA, _CELSIUS = 5.670374e-8, 273.15
_BLOCK, _BEAD, _BED, _GLASS, _SIDE = slice(0, 6), 6, slice(7, 43), 43, 6
_CELLS = 44
Program = tuple[np.ndarray, np.ndarray, np.ndarray]


def _conduction() -> np.ndarray:
    """Matrix of conduction between the cells [W/K]."""
    L = np.zeros((_CELLS, _CELLS))
    pairs = [(i, i + 1, 3.0) for i in range(5)] + [(2, _BEAD, 0.09)]
    for i in range(_SIDE):
        for j in range(_SIDE):
            cell = _BED.start + _SIDE * i + j
            pairs += [(cell, cell + _SIDE, 0.6)] if i + 1 < _SIDE else []
            pairs += [(cell, cell + 1, 0.6)] if j + 1 < _SIDE else []
            pairs.append((cell, _GLASS, 6.0 / _SIDE**2))
    for a, b, conductance in pairs:
        L[[a, b], [a, b]] -= conductance
        L[[a, b], [b, a]] += conductance
    return L


def program(seed: int, n: int, bed: list[float]) -> Program:
    """Set-points of the hot end and of the bed [°C], and the fan's duty."""
    rng = np.random.default_rng(seed)
    steps = n // 60 + 1
    return (np.repeat(rng.choice([150.0, 180.0, 200.0, 215.0, 235.0], steps), 60)[:n],
            np.repeat(rng.choice(bed, n // 200 + 1), 200)[:n],
            np.repeat(rng.choice([0.0, 0.0, 80.0, 128.0, 200.0, 255.0], 2 * steps), 30)[:n])


def measured(seed: int, hot: np.ndarray, bed: np.ndarray, fan: np.ndarray) -> rt.Record:
    """A record of the printer under control, the room at 22 °C."""
    rng, room, n = np.random.default_rng(seed), 22.0, len(hot)
    capacity = np.concatenate([np.full(6, 3.0), [0.36], np.full(_SIDE**2, 420.0 / _SIDE**2), [160.0]])
    h = STEP / SUB
    implicit = np.linalg.inv(np.diag(capacity / h) - _conduction())
    T, integral = np.full(_CELLS, room), np.zeros(2)
    readings, duties = np.empty((n, 2)), np.empty((n, 2))
    for k in range(n):
        readings[k] = T[[_BEAD, _BED.start + 14]] + 0.05 * rng.standard_normal(2)
        error = np.array([hot[k], bed[k]]) - readings[k]
        wanted = np.array([10.0, 30.0]) * error + integral
        integral += np.where((wanted > 0.0) & (wanted < 255.0), np.array([0.5, 0.3]) * error, 0.0)
        duties[k] = np.floor(np.clip(wanted, 0.0, 255.0))
        for _ in range(SUB):
            T = implicit @ (capacity / h * T + _heat(T, room, duties[k], fan[k]))
    return rt.Record(sample_time=STEP, inputs=np.column_stack([duties, fan, np.full(n, room + _CELSIUS)]),
                     outputs=readings + _CELSIUS, input_names=["hotend_duty", "bed_duty", "fan_duty", "room"],
                     output_names=["hotend", "bed"])


def _heat(T: np.ndarray, room: float, duty: np.ndarray, fan: float) -> np.ndarray:
    """Heat into every cell but by conduction [W]."""
    out, away = np.zeros(_CELLS), T - room
    fourth = (T + _CELSIUS) ** 4 - (room + _CELSIUS) ** 4
    out[_BLOCK] = (40.0 * duty[0] / 255.0 - 0.8 * _SIGMA * 0.0022 * fourth[_BLOCK]) / 6.0
    out[_BLOCK] -= (0.15 + 0.16 * (fan / 255.0) ** 0.8) / 6.0 * away[_BLOCK]
    out[_BED] = (180.0 * duty[1] / 255.0 - 0.25 * away[_BED]) / _SIDE**2
    out[_GLASS] = -0.21 * np.sign(away[_GLASS]) * abs(away[_GLASS]) ** 1.25 - 0.9 * _SIGMA * 0.045 * fourth[_GLASS]
    return out


def system() -> rt.System:
    """A user's model: one lump each, the fan declared, the bead too; no radiation, no natural convection."""
    return rt.System(
        ambients={"room": {"temperature": 22.0 + _CELSIUS}},
        lumps={"block": {"capacity": 20.0}, "plate": {"capacity": 400.0}, "glass": {"capacity": 150.0}},
        links=[{"between": ("block", "room"), "conductance": 0.15,
                "follow": {"column": "fan_duty", "relative": 0.004}},
               {"between": ("plate", "room"), "conductance": 0.3},
               {"between": ("plate", "glass"), "conductance": 5.0},
               {"between": ("glass", "room"), "conductance": 0.7}],
        inputs={"hotend_duty": {"lump": "block", "gain": 40.0 / 255.0, "unit": "1"},
                "bed_duty": {"lump": "plate", "gain": 180.0 / 255.0, "unit": "1"},
                "fan_duty": {"lump": "block", "gain": 0.0, "unit": "1"}},
        sensors={"hotend": {"lump": "block", "noise": 0.05, "time_constant": 4.0},
                 "bed": {"lump": "plate", "noise": 0.05}},
        fit={"lumps.block.capacity": {"lower": 5.0, "upper": 50.0},
             "lumps.plate.capacity": {"lower": 100.0, "upper": 2000.0},
             "links.block-room.conductance": {"lower": 0.02, "upper": 0.8},
             "lumps.glass.capacity": {"lower": 50.0, "upper": 500.0},
             "links.plate-glass.conductance": {"lower": 0.5, "upper": 50.0},
             "links.glass-room.conductance": {"lower": 0.05, "upper": 7.0},
             "links.block-room.follow.relative": {"lower": 0.0005, "upper": 0.05},
             "sensors.hotend.time_constant": {"lower": 1.0, "upper": 15.0}})


def without_fan() -> rt.System:
    """The same where the user has forgotten what the fan does, and that the bead is late."""
    full = system()
    links = tuple(one.model_copy(update={"follow": None}) for one in full.links)
    sensors = {name: one.model_copy(update={"time_constant": 0.0}) for name, one in full.sensors.items()}
    fit = {name: limits for name, limits in full.fit.items() if "follow" not in name and "time_constant" not in name}
    return rt.System(**{**dict(full), "links": links, "sensors": sensors, "fit": fit})


def bed_alone() -> rt.System:
    """The bed without the hot end."""
    full = system()
    return rt.System(ambients=full.ambients, lumps={name: full.lumps[name] for name in ("plate", "glass")},
                     links=[one for one in full.links if "block" not in one.between],
                     inputs={"bed_duty": full.inputs["bed_duty"]}, sensors={"bed": full.sensors["bed"]},
                     fit={name: limits for name, limits in full.fit.items() if "plate" in name or "glass" in name})


def of_bed(record: rt.Record) -> rt.Record:
    """Columns of the bed and of the room."""
    return rt.Record(sample_time=record.sample_time, inputs=record.inputs[:, [1, 3]], outputs=record.outputs[:, [1]],
                     input_names=["bed_duty", "room"], output_names=["bed"])
