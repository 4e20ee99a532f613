"""Equations E ẋ = f(x, u) of a system as sparse arrays, with exact Jacobians in states, inputs and parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_array, csr_array

from ._parameters import locate
from ._terms import Array, ModuleTerm, NaturalTerm, RadiationTerm, Term

if TYPE_CHECKING:
    from ._system import System


@dataclass(frozen=True)
class Equations:
    """Equations of a thermal system.

    E ẋ = A x + B u + Σ heat of the nonlinear terms, with u the heaters, module currents and ambients in the order of
    `System.exogenous_names`. A holds the linear links and the modules' conductance at their reference temperature.

    Parameters
    ----------
    system : System
        What to write down.

    Attributes
    ----------
    capacity : ndarray, shape (n,)
        Diagonal of E [J/K].
    A : csr_array, shape (n, n)
        Linear network [W/K].
    B : csr_array, shape (n, n_u)
        Heaters [W/unit] and ambients [W/K]; the columns of the currents are empty.

    Examples
    --------
    >>> import robthermal as rt
    >>> eq = rt.thermal.Equations(rt.systems.two_module())
    >>> x, u = eq.initial(), eq.nominal()
    >>> bool(abs(eq.heat(x, u)).max() < 1e-9)  # at rest at room temperature
    True
    """

    system: System

    @cached_property
    def _index(self) -> dict[str, int]:
        """Node numbers: lumps first, then ambients."""
        return {name: i for i, name in enumerate((*self.system.lumps, *self.system.ambients))}

    @cached_property
    def capacity(self) -> NDArray[np.float64]:
        """Diagonal of E [J/K]."""
        return np.array([lump.capacity for lump in self.system.lumps.values()])

    @cached_property
    def _network(self) -> csr_array:
        """Linear heat into the lumps from every node, (n, n + n_ambients) [W/K]."""
        i = self._index
        ends = [(i[link.between[0]], i[link.between[1]], link.conductance) for link in self.system.links]
        ends += [(i[m.hot], i[m.cold], m.conductance.value) for m in self.system.modules.values()]
        a, b, g = (np.array(column) for column in zip(*ends, strict=True)) if ends else (np.zeros(0),) * 3
        a, b = a.astype(np.intp), b.astype(np.intp)
        n, nodes = len(self.system.lumps), len(i)
        rows, columns = np.concatenate([a, a, b, b]), np.concatenate([a, b, b, a])
        full = coo_array((np.concatenate([-g, g, -g, g]), (rows, columns)), shape=(nodes, nodes)).tocsr()
        return csr_array(full[:n])

    @cached_property
    def A(self) -> csr_array:
        """Linear network [W/K], (n, n)."""
        return csr_array(self._network[:, : len(self.system.lumps)])

    @cached_property
    def B(self) -> csr_array:
        """Heat per unit of every heater [W/unit] and ambient [W/K], (n, n_u)."""
        n, i = len(self.system.lumps), self._index
        heaters = list(self.system.inputs.values())
        rows = [i[h.lump] for h in heaters]
        own = coo_array(([h.gain for h in heaters], (rows, range(len(heaters)))),
                        shape=(n, len(heaters) + len(self.system.modules))).tocsc()
        return csr_array(coo_array(_beside(own, self._network[:, n:])))

    @cached_property
    def terms(self) -> tuple[Term, ...]:
        """Nonlinear terms that are present."""
        found: list[Term] = []
        if self.system.modules:
            found.append(self._modules())
        natural = [link for link in self.system.links if link.natural is not None]
        if natural:
            a, b = self._ends(natural)
            found.append(NaturalTerm(a, b, np.array([link.natural.gain for link in natural if link.natural]),
                                     np.array([link.natural.exponent for link in natural if link.natural])))
        radiating = [link for link in self.system.links if link.radiation is not None]
        if radiating:
            found.append(RadiationTerm(*self._ends(radiating), np.array([link.radiation for link in radiating], float)))
        return tuple(found)

    def _ends(self, links: Sequence) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        i = self._index
        return (np.array([i[link.between[0]] for link in links], np.intp),
                np.array([i[link.between[1]] for link in links], np.intp))

    def _modules(self) -> ModuleTerm:
        i, modules = self._index, list(self.system.modules.values())
        return ModuleTerm(
            a=np.array([i[m.hot] for m in modules], np.intp), b=np.array([i[m.cold] for m in modules], np.intp),
            S=np.array([m.seebeck.value for m in modules]), S_slope=np.array([m.seebeck.slope for m in modules]),
            R=np.array([m.resistance.value for m in modules]), R_slope=np.array([m.resistance.slope for m in modules]),
            K_slope=np.array([m.conductance.slope for m in modules]),
            T_ref=np.array([m.reference_temperature for m in modules]))

    def nominal(self) -> NDArray[np.float64]:
        """Exogenous vector u with heaters and currents off and ambients at their nominal temperature."""
        off = np.zeros(len(self.system.inputs) + len(self.system.modules))
        return np.concatenate([off, [a.temperature for a in self.system.ambients.values()]])

    def initial(self) -> NDArray[np.float64]:
        """Temperatures at the start [K]: the file's, else the first ambient's."""
        first = next(iter(self.system.ambients.values())).temperature
        return np.array([first if lump.initial is None else lump.initial for lump in self.system.lumps.values()])

    def ends(self, term: Term, x: Array, u: Array) -> tuple[Array, Array, Array]:
        """Temperatures at both ends of every pair of a term, and the current through it.

        Parameters
        ----------
        term : Term
            One of `terms`.
        x, u : ndarray
            As in `heat`.

        Returns
        -------
        tuple of ndarray
            Temperatures at the ends a and b [K], shape (..., n_terms), and the currents [A]; none if the term is not
            the modules'.
        """
        nodes = np.concatenate([x, u[..., u.shape[-1] - len(self.system.ambients):]], axis=-1)
        first = len(self.system.inputs)
        current = u[..., first: first + len(self.system.modules)]
        return nodes[..., term.a], nodes[..., term.b], current if isinstance(term, ModuleTerm) else current[..., :0]

    def heat(self, x: ArrayLike, u: ArrayLike) -> Array:
        """Net heat into every lump, f(x, u).

        Parameters
        ----------
        x : array_like, shape (..., n)
            Temperatures [K].
        u : array_like, shape (..., n_u)
            Exogenous values [unit, A, K].

        Returns
        -------
        ndarray, shape (..., n)
            [W].
        """
        x, u = np.asarray(x), np.asarray(u)
        total = (self.A @ x.T + self.B @ u.T).T.astype(np.result_type(x, u, float))
        for term in self.terms:
            into_a, into_b = term.heat(*self.ends(term, x, u))
            for nodes, flow in ((term.a, into_a), (term.b, into_b)):
                _add_to_lumps(total, nodes, flow)
        return total

    def jacobian(self, x: ArrayLike, u: ArrayLike) -> csr_array:
        """∂f/∂x at one point.

        Parameters
        ----------
        x : array_like, shape (n,)
            Temperatures [K].
        u : array_like, shape (n_u,)
            Exogenous values [unit, A, K].

        Returns
        -------
        csr_array, shape (n, n)
            [W/K].
        """
        x, u = np.asarray(x), np.asarray(u)
        n, parts = len(self.system.lumps), [self.A]
        for term in self.terms:
            s = term.slopes(*self.ends(term, x, u))
            parts.append(_square(n, (term.a, term.a, s.aa), (term.a, term.b, s.ab), (term.b, term.a, s.ba),
                                 (term.b, term.b, s.bb)))
        return csr_array(sum(parts[1:], start=parts[0]))

    def input_jacobian(self, x: ArrayLike, u: ArrayLike) -> csr_array:
        """∂f/∂u at one point.

        Parameters
        ----------
        x, u : array_like
            As in `jacobian`.

        Returns
        -------
        csr_array, shape (n, n_u)
            [W/unit, W/A, W/K].
        """
        x, u = np.asarray(x), np.asarray(u)
        n, nu = len(self.system.lumps), u.size
        first = len(self.system.inputs)
        parts = [self.B]
        for term in self.terms:
            s = term.slopes(*self.ends(term, x, u))
            entries = [(term.a, term.b + first + len(self.system.modules) - n, s.ab),
                       (term.b, term.a + first + len(self.system.modules) - n, s.ba)]
            keep = [(row, col, val, (col >= first + len(self.system.modules)) & (row < n)) for row, col, val in entries]
            if isinstance(term, ModuleTerm):
                every, columns = np.ones(len(term.a), bool), first + np.arange(len(term.a))
                keep += [(term.a, columns, s.a_current, every), (term.b, columns, s.b_current, every)]
            rows, cols, values = (np.concatenate([e[k][e[3]] for e in keep]) for k in range(3))
            parts.append(csr_array(coo_array((values, (rows, cols)), shape=(n, nu))))
        return csr_array(sum(parts[1:], start=parts[0]))

    def rate(self, x: ArrayLike, u: ArrayLike) -> Array:
        """ẋ = E⁻¹ f(x, u).

        Parameters
        ----------
        x, u : array_like
            As in `heat`.

        Returns
        -------
        ndarray, shape (..., n)
            [K/s].
        """
        return self.heat(x, u) / self.capacity

    def parameter_heat(self, name: str, x: ArrayLike, u: ArrayLike) -> list[tuple[int, Array]]:
        """Derivative of f - E ẋ with respect to one named parameter, as the few lumps it touches.

        Parameters
        ----------
        name : str
            For example ``modules.m1.seebeck.slope``.
        x, u : array_like
            As in `heat`.

        Returns
        -------
        list of (int, ndarray)
            Lump index and heat per unit of the parameter, shape of the leading axes of x. Empty for what does not act
            on the lumps (sensors, initial temperatures).
        """
        x, u = np.asarray(x), np.asarray(u)
        table, part, field = locate(self.system, name)
        if table == "lumps":
            i = self._index[part]
            return [(i, -self.heat(x, u)[..., i] / self.capacity[i])] if field == "capacity" else []
        if table == "inputs":
            column = list(self.system.inputs).index(part)
            return [(self._index[self.system.inputs[part].lump], u[..., column] * np.ones(x.shape[:-1]))]
        if table == "ambients":
            return self._ambient_heat(part, x, u)
        if table in ("links", "modules"):
            return self._pair_heat(table, part, field, x, u)
        return []

    def _ambient_heat(self, name: str, x: Array, u: Array) -> list[tuple[int, Array]]:
        node = self._index[name]
        column = node - len(self.system.lumps) + len(self.system.inputs) + len(self.system.modules)
        linear = self.B[:, [column]].toarray()[:, 0]
        total = np.broadcast_to(linear, x.shape).astype(np.result_type(x, u, float))
        for term in self.terms:
            s = term.slopes(*self.ends(term, x, u))
            for other, here, slope in ((term.a, term.b, s.ab), (term.b, term.a, s.ba)):
                _add_to_lumps(total, other, np.where(here == node, slope, 0.0))
        touched = np.flatnonzero(np.any(total.reshape(-1, total.shape[-1]) != 0, axis=0))
        return [(int(i), total[..., i]) for i in touched]

    def _pair_heat(self, table: str, part: str, field: str, x: Array, u: Array) -> list[tuple[int, Array]]:
        if table == "links":
            ends = next(link.between for link in self.system.links if link.name == part)
        else:
            ends = (self.system.modules[part].hot, self.system.modules[part].cold)
        a, b = self._index[ends[0]], self._index[ends[1]]
        nodes = np.concatenate([x, u[..., u.shape[-1] - len(self.system.ambients):]], axis=-1)
        if field in ("conductance", "conductance.value"):
            flow = nodes[..., b] - nodes[..., a]
            flows = (flow, -flow)
        else:
            flows = self._term_parameter(table, part, field, x, u)
        return [(node, flow) for node, flow in zip((a, b), flows, strict=True) if node < len(self.system.lumps)]

    def _term_parameter(self, table: str, part: str, field: str, x: Array, u: Array) -> tuple[Array, Array]:
        kind: type[ModuleTerm | NaturalTerm | RadiationTerm]
        if table == "modules":
            kind, number = ModuleTerm, list(self.system.modules).index(part)
        elif field == "radiation":
            kind = RadiationTerm
            number = [li.name for li in self.system.links if li.radiation is not None].index(part)
        else:
            kind = NaturalTerm
            number = [li.name for li in self.system.links if li.natural is not None].index(part)
        term = next(term for term in self.terms if isinstance(term, kind))
        into_a, into_b = term.parameter_slopes(field, *self.ends(term, x, u))
        shape = (*x.shape[:-1], len(term.a))
        return np.broadcast_to(into_a, shape)[..., number], np.broadcast_to(into_b, shape)[..., number]


def _beside(left: csr_array, right: csr_array) -> coo_array:
    a, b = coo_array(left), coo_array(right)
    rows, columns = np.concatenate([a.row, b.row]), np.concatenate([a.col, b.col + left.shape[1]])
    return coo_array((np.concatenate([a.data, b.data]), (rows, columns)),
                     shape=(left.shape[0], left.shape[1] + right.shape[1]))


def _square(n: int, *entries: tuple[NDArray[np.intp], NDArray[np.intp], Array]) -> csr_array:
    rows, columns, values = (np.concatenate([e[k] for e in entries]) for k in range(3))
    keep = (rows < n) & (columns < n)
    return csr_array(coo_array((values[keep], (rows[keep], columns[keep])), shape=(n, n)))


def _add_to_lumps(total: Array, nodes: NDArray[np.intp], flow: Array) -> None:
    """Add flow (..., n_terms) to the lumps among nodes; several terms may share a lump."""
    keep = nodes < total.shape[-1]
    np.add.at(total, (..., nodes[keep]), flow[..., keep])  # type: ignore[arg-type]  # numpy's stub knows no index tuple
