"""Demo scanner: two positioning stages of a lithographic machine, their controllers, disturbances and measured FRFs.

No numbers of a real machine: masses, modes and noise levels were chosen round and once, before any coupling filter was
designed, so that the uncoupled errors are near those of Evers (2021), Table 6.1.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from .._control import control

Array = NDArray[Any]
_SAMPLE_TIME = 2e-4  # s
_DELAY = 1.5  # samples, computation and transport
_POSITIONS = (-1.0, -0.5, 0.0, 0.5, 1.0)  # along the stroke, of half the stroke
_FREQUENCIES = np.arange(4.0, 2499.0, 4.0)  # Hz


@dataclass(frozen=True)
class _Mode:
    """Flexible mode: frequency [Hz], damping [-], gain relative to the rigid body [-], and how position moves them."""

    frequency: float
    damping: float
    gain: float
    shift: float = 0.0
    slope: float = 0.0
    bend: float = 0.0

    def at(self, position: float) -> tuple[float, float, float]:
        gain = self.gain + self.slope * position + self.bend * position**2
        return self.frequency * (1 + self.shift * position), self.damping, gain


@dataclass(frozen=True)
class _Stage:
    """What makes one stage; `modelled` modes are in the nominal model (at position 0), all are in the machine."""

    mass: float  # kg
    modelled: tuple[_Mode, ...]
    unmodelled: tuple[_Mode, ...]
    bandwidth: float  # Hz
    notch: tuple[float, float, float]  # frequency [Hz], damping of zeros and poles
    floor: float  # m, standard deviation of the slow motion of the floor (3 Hz)
    frame: tuple[float, float]  # frequency [Hz], standard deviation [m] of the frame's mode
    guide: tuple[float, float]  # the same of a mode above the bandwidth
    noise: float  # m, white


_RETICLE = _Stage(
    mass=12.0, modelled=(_Mode(650.0, 0.015, -0.5, 0.012, -0.15),),
    unmodelled=(_Mode(1150.0, 0.01, 0.0, 0.02, 0.35), _Mode(1800.0, 0.01, -0.3, 0.0, 0.0, 0.15)),
    bandwidth=130.0, notch=(650.0, 0.1, 0.5),
    floor=40e-9, frame=(24.0, 0.3e-9), guide=(140.0, 0.2e-9), noise=0.5e-9)
_WAFER = _Stage(  # a gain below -1 turns the sign of the response above the mode: a zero in the right half plane
    mass=22.0, modelled=(_Mode(580.0, 0.015, -1.15, 0.012, -0.345),),
    unmodelled=(_Mode(1150.0, 0.01, 0.0, 0.02, 0.35), _Mode(1800.0, 0.01, -0.3, 0.0, 0.0, 0.15)),
    bandwidth=110.0, notch=(580.0, 0.06, 0.5),
    floor=40e-9, frame=(33.0, 0.3e-9), guide=(190.0, 0.2e-9), noise=0.6e-9)


@dataclass(frozen=True)
class Scanner:
    """Two stages with their controllers, as `robthermal.coupling` takes them.

    Parameters
    ----------
    P1, P2 : control.StateSpace
        Nominal models of the reticle and the wafer stage, force [N] to position [m].
    C1, C2 : control.StateSpace
        Their controllers, error [m] to force [N].
    frf : tuple of control.FrequencyResponseData
        Measured 2x2 plants, one per position, diagonal [m/N].
    plants : tuple of (StateSpace, StateSpace)
        What was measured: the machine itself at every position, which no designer knows.
    disturbances : tuple of control.StateSpace
        Shaping filters, white noise of variance 1 per sample to the disturbance at the output [m].
    positions : tuple of float
        Positions of the measurements, in half strokes [-].
    sample_time : float
        Time between two samples [s].
    names : tuple of str
        Names of the stages.
    """

    P1: control.StateSpace
    P2: control.StateSpace
    C1: control.StateSpace
    C2: control.StateSpace
    frf: tuple[control.FrequencyResponseData, ...]
    plants: tuple[tuple[control.StateSpace, control.StateSpace], ...]
    disturbances: tuple[control.StateSpace, control.StateSpace]
    positions: tuple[float, ...]
    sample_time: float
    names: tuple[str, str]


def scanner() -> Scanner:
    """Demo scanner: reticle and wafer stage at 5 kHz, rigid bodies with flexible modes, 1.5 samples of delay.

    The wafer stage has a zero in the right half plane (its sensor sits behind a node of the 580 Hz mode). The nominal
    models know one mode each; the machine, measured at five positions, has three, which move with the position. Floor
    motion, modes and white noise disturb the positions.

    Returns
    -------
    Scanner

    Examples
    --------
    >>> import robthermal as rt
    >>> machine = rt.systems.scanner()
    >>> machine.P1.dt, len(machine.frf), machine.frf[0].omega.size
    (0.0002, 5, 624)
    """
    P, C, W = zip(*[(_plant(stage), _controller(stage), _disturbance(stage)) for stage in (_RETICLE, _WAFER)],
                  strict=True)
    plants = tuple((_plant(_RETICLE, position), _plant(_WAFER, position)) for position in _POSITIONS)
    return Scanner(P1=P[0], P2=P[1], C1=C[0], C2=C[1], frf=tuple(_measure(*pair) for pair in plants), plants=plants,
                   disturbances=(W[0], W[1]), positions=_POSITIONS, sample_time=_SAMPLE_TIME,
                   names=("reticle", "wafer"))


def _plant(stage: _Stage, position: float | None = None) -> control.StateSpace:
    """Force to position, zero-order hold, delayed; without a position the nominal model."""
    modes = stage.modelled if position is None else stage.modelled + stage.unmodelled
    A, B, C = [np.array([[0.0, 1.0], [0.0, 0.0]])], [0.0, 1 / stage.mass], [1.0, 0.0]
    for mode in modes:
        frequency, damping, gain = mode.at(position or 0.0)
        omega = 2 * np.pi * frequency
        A.append(np.array([[0.0, 1.0], [-omega**2, -2 * damping * omega]]))
        B, C = B + [0.0, 1 / stage.mass], C + [gain, 0.0]
    return _delayed(scipy.linalg.block_diag(*A), np.array(B)[:, None], np.array(C)[None])


def _delayed(A: Array, B: Array, C: Array) -> control.StateSpace:
    """Exact sampling of a continuous model whose input is held and comes `_DELAY` samples late."""
    n, whole = len(A), int(_DELAY)
    late = (_DELAY - whole) * _SAMPLE_TIME
    first, second = _hold(A, B, late), _hold(A, B, _SAMPLE_TIME - late)
    F = np.zeros((n + whole + 1, n + whole + 1))
    F[:n, :n] = second[:n, :n] @ first[:n, :n]
    # The oldest stored input acts until `late`, the next one for the rest of the sample.
    F[:n, n], F[:n, n + 1] = second[:n, :n] @ first[:n, n], second[:n, n]
    F[n:-1, n + 1:] = np.eye(whole)
    G = np.zeros((len(F), 1))
    G[-1] = 1.0
    return control.ss(F, G, np.hstack([C, np.zeros((1, whole + 1))]), 0, _SAMPLE_TIME)


def _hold(A: Array, B: Array, time: float) -> Array:
    """[exp(A t), ∫ exp(A s) B ds; 0 1]."""
    n = len(A)
    M = np.zeros((n + 1, n + 1))
    M[:n, :n], M[:n, n:] = A * time, B * time
    return scipy.linalg.expm(M)


def _controller(stage: _Stage) -> control.StateSpace:
    """PID, lowpass and notch, for a loop gain of one at the bandwidth."""
    omega = 2 * np.pi * stage.bandwidth
    lowpass = 2 * np.pi * 1000.0
    frequency, shallow, wide = stage.notch
    notch = 2 * np.pi * frequency
    C = (_tustin([1.0, omega / 8], [1.0, 0.0], stage.bandwidth)
         * _tustin([1.0, omega / 3], [1 / lowpass**2, 1.4 / lowpass, 1.0], stage.bandwidth)
         * _tustin([1.0, 2 * shallow * notch, notch**2], [1.0, 2 * wide * notch, notch**2], frequency))
    z = np.exp(1j * omega * _SAMPLE_TIME)
    return C * (1 / abs(C(z) * _plant(stage)(z)))


def _disturbance(stage: _Stage) -> control.StateSpace:
    """Floor, two modes and noise, from one white source."""
    total = control.ss([], [], [], [[stage.noise]], _SAMPLE_TIME)
    for frequency, damping, deviation in ((3.0, 0.3, stage.floor), (stage.frame[0], 0.05, stage.frame[1]),
                                          (stage.guide[0], 0.03, stage.guide[1])):
        omega = 2 * np.pi * frequency
        part = _tustin([omega**2], [1.0, 2 * damping * omega, omega**2], frequency)
        P = scipy.linalg.solve_discrete_lyapunov(part.A, part.B @ part.B.T)
        total = total + part * (deviation / np.sqrt((part.C @ P @ part.C.T + part.D @ part.D.T).item()))
    return total


def _tustin(numerator: list[float], denominator: list[float], frequency: float) -> control.StateSpace:
    """Bilinear transform, exact at one frequency [Hz]."""
    omega = 2 * np.pi * frequency
    rate = omega / (2 * np.tan(omega * _SAMPLE_TIME / 2))
    return control.ss(*scipy.signal.tf2ss(*scipy.signal.bilinear(numerator, denominator, rate)), _SAMPLE_TIME)


def _measure(P1: control.StateSpace, P2: control.StateSpace) -> control.FrequencyResponseData:
    """Noise-free 2x2 frequency response."""
    omega = 2 * np.pi * _FREQUENCIES
    z = np.exp(1j * omega * _SAMPLE_TIME)
    response = np.zeros((2, 2, len(z)), complex)
    response[0, 0], response[1, 1] = P1(z).ravel(), P2(z).ravel()
    return control.FrequencyResponseData(response, omega, dt=_SAMPLE_TIME)
