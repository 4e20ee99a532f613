"""Feedback and feed-forward on the thermal modes that the tool point feels, and a proof of what it does."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .._arrays import Array
from .._checks import positive_number, whole_number
from .._control import control
from ..errors import InputError, Outcome
from ..linear import Plant, close, plant_norm, prove_closed_loop
from ..synthesis import SynthesisCode
from ..verification import Certificate
from ._numbers import expect
from ._thermal_modes import ModalReconstruction, ThermalModes, place, reconstruct

_INTEGRAL = 4.0  # the integral part takes over this factor below the bandwidth, as in `pid`
_APART = 1e-6  # smallest singular value of the heaters on the modes, relative
_TOLD = 0.05  # smallest singular value of the readings of modes that are read together, each of size 1
_NANO = 1e9  # displacements of certificates are in nanometers


@dataclass(frozen=True)
class ModalFeedback:
    """PI control of some thermal modes, and what is proven of the tool point.

    Parameters
    ----------
    modes : ThermalModes
        Modes of the network.
    controlled : tuple of int
        Modes that are controlled, counted from 0.
    heaters, disturbances : tuple of str
        Inputs that the controller drives, and those that act on the machine.
    reconstruction : ModalReconstruction
        How modes are read from the thermometers, the controlled ones first.
    controller : control.StateSpace
        From deviations of the readings [K] to the heaters [unit], u = +K y; continuous.
    feed_forward : ndarray, shape (n_heaters, n_disturbances)
        Heater per measured disturbance that leaves the controlled modes unmoved at every moment [unit/unit].
    open_gain : float
        Largest gain from the disturbances to the tool point without control, over all frequencies, estimated [m/unit].
    value : float
        The same with feedback, proven [m/unit]; infinite where nothing is proven.
    value_with_feed_forward : float
        The same with feedback and exact feed-forward, proven [m/unit].
    certificates : list of Certificate
        Kind "closed_loop": gain of the loop without and with feed-forward, in nanometers.
    outcome : Outcome
        Whether both are proven; the text says what remains.
    """

    modes: ThermalModes
    controlled: tuple[int, ...]
    heaters: tuple[str, ...]
    disturbances: tuple[str, ...]
    reconstruction: ModalReconstruction
    controller: control.StateSpace
    feed_forward: Array
    open_gain: float
    value: float
    value_with_feed_forward: float
    certificates: list[Certificate]
    outcome: Outcome

    @property
    def holds(self) -> bool:
        """Whether both gains are proven."""
        return self.outcome.ok

    def __str__(self) -> str:
        return self.outcome.text


def modal_feedback(modes: ThermalModes, *, sensors: Sequence[str], heaters: Sequence[str],
                   disturbances: Sequence[str], bandwidth: float, count: int = 1) -> ModalFeedback:
    """Control the modes that the tool point feels most, and leave the others alone.

    The `count` modes with the largest static displacement under the disturbances each get a PI, and the heaters are
    combined so that each PI heats its own mode only. They are read by least squares together with those others that the
    disturbances move most, as many as the thermometers tell apart. The modes that are left out see some of the heat and
    some of them is taken for the controlled ones: the proof is about all modes together.

    Parameters
    ----------
    modes : ThermalModes
        Modes of the machine, from `thermal_modes`.
    sensors : sequence of str
        Thermometers that are read, at least `count`.
    heaters : sequence of str
        Inputs to drive, at least `count`.
    disturbances : sequence of str
        Inputs and ambients that act on the machine, one unit of each at most.
    bandwidth : float
        Rate of the proportional loop of every controlled mode [rad/s]; the integral part takes over a factor 4 below.
    count : int
        How many modes are controlled [-].

    Returns
    -------
    ModalFeedback
        ``holds`` is False where the loop with all modes is not stable or its gain not proven.

    Raises
    ------
    InputError
        Unknown names, a heater that is a disturbance too, fewer thermometers or heaters than modes, thermometers that
        do not tell the modes apart, heaters that do not reach them.

    References
    ----------
    De Rozario, Voorhoeve, Aangenent and Oomen (2017), Global feedforward control of spatio-temporal mechanical systems,
    IFAC World Congress: modes from few sensors; Skogestad and Postlethwaite (2005), Sec. 4.2: tests of modes.

    Examples
    --------
    >>> import robthermal as rt
    >>> links = [{"between": ("left", "right"), "conductance": 2.0}]
    >>> links += [{"between": (side, "room"), "conductance": 0.5} for side in ("left", "right")]
    >>> stage = rt.System(ambients={"room": {"temperature": 295.0}}, links=links,
    ...     lumps={side: {"capacity": 500.0} for side in ("left", "right")},
    ...     inputs={"motor": {"lump": "left"}, "h1": {"lump": "left"}, "h2": {"lump": "right"}},
    ...     sensors={"T1": {"lump": "left"}, "T2": {"lump": "right"}})
    >>> modes = rt.design.thermal_modes(stage, expansion={"left": 2e-6, "right": -2e-6})  # tilt
    >>> d = rt.design.modal_feedback(modes, sensors=["T1", "T2"], heaters=["h1", "h2"], disturbances=["motor"],
    ...                              bandwidth=0.05)
    >>> d.holds, d.controlled, d.value < 0.2 * d.open_gain, d.feed_forward.round(9).tolist()
    (True, (1,), True, [[-0.5], [0.5]])
    """
    expect(modes, ThermalModes, "modes", "rt.design.thermal_modes")
    w, m = positive_number(bandwidth, "bandwidth", "rad/s"), whole_number(count, "count", least=1)
    used = place(modes.inputs, heaters, "argument heaters")
    acting = place(modes.inputs, disturbances, "argument disturbances")
    shared = sorted(set(used) & set(acting))
    if shared:
        raise InputError(f"{modes.inputs[shared[0]]!r} is a heater and a disturbance", where="argument disturbances",
                         expected="different inputs", remedy="Give the disturbance an input of its own, at its lump.")
    if m > min(len(used), len(list(sensors)), len(modes.rates)):
        raise InputError(f"{m} modes with {len(used)} heaters and {len(list(sensors))} thermometers",
                         where="argument count", expected="at most as many modes as either")
    chosen = modes.felt(list(disturbances))[:m]
    seen = _read(modes, sensors, chosen, acting)
    matrix = seen.matrix[:m]  # the first rows are those of the controlled modes
    own = modes.shapes[:, chosen].T @ modes.heat  # heat into the controlled modes, per input
    reach, sizes, _ = np.linalg.svd(own[:, used])
    if sizes[-1] <= _APART * sizes[0]:
        raise InputError(f"the heaters do not move {m} modes apart from one another", where="argument heaters",
                         expected="heaters at places where the modes differ", remedy="Control fewer modes.")
    apart = np.linalg.pinv(own[:, used])  # heaters that heat one mode by 1 W, the other controlled ones not at all
    forward = -apart @ own[:, acting]
    proportional = w * modes.capacities[chosen]
    K = Plant(np.zeros((m, m)), matrix, -apart * (proportional * w / _INTEGRAL),
              -apart @ (proportional[:, None] * matrix), 0.0)
    rows = place(modes.sensors, sensors, "argument sensors")
    return _proven(modes, seen, K, used, acting, rows, forward, tuple(map(int, chosen)))


def _read(modes: ThermalModes, sensors: Sequence[str], controlled: Array, acting: list[int]) -> ModalReconstruction:
    """Controlled modes first, then the others by their size under the disturbances while the thermometers tell them."""
    readings = modes.readings[place(modes.sensors, sensors, "argument sensors")] @ modes.shapes
    scale = np.linalg.norm(readings, axis=0)
    moved = np.abs(modes.shapes.T @ modes.heat[:, acting]).max(axis=1) / (modes.capacities * modes.rates)
    together = [int(i) for i in controlled]
    for i in np.argsort(-moved * scale, kind="stable"):
        more = [*together, int(i)]
        if i in together or len(more) > len(readings) or scale[more].min() == 0.0:
            continue
        if np.linalg.svd(readings[:, more] / scale[more], compute_uv=False)[-1] > _TOLD:
            together = more
    return reconstruct(modes, sensors, together)


def _proven(modes: ThermalModes, seen: ModalReconstruction, K: Plant, used: list[int], acting: list[int],
            rows: list[int], forward: Array, chosen: tuple[int, ...]) -> ModalFeedback:
    """The gain of all modes from the disturbances to the tool point, without and with feed-forward."""
    modal_heat = (modes.shapes.T @ modes.heat) / modes.capacities[:, None]
    outputs = np.vstack([_NANO * modes.tool_gains, modes.readings[rows] @ modes.shapes])

    def plant(disturbed: Array) -> Plant:
        B = np.hstack([disturbed, modal_heat[:, used]])
        return Plant(-np.diag(modes.rates), B, outputs, np.zeros((len(outputs), B.shape[1])), 0.0)

    plain, helped = plant(modal_heat[:, acting]), plant(modal_heat[:, acting] + modal_heat[:, used] @ forward)
    without = plant_norm(close(plain, Plant(np.zeros((0, 0)), np.zeros((0, len(rows))), np.zeros((len(used), 0)),
                                            np.zeros((len(used), len(rows))), 0.0)))[0] / _NANO
    loop = close(plain, K)
    certificates = [prove_closed_loop(one, K) for one in (plain, helped)] if loop.stable else []
    values = [float(np.nextafter(cert.region["bound"] / _NANO, np.inf)) if cert.holds else np.inf
              for cert in certificates] or [np.inf, np.inf]
    names = [modes.inputs[i] for i in used], [modes.inputs[i] for i in acting]
    system = control.ss(K.A, K.B, K.C, K.D, inputs=list(seen.sensors), outputs=names[0])
    return ModalFeedback(modes, chosen, tuple(names[0]), tuple(names[1]), seen, system, forward, float(without),
                         float(values[0]), float(values[1]), certificates,
                         _outcome(modes, chosen, loop.stable, without, values))


def _outcome(modes: ThermalModes, chosen: tuple[int, ...], stable: bool, without: float, values: list[float]
             ) -> Outcome:
    said = ", ".join(f"{i} ({1 / modes.rates[i]:.3g} s)" for i in chosen)
    if not stable:
        return SynthesisCode.NOT_CERTIFIED.outcome(
            f"PI control of mode {said} is unstable together with the modes that are left out: they spill into its "
            "readings.", remedy="Lower the bandwidth, or place thermometers beside the heaters.")
    if not np.isfinite(values).all():
        return SynthesisCode.NOT_CERTIFIED.outcome("The loop is stable in floats, but its gain was not proven.")
    return SynthesisCode.CERTIFIED.outcome(
        f"Certified for all {len(modes.rates)} modes and the controller as returned: with PI control of mode {said} "
        f"the L2 gain from the disturbances to the tool point is below {values[0]:.3g} m per unit, with exact "
        f"feed-forward below {values[1]:.3g}; without control it is {without:.3g}. Limits of the heaters, sampling and "
        "a network that differs are not covered.")
