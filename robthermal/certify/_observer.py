"""Certificates of sampled observers with modules evaluated at the estimate: one norm in which every error shrinks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import expm

from .._checks import positive_number
from ..conic import Form
from ..errors import InputError
from ..thermal import Equations, System
from ..verification import Certificate, establish, not_certified
from ._jacobian import BoxJacobian, box_jacobian
from ._loop_parameters import refuse_uncertain_sensors
from ._lyapunov import check_choice, short_matrices
from ._multipliers import Channel, multiplier_form
from ._polytope import MOST, Cuts, Polytope, common_form
from ._sections import Currents, Interval, Temperatures, made_by, region_section, system_section

Array = NDArray[np.floating[Any]]
_SOLVER = "Clarabel semidefinite program, multipliers or cutting planes"
_SLACK = (1e-6, 1e-3, 1e-2, 0.1, 0.5)  # share of the way to 1 given up when a proof fails
_SHOWN = 4  # lumps of an unstable mode


def observer(system: System, *, gain: ArrayLike, sensors: Sequence[str], sample_time: float = 1.0, current: Currents,
             temperature: Temperatures, parameters: Mapping[str, Interval] | None = None,
             large: bool = False) -> Certificate:
    """Certify that the error of a sampled observer shrinks for every temperature, estimate and current in a box.

    The observer is x̂⁺ = A_d x̂ + Γ f(x̂, I) + L (y − C x̂): A_d = exp(E⁻¹A T_s) of the passive network with the modules'
    conductance at their reference temperature, Γ = (E⁻¹A)⁻¹(A_d − 1)E⁻¹, f all other heat, S and R at the estimated
    temperatures, held over the sample. Its error obeys e⁺ = (A_d − L C + Γ ∂f/∂x) e.

    Parameters
    ----------
    system : System
        Network with its modules.
    gain : array_like, shape (n_lumps, n_sensors)
        L in predictor form [K/K], lumps in file order.
    sensors : sequence of str
        Sensors, or lumps, that are read, in the order of the columns of L.
    sample_time : float
        Time T_s between two samples [s].
    current : mapping
        {module: (lower, upper)} [A], every module.
    temperature : tuple or mapping
        Box of temperatures and of estimates [K], as in `contraction`.
    parameters : mapping, optional
        Uncertain numbers of the system as in `contraction`, but for capacities: the error shrinks for every combination
        that plant and observer share. A_d and Γ stay those of the system's own numbers; what the parameters differ from
        them is part of f. An observer whose model differs from the plant has an error that does not vanish: that is not
        claimed. Ranges of gains of sensors that it reads are refused.
    large : bool
        Search a dense P for more than 40 lumps too, which may take hours.

    Returns
    -------
    Certificate
        `holds` tells whether it is proven; if not, `reason` tells why, and which lumps an error grows in.

    Raises
    ------
    InputError
        A gain of another shape, unknown or lagging sensors, bad ranges, a large system.

    References
    ----------
    Evers (2021), (5.33)-(5.44), with the cross terms of (5.43) and the slopes S', R' that (5.44) drops.

    Examples
    --------
    >>> import robthermal as rt
    >>> system = rt.systems.two_module()
    >>> gain = np.zeros((18, 2))
    >>> gain[5, 0] = gain[6, 1] = 0.2
    >>> box = {"m1": (0.0, 1.0), "m2": (0.0, 1.0)}
    >>> cert = rt.certify.observer(system, gain=gain, sensors=["T6", "T7"], current=box, temperature=(278.15, 358.15))
    >>> cert.holds, rt.verify(cert).valid
    (True, True)
    """
    section = system_section(system)
    check_choice(system, "full", large)
    section["sensors"] = sensor_list(system, sensors)
    refuse_uncertain_sensors(system, sensors, parameters or {})
    section["gain"] = gain_matrix(gain, len(system.lumps), len(section["sensors"]))
    region = region_section(system, current, temperature, parameters)
    region["sample_time"] = positive_number(sample_time, "sample_time", "s")
    parts: dict[str, Any] = {"system": section, "region": region}
    error = _ErrorMatrices(system, section, region)
    real = error(box_jacobian(system, region))
    worst = _growth(real, system)
    if worst is not None:
        return not_certified("observer", **parts, evidence={}, reason=worst, made_by=made_by(_SOLVER, "not asked"))
    hull = box_jacobian(system, region, hull=True)
    vertices = error(hull)
    if vertices.count > MOST:
        reason = f"more than {MOST} joint vertices: too many for one matrix inequality"
        return not_certified("observer", **parts, evidence={}, reason=reason, made_by=made_by(_SOLVER, "not asked"))
    cuts = Cuts()
    n = len(system.lumps)
    Q = multiplier_form(vertices.base, error.channels(hull))
    factor = _factor(vertices, Q)
    if not factor < 1:  # multipliers for each module alone may lose what joint vertices allow
        Q, _ = common_form(vertices, _shrinking, np.ones((n, n), bool), cuts)
        factor = _factor(vertices, Q)
    if not factor < 1:
        reason = ("no matrix P was found for which e'Pe shrinks at every vertex of the box, although no frozen matrix "
                  "of it is unstable. Narrow the current or temperature range, or add sensors.")
        return not_certified("observer", **parts, evidence={}, reason=reason, made_by=made_by(_SOLVER, "none"))
    root = np.sqrt(Equations(system).capacity)
    for slack, matrix in zip(_SLACK, short_matrices(Q * np.outer(root, root)), strict=False):
        evidence = {"matrix": matrix, "contraction": float(np.ceil((1 - (1 - factor) * (1 - slack)) * 1e12) / 1e12)}
        status = f"{cuts.solves + 1} matrix inequalities; {100 * slack:g} % of the decay given up for the proof"
        cert = establish("observer", **parts, evidence=evidence, made_by=made_by(_SOLVER, status))
        if cert.holds:
            break
    return cert


def sensor_list(system: System, names: Sequence[str]) -> list[dict[str, Any]]:
    """Name, lump and gain of the sensors an observer reads; a lump stands for a sensor of its own."""
    if isinstance(names, str) or not isinstance(names, Sequence):
        raise InputError(f"{names!r} is not a list of names", where="argument sensors", expected='["T6", "T7"]')
    found = []
    for name in names:
        if name in system.sensors:
            sensor = system.prompt_thermometer(name, "argument sensors")
            found.append({"name": name, "lump": sensor.lump, "gain": sensor.gain})
        elif name in system.lumps:
            found.append({"name": name, "lump": name, "gain": 1.0})
        else:
            raise InputError(f"there is no sensor or lump {name!r}", where="argument sensors",
                             expected="one of " + ", ".join((*system.sensors, *system.lumps)))
    return found


class _ErrorMatrices:
    """M = A_d − L C + Γ ∂f/∂x over a box, in coordinates √E e."""

    def __init__(self, system: System, section: Mapping[str, Any], region: Mapping[str, Any]):
        eq = Equations(system)
        self.A, root = eq.A.toarray(), np.sqrt(eq.capacity)
        self.root = root
        F = self.A / eq.capacity[:, None]
        A_d = expm(F * region["sample_time"])
        hold = np.linalg.solve(F, A_d - np.eye(len(F))) / eq.capacity
        C = np.zeros((len(section["sensors"]), len(F)))
        for row, sensor in enumerate(section["sensors"]):
            C[row, list(system.lumps).index(sensor["lump"])] = sensor["gain"]
        self.passive = A_d - np.array(section["gain"]).reshape(len(F), len(C)) @ C
        self.hold = hold

    def __call__(self, box: BoxJacobian) -> Polytope:
        n, parts = len(self.root), []
        for block in box.blocks:
            nodes = [block.a] if block.b < 0 else [block.a, block.b]
            rows = self.hold[:, nodes] @ block.vertices[:, :len(nodes), :len(nodes)]
            part = np.zeros((len(rows), n, n))
            part[:, :, nodes] = rows
            parts.append(self._scaled(np.unique(part, axis=0)))
        rest = box.base.toarray() - self.A  # modules: f lacks what A holds
        return Polytope(self._scaled(self.passive + self.hold @ rest), tuple(parts))

    def channels(self, box: BoxJacobian) -> list[Channel]:
        """Every block as heat in (B), temperatures out (S) and slopes (D)."""
        parts: list[Channel] = []
        for block in box.blocks:
            nodes = [block.a] if block.b < 0 else [block.a, block.b]
            parts.append((self.hold[:, nodes] * self.root[:, None], np.eye(len(self.root))[nodes] / self.root,
                          block.vertices[:, :len(nodes), :len(nodes)]))
        return parts

    def _scaled(self, M: Array) -> Array:
        return M * self.root[:, None] / self.root


def _shrinking(M: Array) -> Form:
    eye = np.eye(len(M))
    return Form(((0.5 * eye, eye), (-0.5 * M, M)))


def _factor(vertices: Polytope, Q: Array) -> float:
    """Least factor with MᵀQM <= factor² Q at all vertices; inf where Q is not positive definite."""
    try:
        half = np.linalg.cholesky(Q)
    except np.linalg.LinAlgError:
        return np.inf
    inverse = np.linalg.inv(half)
    return vertices.largest(lambda M: np.linalg.norm(half.T @ M @ inverse.T, 2, axis=(1, 2)))


def _growth(vertices: Polytope, system: System) -> str | None:
    """Why the error grows at some frozen point of the box; none where every spectral radius is below one."""
    worst, matrix = 0.0, vertices.base
    for _, M in vertices.chunks():
        radius = np.abs(np.linalg.eigvals(M)).max(axis=1)
        if radius.max() > worst:
            worst, matrix = float(radius.max()), M[radius.argmax()]
    if worst < 1:
        return None
    values, modes = np.linalg.eig(matrix)
    mode = np.abs(modes[:, np.abs(values).argmax()])
    names = [system.lump_names[i] for i in np.argsort(-mode)[:_SHOWN]]
    return (f"with temperatures and currents frozen at a vertex of the box the error grows by {worst:.6g} per sample, "
            f"most in the lumps {', '.join(names)}: no certificate exists. Add sensors there, or narrow the current or "
            "temperature range.")


def gain_matrix(value: ArrayLike, rows: int, columns: int) -> list[list[float]]:
    """Rows of an observer's gain for a certificate's section."""
    try:
        gain = np.asarray(value, float)
    except (TypeError, ValueError):
        raise InputError("gain is not a matrix of numbers", where="argument gain",
                         expected=f"shape ({rows}, {columns})") from None
    if gain.shape != (rows, columns) or not np.isfinite(gain).all():
        finite = "" if np.isfinite(gain).all() else " with numbers that are not finite"
        raise InputError(f"shape {gain.shape}{finite}", where="argument gain",
                         expected=f"finite numbers, shape ({rows}, {columns}): a row per lump, a column per sensor")
    return gain.tolist()
