"""Machines in numpy and pandas whose loggers average: one effect hidden, or none; nothing is shared with robthermal.

Readings and inputs are sampled every second and averaged over 10, 30 or 60 s, as pandas does it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

import robthermal as rt

ROOM, NOISE, SAMPLES = 295.0, 0.02, 240
KINDS = ("two", "three", "module")
EFFECTS = ("none", "sensor_lag", "missing_link", "hidden_mass", "input_delay", "natural_convection", "heat_source")
LOGS = ("sampled", "after", "held", "readings")


@dataclass
class Machine:
    """True numbers: capacities [J/K], conductances in a row and to the room [W/K], and sizes of hidden effects."""

    C: np.ndarray
    along: np.ndarray
    room: np.ndarray
    module: bool
    heat: float = 0.0
    convection: float = 0.0
    link: float = 0.0
    mass: float = 0.0
    mass_time: float = 1.0
    lag: float = 0.0
    delay: int = 0

    def rate(self, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Of lumps, hidden mass and lagged thermometer [K/s]."""
        n = self.C.size
        T, q = x[:n], -self.room * (x[:n] - ROOM)
        if self.module:
            pumped, joule, back = 0.05 * u[0] * T, u[0] ** 2, 0.5 * (T[1] - T[0])
            q += np.array([u[1] + joule - pumped[0] + back, joule + pumped[1] - back])
        else:
            flow = self.along * np.diff(T)
            q[:-1] += flow
            q[1:] -= flow
            q[:2] += u
        if n == 3:
            q[[0, 2]] += self.link * (T[[2, 0]] - T[[0, 2]])
        else:
            q[0] += self.link * (ROOM - T[0])
        q[0] += self.heat - self.mass / self.mass_time * (T[0] - x[n])
        q[-1] -= self.convection * abs(T[-1] - ROOM) ** 0.25 * (T[-1] - ROOM)
        late = (T[0] - x[n + 1]) / self.lag if self.lag else 0.0
        return np.concatenate([q / self.C, [(T[0] - x[n]) / self.mass_time, late]])

    def run(self, u: np.ndarray) -> np.ndarray:
        """Readings at every second, from rest (n, n_lumps) [K]."""
        n, x, out = self.C.size, np.full(self.C.size + 2, ROOM), []
        u = u.copy()
        u[:, 0] = np.concatenate([np.full(self.delay, u[0, 0]), u[:len(u) - self.delay, 0]])
        for v in u:
            out.append([x[n + 1] if self.lag else x[0], *x[1:n]])
            a = self.rate(x, v)
            b = self.rate(x + 0.5 * a, v)
            c = self.rate(x + 0.5 * b, v)
            x = x + (a + 2 * b + 2 * c + self.rate(x + c, v)) / 6
        return np.array(out)


def made(kind: str, effect: str, h: int, rng: np.random.Generator) -> Machine:
    """A machine with an effect of a size drawn for a log of this step."""
    def of(*values: float) -> np.ndarray:
        return np.array(values) * rng.uniform(0.8, 1.25, len(values))

    one = {"two": lambda: Machine(of(200, 150), of(1.5), of(0.2, 0.8), False),
           "three": lambda: Machine(of(200, 150, 260), of(1.5, 1.2), of(0.2, 0.8, 0.6), False),
           "module": lambda: Machine(of(120, 400), of(), of(0.1, 2.5), True)}[kind]()
    size = rng.uniform(0.8, 1.3)
    hidden = {"none": {}, "sensor_lag": {"lag": (0.6 * h + 12) * size}, "missing_link": {"link": 0.5 * size},
              "hidden_mass": {"mass": 70 * size, "mass_time": (150 + 2 * h) * size},
              "input_delay": {"delay": round(0.9 * h * size)}, "natural_convection": {"convection": 0.25 * size},
              "heat_source": {"heat": 1.2 * size}}[effect]
    for name, value in hidden.items():
        setattr(one, name, value)
    return one


