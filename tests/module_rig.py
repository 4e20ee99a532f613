"""The rig of Evers (2021), figure 5.5, in plain scipy: a module between two steel blocks, the hot one on chilled water.

Currents in steps, both directions, each held until nothing moves; voltage and both blocks are read. Module number 1 of
a batch differs from number 2 by the spread of manufacture; noise is drawn apart from it.
"""

from __future__ import annotations

import numpy as np
import scipy

import robthermal as rt

WATER, REFERENCE = 298.15, 308.15  # the water is at 25 °C; the mean of both faces runs from 15 to 55 °C
NAMES = ("seebeck.value", "seebeck.slope", "resistance.value", "resistance.slope", "conductance")
TRUE = np.array([0.053743, 7.421e-5, 4.6298, 0.022751, 0.2968])  # the surrogate, rt.systems.surrogate_module()
SPREAD = np.array([0.01, 0.03, 0.01, 0.03, 0.01]) * TRUE  # standard deviation between modules: 1 % and 3 %
HOT, COLD, TO_WATER = 90.0, 60.0, 12.0  # J/K, J/K, W/K
CURRENTS = (0.0, 0.14, 0.28, 0.42, 0.35, 0.21, 0.07, -0.14, -0.28, -0.42, -0.56, -0.7, -0.8, -0.63, -0.35, 0.0)  # A
HELD, STEP = 2400.0, 4.0  # s: how long a current is held, and between samples


def manufactured(count: int, seed: int) -> np.ndarray:
    """Parameters (count, 5) of modules of one batch."""
    return TRUE + SPREAD * np.random.default_rng(seed).standard_normal((count, TRUE.size))


def run(module: np.ndarray, currents: tuple[float, ...] = CURRENTS) -> rt.Record:
    """Readings without noise; a current and the voltage it needs are of the same sample, the blocks move after it."""
    S0, dS, R0, dR, K = module
    each = np.arange(0.0, HELD, STEP)
    faces, rest = [], np.array([WATER, WATER])

    def rate(_: float, T: np.ndarray, i: float) -> list[float]:
        mean = 0.5 * (T[0] + T[1]) - REFERENCE
        S, joule, back = S0 + dS * mean, 0.5 * (R0 + dR * mean) * i**2, K * (T[0] - T[1])
        return [(S * T[0] * i + joule - back - TO_WATER * (T[0] - WATER)) / HOT, (-S * T[1] * i + joule + back) / COLD]

    for i in currents:
        path = scipy.integrate.solve_ivp(rate, (0.0, HELD), rest, args=(i,), method="LSODA", rtol=1e-9, atol=1e-9,
                                         t_eval=[*each, HELD])
        faces.append(path.y[:, :-1].T)
        rest = path.y[:, -1]
    T, current = np.vstack(faces), np.repeat(currents, each.size)
    mean = T.mean(axis=1) - REFERENCE
    voltage = (S0 + dS * mean) * (T[:, 0] - T[:, 1]) + (R0 + dR * mean) * current
    return rt.Record(sample_time=STEP, inputs=current, outputs=np.column_stack([T, voltage]), input_names=["I"],
                     output_names=["T2", "T3", "V"])


def read(clean: rt.Record, seed: int, kelvin: float = 0.01, volt: float = 0.002) -> rt.Record:
    """With noise of the thermistors and of the voltmeter."""
    noise = np.random.default_rng(seed).standard_normal(clean.outputs.shape) * [kelvin, kelvin, volt]
    return clean.with_outputs(clean.outputs + noise)


def identified(record: rt.Record) -> rt.calibration.ModuleProperties:
    """Algorithm 1 on it."""
    return rt.calibration.module_properties(record, current="I", voltage="V", hot="T2", cold="T3",
                                            reference_temperature=REFERENCE)
