"""A board with two heaters under two-point control, by Euler steps of a quarter second; what its model lacks is known.

The model has losses to the room and no more: a path between the heaters and the lags of both sensors are missing.
Commands may act later than the row in which they are logged, as on a measured board that a program on a computer heats.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import robthermal as rt

ROOM, STEP, N = 293.15, 5.0, 240
PATH, LAGS = 0.0055, (22.0, 27.0)  # W/K, s
NOISE = 0.1  # K


def model() -> rt.System:
    """The board with losses to the room only; the capacity of 2 J/K stays fixed."""
    names = ("heater_1", "heater_2")
    ranges = {f"links.{one}-room.conductance": {"lower": 1e-4, "upper": 0.05} for one in names}
    return rt.System(
        ambients={"room": {"temperature": ROOM}}, lumps={one: {"capacity": 2.0} for one in names},
        links=[{"between": (one, "room"), "conductance": 8e-3} for one in names],
        inputs={f"q{i}": {"lump": one, "gain": g} for i, one, g in zip("12", names, (0.0123, 0.0062), strict=True)},
        sensors={f"T{i}": {"lump": one, "noise": NOISE} for i, one in zip("12", names, strict=True)},
        fit=ranges | {f"inputs.q{i}.gain": {"lower": 1e-3, "upper": 0.1} for i in "12"})


@dataclass(frozen=True)
class Board:
    """Numbers of a board: gains [W/%], losses and path [W/K], lags of both sensors [s], room [K]."""

    gain: tuple[float, float] = (0.010, 0.0064)
    loss: tuple[float, float] = (0.011, 0.014)
    path: float = PATH
    lags: tuple[float, float] = LAGS
    room: float = ROOM


def day(seed: int, late: float = 0.0, board: Board = Board()) -> rt.Record:  # noqa: B008  # frozen
    """A log of 20 min: rows of commands and of the readings that they follow.

    Parameters
    ----------
    seed : int
        Of goals and noise.
    late : float
        How much later than their row commands act [s], up to three rows.
    board : Board
        Its numbers.
    """
    gain, loss, lags = (np.array(each) for each in (board.gain, board.loss, board.lags))
    rng = np.random.default_rng(seed)
    T, sent, read, goal = np.full(2, board.room), [np.zeros(2)] * 4, [], np.zeros(2)
    sensor, fine = T, 20
    for k in range(N):
        if k % 60 == 0:
            goal = board.room + np.array([28.0, 20.0]) * (0.7 + 0.6 * rng.random(2))
        cold = sensor + NOISE * rng.standard_normal(2) < goal
        sent.append(100.0 * cold * np.array([k > 1, 1 < k < 10 or k > 100]))
        read.append(sensor)
        for j in range(fine):
            u = sent[-1 + int(np.floor((j + 0.5) / fine - late / STEP))]
            heat = gain * u - loss * (T - board.room) + board.path * (T[::-1] - T)
            follows = sensor + STEP / fine * (T - sensor) / np.maximum(lags, 1.0)
            T = T + STEP / fine * heat / 2.0
            sensor = np.where(lags > 0.0, follows, T)
    return rt.Record(sample_time=STEP, inputs=np.array(sent[4:]), outputs=np.array(read) + NOISE * rng.standard_normal(
        (N, 2)), input_names=["q1", "q2"], output_names=["T1", "T2"])


def step_test(seed: int, radiation: float = 0.0) -> rt.Record:
    """A log of ten minutes: heater 1 at half its power from the first row on, heater 2 off.

    Parameters
    ----------
    seed : int
        Of the noise.
    radiation : float
        Coefficient of both heaters' radiation [W/K⁴].
    """
    gain, loss, n, fine = np.array([0.012, 0.0064]), np.array([0.011, 0.010]), 126, 20
    T, sensor, read = np.full(2, ROOM), np.full(2, ROOM), []
    for _ in range(n):
        read.append(sensor)
        for _ in range(fine):
            heat = gain * np.array([50.0, 0.0]) - loss * (T - ROOM) + PATH * (T[::-1] - T)
            heat = heat - radiation * (T**4 - ROOM**4)
            T, sensor = T + STEP / fine * heat / 2.0, sensor + STEP / fine * (T - sensor) / np.array(LAGS)
    noise = NOISE * np.random.default_rng(seed).standard_normal((n, 2))
    return rt.Record(sample_time=STEP, inputs=np.tile([50.0, 0.0], (n, 1)), outputs=np.array(read) + noise,
                     input_names=["q1", "q2"], output_names=["T1", "T2"])
