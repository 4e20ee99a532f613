"""One-Peltier machines and their loops, integrated here from the equations: nothing of the package runs in `sample`."""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import expm

import robthermal as rt

AMBIENT = {"room": (293.15, 303.15), "water": (288.15, 298.15)}
ROOM, WATER = 298.15, 293.15
S, R, K = 0.05, 2.0, 0.5  # TEC1-12706 near 298 K


def peltier(plate=100.0, face=8.0, sink=150.0, inner=5.0, outer=6.0, water=10.0, leak=0.15):
    """Plate, cold face, hot face and a sink cooled by water; sensors on plate, hot side and sink."""
    return rt.System(
        ambients={"room": {"temperature": ROOM}, "water": {"temperature": WATER}},
        lumps={"plate": {"capacity": plate}, "cold": {"capacity": face}, "hot": {"capacity": face},
               "sink": {"capacity": sink}},
        links=[{"between": between, "conductance": conductance} for between, conductance in (
            (("plate", "cold"), inner), (("hot", "sink"), outer), (("sink", "water"), water),
            (("plate", "room"), leak))],
        modules={"m": {"hot": "hot", "cold": "cold", "seebeck": {"value": S}, "resistance": {"value": R},
                       "conductance": {"value": K}, "reference_temperature": 298.15, "current_limits": (-6.4, 6.4)}},
        sensors={"Tp": {"lump": "plate", "noise": 0.01}, "Th": {"lump": "hot", "noise": 0.01},
                 "Ts": {"lump": "sink", "noise": 0.01}})


class Machine:
    """The equations of `peltier` with a PI controller, the law and an observer, written out."""

    def __init__(self, system, pi, limits, time, observer=None):
        self.E = np.array([lump.capacity for lump in system.lumps.values()])
        self.inner, self.outer, self.water, self.leak = (link.conductance for link in system.links)
        self.limits, self.time, self.observer = limits, time, observer
        self.P, self.I = float(pi.proportional[0]), float(pi.integral[0])
        self.track = 1 - np.exp(-time / float(pi.tracking_time[0]))
        A = np.array([[self.flow(np.eye(4)[j], 0.0)[i] - self.flow(np.zeros(4), 0.0)[i] for j in range(4)]
                      for i in range(4)])
        both = expm(np.block([[A / self.E[:, None], np.diag(1 / self.E)], [np.zeros((4, 8))]]) * time)
        self.A, self.A_d, self.hold = A, both[:4, :4], both[:4, 4:]

    def flow(self, x, current):
        """Heat into every lump [W]."""
        p, c, h, s = x
        return np.array([self.inner * (c - p) + self.leak * (ROOM - p),
                         self.inner * (p - c) + K * (h - c) - S * c * current + 0.5 * R * current**2,
                         self.outer * (s - h) + K * (c - h) + S * h * current + 0.5 * R * current**2,
                         self.outer * (h - s) + self.water * (WATER - s)])

    def heat(self, x, current):
        """Heat into the cold face from the module [W]."""
        return K * (x[2] - x[1]) + 0.5 * R * current**2 - S * x[1] * current

    def sample(self, state, reference=285.0):
        """The state (x, estimate, z) or (x, z) after a sample, with the temperatures on the way."""
        n = 8 if self.observer else 4
        x, seen, z = state[:4], state[n - 4:n], state[n]
        v = self.P * (reference - seen[1]) + z
        low, high = self.limits
        if self.heat(seen, high) >= v:
            current = high
        elif self.heat(seen, low) <= v:
            current = low
        else:
            b = -S * seen[1]
            root = b * b - 2 * R * (K * (seen[2] - seen[1]) - v)
            current = (-b - np.sqrt(root)) / R
        z = z + self.I * self.time * (reference - seen[1]) + self.track * (self.heat(seen, current) - v)
        end = solve_ivp(lambda _, y: self.flow(y, current) / self.E, (0, self.time), x, rtol=1e-8, atol=1e-8)
        if not self.observer:
            return np.concatenate([end.y[:, -1], [z]]), end.y
        places = [["Tp", None, "Th", "Ts"].index(name) for name in self.observer.sensors]
        guess = (self.A_d @ seen + self.hold @ (self.flow(seen, current) - self.A @ seen)
                 + self.observer.gain @ (x[places] - seen[places]))
        return np.concatenate([end.y[:, -1], guess, [z]]), end.y
