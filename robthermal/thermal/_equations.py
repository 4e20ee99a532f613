"""Equations E ẋ = f(x, u) of a system as sparse arrays, with exact Jacobians in states, inputs and parameters."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from ._assembly_terms import terms_of
from ._drives import Drives
from ._parameter_heat import add_to_lumps, parameter_heat
from ._terms import Array, Indices, Term

if TYPE_CHECKING:
    from ._system import System


@dataclass(frozen=True)
class Equations:
    """Equations of a thermal system.

    E ẋ = A x + D w + Σ heat of the nonlinear terms. u are the heaters, module currents and ambients as in a record, in
    the order of `System.exogenous_names`; w = drives(u) is what heaters and amplifiers make of them, and a 1 for
    constant heats. A holds the linear links and the modules' conductance at their reference temperature.

    Parameters
    ----------
    system : System
        What to write down.
    averaged : bool, optional
        Whether readings are means over the sample before them, as in a record of that kind.
    ripple : tuple of str, optional
        Modules whose currents have a ripple in the record.

    Attributes
    ----------
    capacity : ndarray, shape (n,)
        Diagonal of E [J/K].
    A : csr_array, shape (n, n)
        Linear network [W/K].
    B : csr_array, shape (n, n_u)
        Heaters [W/unit] and ambients [W/K]; the columns of the currents are empty.
    D : csr_array, shape (n, n_w)
        B, constant heats [W], and no more.

    Examples
    --------
    >>> import robthermal as rt
    >>> eq = rt.thermal.Equations(rt.systems.two_module())
    >>> x, u = eq.initial(), eq.nominal()
    >>> bool(abs(eq.heat(x, u)).max() < 1e-9)  # at rest at room temperature
    True
    """

    system: System
    averaged: bool = False
    ripple: tuple[str, ...] = ()

    @cached_property
    def index(self) -> dict[str, int]:
        """Node numbers: lumps first, then ambients."""
        return {name: i for i, name in enumerate((*self.system.lumps, *self.system.ambients))}

    @cached_property
    def drives(self) -> Drives:
        """What heaters and amplifiers make of u."""
        return Drives(self.system, self.ripple)

    @cached_property
    def capacity(self) -> NDArray[np.float64]:
        """Diagonal of E [J/K]."""
        return np.array([lump.capacity for lump in self.system.lumps.values()])

    @cached_property
    def _links(self) -> tuple[Indices, Indices, NDArray[np.float64]]:
        """Rows, columns and values [W/K] of the linear heat into every node from every node."""
        i = self.index
        ends = [(i[link.between[0]], i[link.between[1]], link.conductance) for link in self.system.links]
        ends += [(i[m.hot], i[m.cold], m.conductance.value) for m in self.system.modules.values()]
        a, b, g = (np.array(column) for column in zip(*ends, strict=True)) if ends else (np.zeros(0),) * 3
        a, b = a.astype(np.intp), b.astype(np.intp)
        rows, columns = np.concatenate([a, a, b, b]), np.concatenate([a, b, b, a])
        values = np.concatenate([-g, g, -g, g])
        if not self.system.flows:
            return rows, columns, values
        up, down, coolant = (np.array([i[getattr(flow, end)] for flow in self.system.flows], np.intp)
                             for end in ("upstream", "downstream", "ambient"))
        c = np.array([flow.conductance for flow in self.system.flows])  # what it brings it no longer takes out
        return (np.concatenate([rows, down, down, coolant, coolant]),
                np.concatenate([columns, up, coolant, up, coolant]), np.concatenate([values, c, -c, -c, c]))

    @cached_property
    def carried(self) -> NDArray[np.float64]:
        """Heat that every coolant brings downstream beyond what its conductances say, (n_ambients, n) [W/K]."""
        n, found = len(self.system.lumps), np.zeros((len(self.system.ambients), len(self.system.lumps)))
        for flow in self.system.flows:
            row = self.index[flow.ambient] - n
            found[row, self.index[flow.upstream]] += flow.conductance
            found[row, self.index[flow.downstream]] -= flow.conductance
        return found

    @cached_property
    def _network(self) -> scipy.sparse.csr_array:
        """Linear heat into the lumps from every node, (n, n + n_ambients) [W/K]."""
        rows, columns, values = self._links
        nodes = len(self.index)
        full = scipy.sparse.coo_array((values, (rows, columns)), shape=(nodes, nodes)).tocsr()
        return scipy.sparse.csr_array(full[:len(self.system.lumps)])

    @cached_property
    def dense(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """`A` and `D` as dense arrays: of small systems made in a tenth of the time."""
        n, (rows, columns, values) = len(self.system.lumps), self._links
        network = np.zeros((len(self.index), len(self.index)))
        np.add.at(network, (rows, columns), values)
        to_ambients, D = network[:n, n:], np.zeros((n, self.drives.width))
        D[:, self.drives.ambients] = to_ambients
        for row, column, value in self._driven(to_ambients.sum(axis=1)):
            D[row, column] += value
        return network[:n, :n], D

    @cached_property
    def A(self) -> scipy.sparse.csr_array:
        """Linear network [W/K], (n, n)."""
        return scipy.sparse.csr_array(self._network[:, : len(self.system.lumps)])

    @cached_property
    def B(self) -> scipy.sparse.csr_array:
        """Heat per unit of every heater [W/unit] and ambient [W/K], (n, n_u)."""
        return scipy.sparse.csr_array(self.D[:, : self.drives.n_u])

    @cached_property
    def gradient(self) -> NDArray[np.float64]:
        """By how much every lump sees its ambients warmer than they are [K], (n,)."""
        return np.array([lump.gradient for lump in self.system.lumps.values()])

    @cached_property
    def D(self) -> scipy.sparse.csr_array:
        """Heat per unit of every column of w (`drives`), (n, n_w), without the memory of a hysteresis."""
        n = len(self.system.lumps)
        to_ambients = scipy.sparse.coo_array(self._network[:, n:])
        entries = self._driven(self._network[:, n:].sum(axis=1))
        rows, columns, values = zip(*entries, strict=True) if entries else ((), (), ())
        return scipy.sparse.csr_array(scipy.sparse.coo_array(
            (np.concatenate([np.array(values, float), to_ambients.data]),
             (np.concatenate([np.array(rows, np.intp), to_ambients.row]),
              np.concatenate([np.array(columns, np.intp), to_ambients.col + self.drives.ambients.start]))),
            shape=(n, self.drives.width)))

    def _driven(self, to_ambients: NDArray[np.float64]) -> list[tuple[int, int, float]]:
        """Row, column and value of what heaters and constant heats add to `D`, from all conductances to ambients."""
        i, one = self.index, self.drives.one
        entries = [(i[h.lump], column, h.gain * (1 - (h.feedthrough.share if h.feedthrough else 0.0)))
                   for column, h in enumerate(self.system.inputs.values())]
        entries += [(i[h.feedthrough.lump], column, h.gain * h.feedthrough.share)
                    for column, h in enumerate(self.system.inputs.values()) if h.feedthrough]
        entries += [(i[name], one, lump.heat) for name, lump in self.system.lumps.items() if lump.heat]
        entries += [(i[s.lump], one, s.self_heating) for s in self.system.sensors.values() if s.self_heating]
        warm = to_ambients * self.gradient
        return entries + [(int(k), one, float(warm[k])) for k in np.flatnonzero(warm)]

    @cached_property
    def settled(self) -> scipy.sparse.csr_array:
        """`D` with the memory of every hysteresis at rest at the sign of the present current."""
        if not self.drives.signs:
            return self.D
        found = self.D.tolil()
        for name, column in self.drives.signs.items():
            module = self.system.modules[name]
            found[self.index[module.cold], column] = module.hysteresis.heat if module.hysteresis else 0.0
        return scipy.sparse.csr_array(found)

    @cached_property
    def terms(self) -> tuple[Term, ...]:
        """Nonlinear terms that are present."""
        return terms_of(self.system, self.index, self.drives)

    def nominal(self) -> NDArray[np.float64]:
        """Exogenous vector u with heaters and currents off and ambients at their nominal temperature."""
        off = np.zeros(len(self.system.inputs) + len(self.system.modules))
        return np.concatenate([off, [a.temperature for a in self.system.ambients.values()]])

    def initial(self) -> NDArray[np.float64]:
        """Temperatures at the start [K]: the file's, else the first ambient's."""
        first = next(iter(self.system.ambients.values())).temperature
        return np.array([first if lump.initial is None else lump.initial for lump in self.system.lumps.values()])

    def ends(self, term: Term, x: Array, u: Array) -> tuple[Array, Array, Array]:
        """Temperatures at both ends of every pair of a term, and what drives it.

        Parameters
        ----------
        term : Term
            One of `terms`.
        x, u : ndarray
            As in `heat`.

        Returns
        -------
        tuple of ndarray
            Temperatures at the ends a and b [K], shape (..., n_pairs), and the drives [A or unit]; none for links.
        """
        return self.driven(term, x, self.drives(u))

    def driven(self, term: Term, x: Array, w: Array) -> tuple[Array, Array, Array]:
        """As `ends`, from the columns w of `drives`.

        Parameters
        ----------
        term : Term
            One of `terms`.
        x, w : ndarray
            Temperatures [K] and drives.

        Returns
        -------
        tuple of ndarray
        """
        nodes = np.concatenate([x, w[..., self.drives.ambients]], axis=-1)
        return nodes[..., term.a], nodes[..., term.b], w[..., term.drive]

    def heat(self, x: ArrayLike, u: ArrayLike) -> Array:
        """Net heat into every lump, f(x, u).

        What has a memory is taken at rest: delays and lags are over, a hysteresis remembers the present sign, periodic
        loads are at their mean, 0, and conductance steps have not happened yet.

        Parameters
        ----------
        x : array_like, shape (..., n)
            Temperatures of all lumps [K].
        u : array_like, shape (..., n_u)
            Exogenous values, as in a record [unit, A, K].

        Returns
        -------
        ndarray, shape (..., n)
            [W].
        """
        x, w = np.asarray(x), self.drives(np.asarray(u))
        total = (self.A @ x.T + self.settled @ w.T).T.astype(np.result_type(x, w, float))
        for term in self.terms:
            into_a, into_b = term.heat(*self.driven(term, x, w))
            for nodes, flow in ((term.a, into_a), (term.b, into_b)):
                add_to_lumps(total, nodes, flow)
        return total

    def jacobian(self, x: ArrayLike, u: ArrayLike) -> scipy.sparse.csr_array:
        """∂f/∂x at one point.

        Parameters
        ----------
        x : array_like, shape (n,)
            Temperatures of all lumps [K].
        u : array_like, shape (n_u,)
            Exogenous values: heaters [unit], currents [A], ambients [K].

        Returns
        -------
        csr_array, shape (n, n)
            [W/K].
        """
        x, u = np.asarray(x), np.asarray(u)
        n, parts = len(self.system.lumps), [self.A]
        for term in self.terms:
            s = term.slopes(*self.ends(term, x, u))
            parts.append(_matrix((n, n), (term.a, term.a, s.aa), (term.a, term.b, s.ab), (term.b, term.a, s.ba),
                                 (term.b, term.b, s.bb)))
        return scipy.sparse.csr_array(sum(parts[1:], start=parts[0]))

    def input_jacobian(self, x: ArrayLike, u: ArrayLike) -> scipy.sparse.csr_array:
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
        n, parts = len(self.system.lumps), [self.B]
        to_column = self.drives.ambients.start - n  # from the node of an ambient to its column of u
        for term in self.terms:
            s = term.slopes(*self.ends(term, x, u))
            entries = [(own[other >= n], other[other >= n] + to_column, slope[other >= n])
                       for own, other, slope in ((term.a, term.b, s.ab), (term.b, term.a, s.ba))]
            if term.drive.size:
                entries += [(term.a, term.drive, s.a_drive), (term.b, term.drive, s.b_drive)]
            parts.append(_matrix(self.B.shape, *entries))
        return scipy.sparse.csr_array(sum(parts[1:], start=parts[0]) @ scipy.sparse.diags_array(self.drives.slopes(u)))

    def jacobians(self, x: ArrayLike, u: ArrayLike) -> tuple[Array, Array]:
        """∂f/∂x and ∂f/∂u as dense arrays, at one point or many: for small systems much quicker than the sparse ones.

        Parameters
        ----------
        x, u : array_like, shape (..., n) and (..., n_u)
            As in `heat`.

        Returns
        -------
        tuple of ndarray, shapes (..., n, n) and (..., n, n_u)
            [W/K], [W/unit, W/A, W/K].
        """
        x, u = np.asarray(x), np.asarray(u)
        n = len(self.capacity)
        both = np.tile(self._linear.ravel(), (*x.shape[:-1], 1))
        for term, (kept, into) in zip(self.terms, self._entries, strict=True):
            s = term.slopes(*self.ends(term, x, u))
            slopes = [s.aa, s.ab, s.ba, s.bb, *((s.a_drive, s.b_drive) if term.drive.size else ())]
            place: Any = (..., into)
            np.add.at(both, place, np.concatenate(slopes, axis=-1)[..., kept])
        both = both.reshape(*x.shape[:-1], *self._linear.shape)
        return both[..., :n], both[..., n:] * self.drives.slopes(u)[..., None, :]

    @cached_property
    def _linear(self) -> Array:
        """[A B] as a dense array, (n, n + n_u)."""
        return np.hstack([self.A.toarray(), self.B.toarray()])

    @cached_property
    def _entries(self) -> list[tuple[Indices, Indices]]:
        """For every term: which of its slopes, in the order of `jacobians`, lie in [∂f/∂x ∂f/∂u], and where, flat."""
        n, width = self._linear.shape
        ambient, found = self.drives.ambients.start, []  # a node from n on is an ambient; column n of both is u's first
        for t in self.terms:
            rows = [t.a, t.a, t.b, t.b, *([t.a, t.b] if t.drive.size else [])]
            nodes = [np.where(node < n, node, node + ambient) for node in (t.a, t.b, t.a, t.b)]
            columns = [*nodes, *([t.drive + n, t.drive + n] if t.drive.size else [])]
            row, column = np.concatenate(rows), np.concatenate(columns)
            kept = np.flatnonzero((row < n) & (column < width))
            found.append((kept, row[kept] * width + column[kept]))
        return found

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
        return parameter_heat(self, name, np.asarray(x), np.asarray(u))


def _matrix(shape: tuple[int, ...], *entries: tuple[Indices, Indices, Array]) -> scipy.sparse.csr_array:
    """Sum of entries at (rows, columns), of those inside the shape."""
    rows, columns, values = (np.concatenate([e[k] for e in entries]) for k in range(3))
    keep = (rows < shape[0]) & (columns < shape[1])
    return scipy.sparse.csr_array(scipy.sparse.coo_array((values[keep], (rows[keep], columns[keep])), shape=shape))
