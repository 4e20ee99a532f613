"""A rig of its own, in plain scipy: a thermoelectric module between a sink and a sample, its voltage logged."""

import numpy as np
from scipy.integrate import solve_ivp

import robthermal as rt

ROOM = 295.15
TRUE = {"S": 0.048, "dS": 9e-5, "R": 2.1, "dR": 0.012, "K": 0.45, "T_ref": 300.0}
H = 4.0
FIT = {"modules.m1.seebeck.value": {"lower": 0.03, "upper": 0.08},
       "modules.m1.resistance.value": {"lower": 1.0, "upper": 4.0},
       "modules.m1.conductance.value": {"lower": 0.1, "upper": 1.5}}
FILE = """
[system]
name = "rig"
temperature_unit = "degC"
[ambients.room]
temperature = 22.0
[lumps.hot]
capacity = 70.0
[lumps.cold]
capacity = 35.0
[[links]]
between = ["hot", "room"]
conductance = 1.1
[[links]]
between = ["cold", "room"]
conductance = 0.06
[modules.m1]
hot = "hot"
cold = "cold"
seebeck = { value = 0.048, slope = 9.0e-5 }
resistance = { value = 2.1, slope = 0.012 }
conductance = { value = 0.45, slope = 0.0 }
reference_temperature = 26.85
[sensors.T_cold]
lump = "cold"
noise = 0.02
[sensors.V1]
module = "m1"
quantity = "voltage"
noise = 0.002
"""


def voltage(hot, cold, current, p=TRUE):
    """By hand: Seebeck voltage and ohmic drop at the mean temperature."""
    above = 0.5 * (hot + cold) - p["T_ref"]
    return (p["S"] + p["dS"] * above) * (hot - cold) + (p["R"] + p["dR"] * above) * current


def log(currents, h, p=TRUE):
    """Readings of T_cold [K] and V1 [V] at every sample, integrated by scipy, and the temperatures of both faces."""
    def rate(_, T, current):
        hot, cold = T
        above = 0.5 * (hot + cold) - p["T_ref"]
        S, R = p["S"] + p["dS"] * above, p["R"] + p["dR"] * above
        back, joule = p["K"] * (hot - cold), 0.5 * R * current**2
        return [(S * hot * current + joule - back - 1.1 * (hot - ROOM)) / 70.0,
                (-S * cold * current + joule + back - 0.06 * (cold - ROOM)) / 35.0]

    T, faces = np.array([ROOM, ROOM]), []
    for current in currents:
        faces.append(T)
        T = solve_ivp(rate, (0.0, h), T, args=(current,), method="DOP853", rtol=1e-11, atol=1e-11).y[:, -1]
    faces = np.array(faces)
    return np.column_stack([faces[:, 1], voltage(faces[:, 0], faces[:, 1], currents, p)]), faces


def drive(currents, h):
    """A record with currents alone."""
    return rt.Record(sample_time=h, inputs=currents, outputs=np.zeros((len(currents), 0)), input_names=["m1"],
                     output_names=[])


def system():
    """The rig as a system file describes it."""
    return rt.thermal.parse_system(FILE)


def currents(seed: int) -> np.ndarray:
    """Twenty of them, each held for ten rows [A]."""
    return np.repeat(np.random.default_rng(seed).uniform(-1.0, 1.8, 20), 10)


def machine(read: str = "after", **numbers: float) -> rt.System:
    """The rig, whose file knows its slopes, with a program that reads after or before it sets the current."""
    made = rt.thermal.parse_system(FILE.replace('quantity = "voltage"', f'quantity = "voltage"\nread = "{read}"'))
    return rt.System(**{**dict(made.with_parameters(numbers)), "fit": FIT})


def logged(seed: int, share: float, p: dict[str, float] = TRUE) -> rt.Record:
    """A log in which `share` of the voltage is still that at the current of the row before, at rest at the start."""
    current = currents(seed)
    readings, faces = log(current, H, p)
    before = np.concatenate([[0.0], current[:-1]])
    V = (1.0 - share) * readings[:, 1] + share * voltage(faces[:, 0], faces[:, 1], before, p)
    noise = np.random.default_rng(100 + seed).standard_normal((len(current), 2)) * [0.02, 0.002]
    return rt.Record(sample_time=H, inputs=current, outputs=np.column_stack([readings[:, 0], V]) + noise,
                     input_names=["m1"], output_names=["T_cold", "V1"])
