"""Plants with something hidden, integrated by scipy from equations written here: nothing of the package simulates."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import robthermal as rt

Array = NDArray[np.float64]
Rate = Callable[[float, Array, Array], Array]
H, DWELL = 5.0, 20


def two_lump() -> rt.System:
    """A heated block on a plate."""
    return rt.System(
        ambients={"room": {"temperature": 298.15}},
        lumps={"plate": {"capacity": 120.0}, "block": {"capacity": 40.0}},
        links=[{"between": ("plate", "room"), "conductance": 0.6}, {"between": ("plate", "block"), "conductance": 1.5},
               {"between": ("block", "room"), "conductance": 0.1}],
        inputs={"heater": {"lump": "block", "limits": (0.0, 12.0)}},
        sensors={"Tp": {"lump": "plate", "noise": 0.01}, "Tb": {"lump": "block", "noise": 0.01}},
        fit={name: {"lower": value / 4, "upper": value * 4, "sigma": 0.1 * value} for name, value in {
            "lumps.plate.capacity": 120.0, "lumps.block.capacity": 40.0, "links.plate-room.conductance": 0.6,
            "links.plate-block.conductance": 1.5, "links.block-room.conductance": 0.1}.items()})


def two_lump_rate(T: Array, u: Array, extra: Array | None = None) -> Array:
    """Its equations with the true numbers, a little off the nominal ones; extra heat [W] into plate and block."""
    q, room = u
    across = 1.45 * (T[1] - T[0])
    heat = np.array([across - 0.62 * (T[0] - room), q - across - 0.105 * (T[1] - room)])
    return (heat + (0.0 if extra is None else extra)) / np.array([123.0, 39.0])


def inputs(n: int, seed: int) -> Array:
    """Heater and room temperature, held for `DWELL` samples."""
    rng = np.random.default_rng(seed)
    steps = n // DWELL
    return np.repeat(np.column_stack([rng.choice([0.0, 3.0, 7.0, 11.0], steps), 298.15 + rng.normal(0, 2.0, steps)]),
                     DWELL, axis=0)


def integrate(rate: Rate, x0: Array, u: Array, dwell: int = DWELL, h: float = H) -> Array:
    """States at every sample, with inputs held over each dwell."""
    out, x = [], np.asarray(x0, float)
    for start in range(0, len(u), dwell):
        t = h * np.arange(start, start + dwell + 1)
        run = solve_ivp(rate, (t[0], t[-1]), x, method="LSODA", t_eval=t, args=(u[start],), rtol=1e-8, atol=1e-8)
        out.append(run.y.T[:-1])
        x = run.y[:, -1]
    return np.concatenate(out)


def measured(readings: Array, u: Array, names: list[str], sensors: list[str], seed: int, h: float = H,
             noise: float = 0.01) -> rt.Record:
    """Record with sensor noise."""
    noisy = readings + noise * np.random.default_rng(1000 + seed).standard_normal(readings.shape)
    return rt.Record(sample_time=h, inputs=u, outputs=noisy, input_names=names, output_names=sensors)


@pytest.fixture(scope="session")
def plant() -> rt.System:
    return two_lump()


@pytest.fixture(scope="session")
def hide() -> Callable[..., tuple[rt.Record, rt.Record]]:
    """Training and validation record of the two-lump plant with a hidden change of its equations or readings."""

    def records(rate: Rate | None = None, extra_states: int = 0, read: Callable[[Array], Array] | None = None,
                n: int = 600, drive: Callable[[Array], Array] | None = None) -> tuple[rt.Record, rt.Record]:
        out = []
        for seed, length in ((1, n), (2, n // 2)):
            u = inputs(length, seed)
            actual = u if drive is None else drive(u)
            dwell = DWELL if drive is None else 1
            x0 = np.full(2 + extra_states, 298.15)
            law: Rate = (lambda t, x, u: two_lump_rate(x, u)) if rate is None else rate
            T = integrate(law, x0, actual, dwell)
            y = T[:, :2] if read is None else read(T)
            out.append(measured(y, u, ["heater", "room"], ["Tp", "Tb"], seed))
        return out[0], out[1]

    return records


@pytest.fixture(scope="session")
def rate() -> Callable[..., Array]:
    return two_lump_rate


@pytest.fixture(scope="session")
def inputs_of() -> Callable[..., Array]:
    return inputs


@pytest.fixture(scope="session")
def integrated() -> Callable[..., Array]:
    return integrate


@pytest.fixture(scope="session")
def recorded() -> Callable[..., rt.Record]:
    return measured