def inputs(kind: str, h: int, held: bool, rng: np.random.Generator) -> np.ndarray:
    """Two inputs at every second; held from stamp to stamp, or changed at any second."""
    columns = []
    for k in range(2):
        levels = [-1.5, -0.6, 0.0, 0.8, 1.6, 2.2] if kind == "module" and k == 0 else [0.0, 4.0, 9.0, 15.0]
        lengths = rng.integers(2, 14, SAMPLES) * h if held else rng.integers(2 * h, 14 * h, SAMPLES)
        columns.append(np.repeat(rng.choice(levels, SAMPLES), lengths)[:SAMPLES * h])
    return np.column_stack(columns)


def nominal(kind: str, effect: str, machine: Machine, rng: np.random.Generator) -> rt.System:
    """What the user has: no hidden effect, parameters of the fit table some percent off."""
    n = machine.C.size
    lumps, inside = list("abc")[:n], effect == "missing_link" and n == 2
    fit = {f"lumps.{name}.capacity": {"lower": 30.0, "upper": 1500.0} for name in lumps}
    links = [{"between": pair, "conductance": g * rng.uniform(0.85, 1.18)}
             for pair, g in zip(zip(lumps, lumps[1:], strict=False), machine.along, strict=False)]
    links.append({"between": (lumps[-1], "room"), "conductance": machine.room[-1] * rng.uniform(0.85, 1.18)})
    fit |= {f"links.{'-'.join(link['between'])}.conductance": {"lower": 0.01, "upper": 20.0} for link in links}
    links += [{"between": (name, "room"), "conductance": g} for name, g in zip(lumps[:-1], machine.room, strict=False)
              if not (inside and name == "a")]
    tec = {"tec": {"cold": "a", "hot": "b", "seebeck": 0.05, "resistance": 2.0, "conductance": 0.5}}
    heaters = {"q": {"lump": "a"}} if machine.module else {"q": {"lump": "a"}, "p": {"lump": "b"}}
    return rt.System(
        name=kind, ambients={"room": {"temperature": ROOM}}, links=links, modules=tec if machine.module else {},
        lumps={name: {"capacity": c * rng.uniform(0.85, 1.18)} for name, c in zip(lumps, machine.C, strict=True)},
        inputs=heaters, sensors={f"T{name}": {"lump": name, "noise": NOISE} for name in lumps}, fit=fit)


def log(kind: str, effect: str, seed: int, h: int, how: str) -> tuple[rt.System, rt.Record]:
    """System and rows of a log: sampled, means after the stamp (inputs held or not), or readings before it."""
    rng = np.random.default_rng([seed, KINDS.index(kind), EFFECTS.index(effect), h])
    machine, u = made(kind, effect, h, rng), inputs(kind, h, how != "after", rng)
    system, y = nominal(kind, effect, machine, rng), machine.run(u)
    names = ["tec", "q"] if machine.module else ["q", "p"]
    sensors = list(system.sensors)
    clock = pd.date_range("2026-01-05", periods=len(u), freq="s")
    fine = pd.DataFrame(np.column_stack([u, y]), columns=names + sensors, index=clock)
    rows = fine.iloc[::h]
    if how == "readings":
        rows = rows[names].join(fine[sensors].resample(f"{h}s", label="right").mean(), how="inner")
    elif how != "sampled":
        rows = fine.resample(f"{h}s").mean()
    noisy = rows[sensors] + NOISE * rng.standard_normal((len(rows), len(sensors)))
    return system, rt.Record(sample_time=float(h), inputs=rows[names], outputs=noisy, input_names=names,
                             output_names=sensors)


def true_name(kind: str, effect: str) -> tuple[str, frozenset[str]]:
    """Name and place of what is hidden."""
    where = {"sensor_lag": ["Ta"], "missing_link": ["a", "c"], "natural_convection": ["b" if kind != "three" else "c",
             "room"], "input_delay": ["tec" if kind == "module" else "q"]}.get(effect, ["a"])
    if effect == "missing_link" and kind != "three":
        return "missing_ambient_link", frozenset(["a", "room"])
    return effect, frozenset(where)
