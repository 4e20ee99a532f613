"""The linear cold side that the feedback law leaves to the outer loop, G_lin of Evers (5.19), sampled exactly."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from .._control import control
from ..errors import InputError
from ..thermal import Equations
from ._discrete import delayed, held
from ._linearization import FeedbackLinearization
from ._modules import Array
from ._numbers import expect, numbers
from ._regulated_points import Regulate, RegulatedPoint, regulated_points

_ALIKE = 1e8  # condition of the static gains beyond which two points move as one


@dataclass(frozen=True)
class ColdSide:
    """E ẋ = A x + v + B w: lumps of the cold side, driven by the modules' heats and by everything around them.

    Parameters
    ----------
    law : FeedbackLinearization
        Whose modules drive it.
    lumps : tuple of str
        Lumps of the cold side, the states of the plant.
    around : tuple of str
        What else acts: heaters, ambients, and hot faces that touch the cold side through a link. In this order they
        are the inputs after the modules' heats.
    A, B : ndarray
        (n, n) [1/s] and (n, n_modules + n_around).
    points : tuple of RegulatedPoint
        What every module regulates.
    """

    law: FeedbackLinearization
    lumps: tuple[str, ...]
    around: tuple[str, ...]
    A: Array
    B: Array
    points: tuple[RegulatedPoint, ...]

    @property
    def indices(self) -> NDArray[np.intp]:
        """Positions of its lumps among all lumps of the system."""
        return np.array([self.law.system.lump_names.index(name) for name in self.lumps], np.intp)

    @property
    def C(self) -> Array:
        """Selects the cold faces, (n_modules, n)."""
        faces = [part.cold for part in self.law.modules.parts]
        return np.array([[float(lump == face) for lump in self.lumps] for face in faces])

    @property
    def at_faces(self) -> bool:
        """Whether every module regulates its own cold face."""
        return all(point.plain and point.lump == part.cold
                   for point, part in zip(self.points, self.law.modules.parts, strict=True))

    def response(self, frequency: ArrayLike) -> NDArray[np.complex128]:
        """Frequency response from the heats v to what is regulated, (n_frequencies, n_modules, n_modules) [K/W].

        Parameters
        ----------
        frequency : array_like
            Angular frequencies of the response [rad/s].
        """
        s = 1j * np.atleast_1d(np.asarray(frequency, float))
        m = len(self.points)
        at = [self.lumps.index(point.lump) for point in self.points]
        X = np.linalg.solve(s[:, None, None] * np.eye(len(self.A)) - self.A, self.B[:, :m])
        return X[:, at] * np.stack([point.response(s) for point in self.points], axis=-1)[:, :, None]

    def regulated(self, sample_time: float) -> tuple[Array, Array, Array]:
        """Sampled A, B, C from held heats v to what is regulated; states: lumps, lags of sensors, delayed readings.

        Exact: a delay of l samples less a part of one reads the state that far into the earlier sample.

        Parameters
        ----------
        sample_time : float
            Time between samples [s].
        """
        n, m, lags = len(self.A), len(self.points), [p for p in self.points if p.time_constant]
        A, B = np.zeros((n + len(lags), n + len(lags))), np.zeros((n + len(lags), m))
        A[:n, :n], B[:n] = self.A, self.B[:, :m]
        C = np.zeros((m, len(A)))
        for row, point in enumerate(lags, n):
            A[row, self.lumps.index(point.lump)], A[row, row] = 1 / point.time_constant, -1 / point.time_constant
        for row, point in enumerate(self.points):
            C[row, n + lags.index(point) if point.time_constant else self.lumps.index(point.lump)] = point.gain
        return delayed(A, B, C, [point.delay for point in self.points], sample_time)

    def expect_faces(self, what: str) -> None:
        """Refuse a plant that regulates anything but its cold faces.

        Parameters
        ----------
        what : str
            Name of the controller that cannot do more.
        """
        if not self.at_faces:
            raise InputError(f"{what} of {', '.join(point.name for point in self.points)}", where="argument plant",
                             expected="a plant that regulates its cold faces", remedy="Use rt.design.pid or "
                             "linear_controller for another point, or leave regulate out.")

    def sampled(self, sample_time: float) -> tuple[Array, Array]:
        """Exact zero-order-hold A_d and B_d at a sample time [s].

        Parameters
        ----------
        sample_time : float
            Time between samples [s].
        """
        return held(self.A, self.B, sample_time)

    def to_control(self, sample_time: float = 0.0) -> control.StateSpace:
        """python-control state space from [v, around] to the cold faces; continuous for sample_time 0.

        Parameters
        ----------
        sample_time : float
            Time between samples [s].
        """
        A, B = self.sampled(sample_time) if sample_time else (self.A, self.B)
        return control.ss(A, B, self.C, np.zeros((len(self.C), B.shape[1])), dt=sample_time, states=list(self.lumps),
                          inputs=[*(f"heat of {name}" for name in self.law.names), *self.around],
                          outputs=[part.cold for part in self.law.modules.parts])

    def surroundings(self, temperatures: Array, exogenous: Mapping[str, float]) -> Array:
        """Values of `around` from all lump temperatures and the heaters and ambients by name.

        Parameters
        ----------
        temperatures : ndarray or mapping
            Temperatures of all lumps [K].
        exogenous : ndarray
            Heaters, currents and ambients in the order of `System.exogenous_names` [unit, A, K].
        """
        names = self.law.system.lump_names
        nominal = {name: part.temperature for name, part in self.law.system.ambients.items()}
        return np.array([temperatures[names.index(name)] if name in names else exogenous.get(name, nominal.get(name, 0))
                         for name in self.around])

    def holding_heat(self, reference: ArrayLike, around: ArrayLike) -> Array:
        """Steady heats v that hold the cold faces at a reference, given the surroundings: static feed-forward [W].

        Parameters
        ----------
        reference : ndarray
            Set-points of the cold faces [K].
        around : ndarray
            Temperatures of the surroundings [K].
        """
        m = len(self.law.names)
        X = np.linalg.solve(-self.A, self.B)
        to_face = self.C @ X
        return np.linalg.solve(to_face[:, :m], np.asarray(reference) - to_face[:, m:] @ np.asarray(around))


def cold_side(law: FeedbackLinearization, temperatures: ArrayLike | None = None, *,
              regulate: Regulate = None) -> ColdSide:
    """Linear plant of a feedback-linearized system, from the heats v to the cold faces.

    Parameters
    ----------
    law : FeedbackLinearization
        Linearizing feedback law whose modules drive the plant.
    temperatures : array_like, shape (n_lumps,), optional
        Where natural convection and radiation are linearized [K]; default the initial temperatures. The links of
        modules and conduction are linear: for them it does not matter.
    regulate : mapping of module to str, optional
        Sensor or lump that a module regulates; default its cold face. Lag, delay, gain and offset of a sensor, and the
        network between the cold face and the point, are then part of the loop.

    Returns
    -------
    ColdSide
        Lumps that a cold face reaches through links, hot faces apart: those act like ambients, so the plant stays
        linear when a screw joins both sides.

    Raises
    ------
    InputError
        When one lump is the hot face of one driven module and the cold face of another (a cascade): v of the one is
        then not free of the current of the other. A regulated point that its module does not influence through its
        cold side, or that it cannot move independently of another one.

    Examples
    --------
    >>> import robthermal as rt
    >>> plant = rt.design.cold_side(rt.design.feedback_linearization(rt.systems.two_module()))
    >>> len(plant.lumps), plant.around
    (8, ('room',))
    """
    expect(law, FeedbackLinearization, "law", "rt.design.feedback_linearization")
    system, eq = law.system, Equations(law.system)
    hot = {part.hot for part in system.modules.values()}
    for name, part in zip(law.names, law.modules.parts, strict=True):
        if part.cold in hot:
            raise InputError(f"the cold face {part.cold!r} of module {name!r} is another module's hot face",
                             where="argument law", expected="one stage: a cascade is not designed at once",
                             remedy="In Python linearize the cold stage only, rt.design.feedback_linearization(..., "
                             "modules=[…]), and let the other stage hold its own temperature; in a project file leave "
                             "[design] out.")
    x = eq.initial() if temperatures is None else numbers(temperatures, "temperatures")
    law.modules.faces(x)
    full = _passive(eq, x)
    n = len(system.lumps)
    free = np.array([i for i, name in enumerate(system.lump_names) if name not in hot], np.intp)
    _, label = connected_components(csr_array(full[np.ix_(free, free)]), directed=False)
    wanted = {label[np.searchsorted(free, i)] for i in law.modules.cold}
    states = free[np.isin(label, list(wanted))]
    others = [i for i in range(full.shape[1]) if i >= n or system.lump_names[i] in hot]
    heaters = eq.B[:, :len(system.inputs)].toarray()[states]
    used_heaters = [j for j in range(heaters.shape[1]) if heaters[:, j].any()]
    used = np.array([i for i in others if full[states, i].any()], np.intp)
    nodes = (*system.lump_names, *system.ambient_names)
    around = (*(system.input_names[j] for j in used_heaters), *(nodes[i] for i in used))
    drive = np.array([[float(i == c) for c in law.modules.cold] for i in states])
    B = np.hstack([drive, heaters[:, used_heaters], full[np.ix_(states, used)]])
    capacity = eq.capacity[states][:, None]
    side = ColdSide(law, tuple(nodes[i] for i in states), around, full[np.ix_(states, states)] / capacity, B / capacity,
                    regulated_points(law, regulate))
    island = {nodes[i]: int(label[np.searchsorted(free, i)]) for i in states}
    _check_influence(side, island)
    return side


def _check_influence(side: ColdSide, part: Mapping[str, int]) -> None:
    """Refuse points that no current can hold: not on the cold side of their module, or two that move as one."""
    faces = [module.cold for module in side.law.modules.parts]
    for point, face in zip(side.points, faces, strict=True):
        if part.get(point.lump) != part[face]:
            what = f"{point.kind} {point.name!r}" + (f", on lump {point.lump!r}," if point.kind == "sensor" else "")
            why = (f"no link joins it to {face!r}" if point.lump in part
                   else f"it is not on the cold side of {point.module!r}")
            near = [lump for lump in side.lumps if part[lump] == part[face]]
            raise InputError(f"module {point.module!r} does not influence {what} through its cold face: {why}",
                             where=f"regulate {point.module}", expected="a lump among " + ", ".join(near)
                             + ", or a sensor on one of them",
                             remedy="The law makes the cold side linear; what the hot side warms is no part of it.")
    gain = side.response(0.0)[0].real
    scale = gain / np.sqrt(np.outer(np.abs(gain).max(axis=1), np.abs(gain).max(axis=0)))
    if np.linalg.cond(scale) > _ALIKE:
        raise InputError("the modules cannot move " + ", ".join(point.name for point in side.points)
                         + " independently of each other", where="regulate", expected="a point of its own for every "
                         "module", remedy="Let one of the modules regulate its cold face.")


def _passive(eq: Equations, x: Array) -> Array:
    """Heat into the lumps per kelvin of every lump and ambient, without the modules, (n, n + n_ambients) [W/K]."""
    u = eq.nominal()
    first = u.size - len(eq.system.ambients)
    full = np.hstack([eq.jacobian(x, u).toarray(), eq.input_jacobian(x, u).toarray()[:, first:]])
    names = eq.system.lump_names
    for part in eq.system.modules.values():
        h, c = names.index(part.hot), names.index(part.cold)
        K = part.conductance.value + part.conductance.slope * (0.5 * (x[h] + x[c]) - part.reference_temperature)
        bend = 0.5 * part.conductance.slope * (x[h] - x[c])
        full[h, h] += K + bend
        full[h, c] -= K - bend
        full[c, c] += K - bend
        full[c, h] -= K + bend
    return full
