"""Peak gains from ambient and heat-load disturbances to every lump, for any currents of a box (input-to-state)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array, diags_array
from scipy.sparse.linalg import splu

from .._drawing import axes_for
from .._pandas import pd
from ..errors import InputError, Outcome
from ..thermal import System
from ..verification import Certificate, establish, not_certified
from ._jacobian import BoxJacobian, box_jacobian
from ._outcomes import CertifyCode
from ._sections import JACOBIAN, Currents, Interval, Temperatures, made_by, named_ranges, region_section, system_section
from ._weights import best_weights

Array = NDArray[np.float64]
_SOLVER = "policy iteration with sparse LU"
_SHARES = (1e-4, 1e-3, 1e-2, 0.1)  # share of the decay rate spent on closing the proof, tried in turn
_MOST = 100  # policies


@dataclass(frozen=True)
class Gains:
    """Peak gains from disturbances to lumps.

    Parameters
    ----------
    ambient : DataFrame
        Lumps by ambients [K/K]; empty when nothing is certified.
    heat : DataFrame
        Lumps by lumps that take the heat [K/W].
    certificate : Certificate
        Of kind "gain", for all of them.
    outcome : Outcome
        "certified", or why not.
    """

    ambient: pd.DataFrame
    heat: pd.DataFrame
    certificate: Certificate
    outcome: Outcome

    def __str__(self) -> str:
        both = pd.concat([self.ambient.add_suffix(" [K/K]"), self.heat.add_suffix(" [K/W]")], axis=1)
        return f"{self.outcome.text}\n{both.round(3).to_string()}" if len(both) else self.outcome.text

    def plot(self, ax: Any = None) -> Any:
        """Show the gains from heat loads as an image; returns the matplotlib axes.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Axes to draw into; default new ones.
        """
        ax = axes_for(ax)
        image = ax.imshow(self.heat.to_numpy())
        ax.set_xticks(range(self.heat.shape[1]), self.heat.columns, rotation=90)
        ax.set_yticks(range(self.heat.shape[0]), self.heat.index)
        ax.set(xlabel="lump with the heat load", ylabel="lump that moves")
        ax.figure.colorbar(image, ax=ax, label="peak gain [K/W]")
        return ax


def gains(system: System, *, current: Currents, temperature: Temperatures, heat: Sequence[str] | None = None,
          ambient: Mapping[str, Interval] | None = None,
          parameters: Mapping[str, Interval] | None = None) -> Gains:
    """Certify how far ambient and heat-load disturbances can move every lump, whatever the currents do.

    Two trajectories in the box under the same currents that differ in one disturbance by at most s for ever never part
    by more than gain times s, plus what is left of the difference at their start, which fades. Gains of disturbances
    that act together add.

    Parameters
    ----------
    system : System
        Network with its modules.
    current : mapping
        {module: (lower, upper)} [A], every module, arbitrary in time.
    temperature : tuple or mapping
        Box as in `contraction` [K]; that it is not left is another claim (`invariance`).
    heat : sequence of str, optional
        Lumps that may take a heat load; default all.
    ambient : mapping, optional
        {ambient: (lower, upper)} [K]; needed where natural convection or radiation leads to an ambient.
    parameters : mapping, optional
        Uncertain numbers of the system as in `contraction`.

    Returns
    -------
    Gains

    Raises
    ------
    InputError
        Ranges that do not fit the system, unknown lumps or ambients.

    References
    ----------
    Rantzer, "Scalable control of positive systems", European Journal of Control 24 (2015).

    Examples
    --------
    >>> import robthermal as rt
    >>> box = {"m1": (0.0, 1.5), "m2": (0.0, 1.5)}
    >>> found = rt.certify.gains(rt.systems.two_module(), current=box, temperature=(278.15, 358.15))
    >>> round(float(found.ambient.loc["x9", "room"]), 2), round(float(found.ambient.loc["x11", "room"]), 2)  # K/K
    (1.27, 1.23)
    """
    region = region_section(system, current, temperature, parameters, JACOBIAN)
    if ambient:
        region["ambient"] = named_ranges(ambient, system.ambient_names, "ambient", "ambient", kelvin=True)
    loads = list(system.lump_names if heat is None else heat)
    unknown = [name for name in loads if name not in system.lumps]
    if unknown:
        raise InputError(f"there is no lump {unknown[0]!r}", where="argument heat",
                         expected="one of " + ", ".join(system.lump_names))
    parts: dict[str, Any] = {"system": system_section(system, forcing=True), "region": region}
    box = box_jacobian(system, region)
    sources = _ambient_columns(system, region)
    found = best_weights(box, "max")
    if found is None:
        reason = ("no weights exist for which every row sum is negative over the box: no peak gain is finite for this "
                  "bound. Narrow the current or temperature range.")
        return _none(not_certified("gain", **parts, evidence={}, reason=reason, made_by=made_by(_SOLVER, "none")))
    columns = np.column_stack([*sources.values(), *(np.eye(len(system.lumps))[:, [system.lump_names.index(name)
                                                                                 for name in loads]].T)])
    for share in _SHARES:
        values = _round_up(_least_gains(box, columns, share * found[1]))
        evidence = {"rate": float(f"{0.5 * share * found[1]:.3g}"), "gains": {
            "ambients": {name: values[:, k] for k, name in enumerate(sources)},
            "heat": {name: values[:, len(sources) + k] for k, name in enumerate(loads)}}}
        cert = establish("gain", **parts, evidence=evidence, made_by=made_by(_SOLVER, f"found; {share:g} of the rate"))
        if cert.holds:
            frame = pd.DataFrame(values, index=list(system.lump_names), columns=[*sources, *loads])
            ambients, heats = frame.iloc[:, :len(sources)], frame.iloc[:, len(sources):]
            return Gains(ambients, heats, cert, CertifyCode.CERTIFIED.outcome(
                f"Certified: at most {ambients.max().max():.3g} K per K of ambient and {heats.max().max():.3g} K per W "
                "of load."))
    return _none(cert)


def _none(certificate: Certificate) -> Gains:
    return Gains(pd.DataFrame(), pd.DataFrame(), certificate,
                 CertifyCode.NOT_CERTIFIED.outcome(f"Not certified: {certificate.reason}", remedy=""))


def _ambient_columns(system: System, region: Mapping[str, Any]) -> dict[str, Array]:
    """Largest heat into every lump per kelvin of each ambient [W/K]."""
    columns = {name: np.zeros(len(system.lumps)) for name in system.ambient_names}
    box, ranges = region["temperature"], region.get("ambient", {})
    for link in system.links:
        for far, own in (link.between, link.between[::-1]):
            if far not in columns:
                continue
            g = region.get("parameters", {}).get(f"links.{link.name}.conductance", (0.0, link.conductance))[1]
            if link.natural is not None or link.radiation is not None:
                g += _bent_slope(link, box[own] if isinstance(box, Mapping) else box, ranges, far)
            columns[far][system.lump_names.index(own)] += g
    return columns


def _bent_slope(link: Any, own: Sequence[float], ranges: Mapping[str, Any], far: str) -> float:
    if far not in ranges:
        raise InputError(f"the link {link.name!r} to ambient {far!r} is not linear, and that ambient has no range",
                         where="argument ambient", remedy=f'Give ambient={{"{far}": (lower, upper)}} [K].')
    low, high = ranges[far]
    slope = 4 * (link.radiation or 0.0) * high**3
    if link.natural is not None:
        apart = max(abs(own[1] - low), abs(own[0] - high))
        slope += link.natural.gain * (1 + link.natural.exponent) * apart**link.natural.exponent
    return slope


def _least_gains(box: BoxJacobian, columns: Array, rate: float) -> Array:
    """Least d with |J| d + rate E d + b <= 0 over the box, for every column b.

    Every row takes its worst vertex given d; with these, d = -J⁻¹ b; repeated until no row changes (Howard's policy
    iteration: d grows monotonically to the least solution, which exists where weights for the rate do).
    """
    found = []
    base = box.base + diags_array(rate * box.capacity)
    for b in columns.T:
        d, chosen = np.ones(len(b)), None
        for _ in range(_MOST):
            policy = _worst_rows(box, d)
            if chosen is not None and all(np.array_equal(p, q) for p, q in zip(policy, chosen, strict=True)):
                break
            chosen = policy
            d = splu(_assembled(box, base, policy)).solve(-b)
        found.append(d)
    return np.column_stack(found)


def _worst_rows(box: BoxJacobian, d: Array) -> list[Array]:
    """Entries (own, other) of every block's rows at the vertex with the largest row sum."""
    rows = []
    for block in box.blocks:
        for line, (own, other) in enumerate(((block.a, block.b), (block.b, block.a))):
            if own < 0:
                continue
            entries = np.column_stack([block.vertices[:, line, line], np.abs(block.vertices[:, line, 1 - line])])
            values = entries @ np.array([d[own], d[other] if other >= 0 else 0.0])
            rows.append(np.array([own, other, *entries[values.argmax()]]))
    return rows


def _assembled(box: BoxJacobian, base: Any, policy: list[Array]) -> csc_array:
    J = base.tolil()
    for own, other, diagonal, beside in policy:
        J[int(own), int(own)] += diagonal
        if other >= 0:
            J[int(own), int(other)] += beside
    return csc_array(J)


def _round_up(values: Array) -> Array:
    """Nine digits, never less: a rounding must not eat the slack of the stiffest row."""
    scale = 10.0 ** (8 - np.floor(np.log10(values)))
    raised = np.ceil(values * scale) / scale
    return np.array([float(f"{value:.9g}") for value in raised.ravel()]).reshape(values.shape)
