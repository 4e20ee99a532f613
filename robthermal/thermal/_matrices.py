"""A system from sparse matrices E ẋ = A x + B u, for example of a finite-element export."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from .._checks import positive_number
from ..errors import InputError, Outcome
from ._checks import kelvin
from ._outcomes import ThermalCode
from ._parts import Ambient, Input, Link, Lump, Sensor
from ._system import System

_ROUNDING = 1e-12  # of the largest entry of A: below it an entry is taken as zero
_SYMMETRY = 1e-8
_SHOWN = 5
_ROOM: Mapping[str, float] = MappingProxyType({"room": 298.15})


@dataclass(frozen=True)
class MatrixImport:
    """A system built from matrices, and what rounding was removed on the way.

    Parameters
    ----------
    system : System
        Its diagonal is derived from the links: no heat is made of rounding.
    residual : ndarray, shape (n,)
        Row sums of A (plus the ambient columns of B) that were removed [W/K].
    false_heat : float
        Heat that they would have made at the temperature of the first ambient, absolute values summed [W].
    lumped : bool
        Whether the mass matrix was lumped by row sums.
    outcome : Outcome
        Whether the matrices closed to 1e-9 of their diagonal.
    """

    system: System
    residual: NDArray[np.float64]
    false_heat: float
    lumped: bool
    outcome: Outcome

    def __str__(self) -> str:
        s = self.system
        head = (f"{s.name}: {len(s.lumps)} lumps, {len(s.links)} links, {len(s.inputs)} heaters, "
                f"{len(s.ambients)} ambients")
        return "\n".join([head, *(["mass matrix lumped by row sums"] if self.lumped else []), self.outcome.text])


def system_from_matrices(E: Any, A: Any, B: Any = None, *, ambients: Mapping[str, float] = _ROOM,
                         inputs: Sequence[str] = (), lump_names: Sequence[str] | None = None,
                         sensors: Mapping[str, Sensor | Mapping[str, Any]] | None = None, name: str = "network",
                         lump_mass: bool = False, tolerance: float = 1e-6) -> MatrixImport:
    """Build a system from E ẋ = A x + B u.

    Every off-diagonal entry of the symmetric A is a link. What a row of A lacks to zero is its conductance to the
    ambient; if B has ambient columns, they are. The diagonal is derived from the links, because the rounding of a
    printed diagonal acts, in kelvin, as a heat source.

    Parameters
    ----------
    E : array_like or sparse
        Heat capacities, vector or diagonal matrix [J/K].
    A : array_like or sparse
        Symmetric, off-diagonal entries not negative [W/K].
    B : array_like or sparse, optional
        Columns of the heaters [W/unit], in the order of `inputs`; then, optionally, of the ambients [W/K].
    ambients : mapping of str to float
        Name to temperature [K].
    inputs : sequence of str
        Names of the heaters. One heater heats one lump.
    lump_names : sequence of str, optional
        Default n1, n2, …
    sensors : mapping, optional
        As in `System`.
    name : str
        Name of the system, as reports show it.
    lump_mass : bool
        Replace a consistent (non-diagonal) mass matrix by its row sums; the heat stored by a uniform temperature stays.
    tolerance : float
        Row sums below this part of the diagonal are rounding [-]. For matrices printed with four digits use 1e-3 and
        ambient columns in B.

    Returns
    -------
    MatrixImport

    Raises
    ------
    InputError
        Not symmetric, negative conductances, a mass matrix that is not diagonal, rows that do not close, wrong shapes.

    Examples
    --------
    >>> import robthermal as rt
    >>> made = rt.thermal.system_from_matrices([10.0, 20.0], [[-3.0, 1.0], [1.0, -1.0]], [[1.0], [0.0]], inputs=["Q"])
    >>> print(made)
    network: 2 lumps, 2 links, 1 heaters, 1 ambients
    The rows close to rounding.
    >>> [link.name for link in made.system.links]
    ['n1-n2', 'n1-room']
    """
    capacity, lumped = _capacity(E, lump_mass)
    n = capacity.size
    network = _network(A, n)
    heaters, to_ambient = _columns(B, n, tuple(inputs), tuple(ambients))
    allowed = positive_number(tolerance, "tolerance", "-")
    links_to_ambient, residual = _close(network, to_ambient, len(ambients), allowed)
    names = _names(lump_names, n)
    system = System(
        name=name, ambients={k: Ambient(temperature=kelvin(T, f"ambients[{k!r}]")) for k, T in ambients.items()},
        lumps={one: Lump(capacity=c) for one, c in zip(names, capacity.tolist(), strict=True)},
        links=_links(network, links_to_ambient, names, tuple(ambients)),
        inputs={k: Input(lump=names[i], gain=g) for k, (i, g) in heaters.items()}, sensors=dict(sensors or {}))
    heat = float(np.abs(residual).sum() * next(iter(system.ambients.values())).temperature)
    return MatrixImport(system, residual, heat, lumped, _outcome(network, residual, heat, names))


def _sparse(values: Any, where: str) -> scipy.sparse.csr_array:
    try:
        matrix = scipy.sparse.csr_array(values if scipy.sparse.issparse(values) else np.asarray(values, float))
    except (TypeError, ValueError) as error:
        raise InputError(f"is not a matrix ({error})", where=where,
                         remedy="Pass a sparse matrix or an array.") from None
    if matrix.ndim != 2 or matrix.dtype.kind not in "iuf":
        raise InputError(f"has {matrix.ndim} dimensions and type {matrix.dtype}", where=where,
                         expected="a real matrix", remedy="Pass numbers in two dimensions.")
    matrix = matrix.astype(np.float64)
    matrix.sum_duplicates()
    if not np.isfinite(matrix.data).all():
        raise InputError("holds NaN or infinite entries", where=where, remedy="Check the export.")
    return matrix


def _capacity(E: Any, lump_mass: bool) -> tuple[NDArray[np.float64], bool]:
    if not scipy.sparse.issparse(E) and np.ndim(E) == 1:
        E = scipy.sparse.diags_array(np.asarray(E, float))
    matrix = _sparse(E, "argument E")
    n = matrix.shape[0]
    if matrix.shape != (n, n) or not n:
        raise InputError(f"has the shape {matrix.shape}", where="argument E", expected="(n, n) or (n,)",
                         remedy="Pass the heat capacities.")
    values = matrix.diagonal()
    lumped = bool((matrix - scipy.sparse.diags_array(values)).count_nonzero())
    if lumped and not lump_mass:
        raise InputError("is not diagonal: a consistent mass matrix", where="argument E", expected="a lumped mass "
                         "matrix", remedy="Pass lump_mass=True to lump it by row sums, or export a lumped one.")
    if lumped:
        values = np.asarray(matrix.sum(axis=1)).ravel()
    bad = np.flatnonzero(values <= 0)
    if bad.size:
        raise InputError(f"{_rows(bad)} have no positive heat capacity", where="argument E", expected="J/K above 0",
                         remedy="Eliminate massless nodes first (static condensation), or give them a small capacity; "
                         "row sums of quadratic elements can be negative: export linear ones.")
    return values, lumped


def _network(A: Any, n: int) -> scipy.sparse.csr_array:
    """The matrix A, checked and exactly symmetric; its diagonal is still the given one."""
    matrix = _sparse(A, "argument A")
    if matrix.shape != (n, n):
        raise InputError(f"has the shape {matrix.shape}", where="argument A", expected=f"({n}, {n}) as E",
                         remedy="Pass the matrices of one model.")
    largest = float(np.abs(matrix.data).max(initial=0.0))
    if n > 1 and (matrix.diagonal() > _ROUNDING * largest).any() and not (matrix.diagonal() < 0).any():
        raise InputError("has a positive diagonal: it looks like the conduction matrix K of E ẋ = -K x",
                         where="argument A", remedy="Pass -K.")
    gap = abs(matrix - matrix.T).tocoo()
    skew = gap.row[gap.data > _SYMMETRY * largest]
    if skew.size:
        raise InputError(f"is not symmetric in {_rows(np.unique(skew))}: conduction is", where="argument A",
                         remedy="Heat carried by a flow is outside of System; certify such a network directly with "
                         "rt.certify.network(E, A).")
    matrix = (0.5 * (matrix + matrix.T)).tocoo()
    negative = (matrix.row != matrix.col) & (matrix.data < -_ROUNDING * largest)
    if negative.any():
        raise InputError(f"has negative conductances in {_rows(np.unique(matrix.row[negative]))} (down to "
                         f"{matrix.data[negative].min():.3g} W/K): heat would flow from cold to hot between these "
                         "nodes", where="argument A", remedy="Obtuse or flat elements do that: refine the mesh, use a "
                         "Delaunay mesh or finite volumes, or condense the model.")
    small = (matrix.row != matrix.col) & (matrix.data <= _ROUNDING * largest)
    matrix.data[small] = 0.0
    matrix = matrix.tocsr()
    matrix.eliminate_zeros()
    return matrix


def _columns(B: Any, n: int, inputs: tuple[str, ...],
             ambients: tuple[str, ...]) -> tuple[dict[str, tuple[int, float]], NDArray[np.float64] | None]:
    """Heaters (lump and gain), and the ambient columns if there are any."""
    if not ambients:
        raise InputError("there is no ambient", where="argument ambients", remedy='Pass for example {"room": 298.15}.')
    if B is not None and not scipy.sparse.issparse(B) and np.ndim(B) == 1:
        B = np.reshape(B, (-1, 1))
    matrix = scipy.sparse.csr_array((n, 0)) if B is None else _sparse(B, "argument B")
    wide = len(inputs) + len(ambients)
    if matrix.shape[0] != n or matrix.shape[1] not in (len(inputs), wide):
        raise InputError(f"has the shape {matrix.shape}", where="argument B", expected=f"({n}, {len(inputs)}), the "
                         f"heaters, or ({n}, {wide}), heaters and ambients", remedy="Name every heater in inputs.")
    if matrix.shape[1] < wide and len(ambients) > 1:
        raise InputError(f"{len(ambients)} ambients without columns in B", where="argument ambients", expected="one",
                         remedy="Append a column for each ambient to B: which lump touches which cannot be guessed.")
    columns = matrix.tocsc()
    heaters = {one: _heater(columns[:, [j]], one) for j, one in enumerate(inputs)}
    if matrix.shape[1] < wide:
        return heaters, None
    to_ambient = columns[:, len(inputs):].toarray()
    negative = np.flatnonzero((to_ambient < 0).any(axis=1))
    if negative.size:
        raise InputError(f"ambient columns are negative in {_rows(negative)}", where="argument B",
                         expected="conductances [W/K]", remedy="Check the sign and the column order.")
    return heaters, to_ambient


def _heater(column: Any, name: str) -> tuple[int, float]:
    column = column.tocoo()
    heated = column.row[column.data != 0]
    if heated.size != 1:
        raise InputError(f"column {name!r} heats {heated.size} lumps", where="argument B", expected="one",
                         remedy="Join the heated lumps in one lump (a heater plate), or give each its own column.")
    return int(heated[0]), float(column.data[column.data != 0][0])


def _close(network: scipy.sparse.csr_array, to_ambient: NDArray[np.float64] | None, n_ambients: int,
           tolerance: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Conductances to the ambients (n, n_ambients), and the row sums taken as rounding (n,)."""
    sums, diagonal = np.asarray(network.sum(axis=1)).ravel(), network.diagonal()
    scale = np.maximum(np.abs(diagonal), sums - diagonal)  # a diagonal that was left out is no reason to divide by 0
    if to_ambient is not None:
        residual = sums + to_ambient.sum(axis=1)
        scale = np.maximum(scale, to_ambient.max(axis=1))
        _refuse(np.flatnonzero(np.abs(residual) > tolerance * scale), residual, scale,
                "do not close with the ambient columns")
        return to_ambient, residual
    _refuse(np.flatnonzero(sums > tolerance * scale), sums, scale, "sum to more than zero")
    residual = np.where(np.abs(sums) <= tolerance * scale, sums, 0.0)
    return np.where(residual == sums, 0.0, -sums).reshape(-1, n_ambients), residual


def _refuse(bad: NDArray[np.intp], residual: NDArray[np.float64], scale: NDArray[np.float64], what: str) -> None:
    if bad.size:
        part = float(np.max(np.abs(residual[bad]) / scale[bad]))
        raise InputError(f"{_rows(bad)} {what} (by up to {np.abs(residual[bad]).max():.3g} W/K, {part:.2g} of the "
                         "diagonal)", where="argument A", remedy="They would make heat of nothing. If this is the "
                         f"rounding of printed digits, pass tolerance={2 * part:.1g} and the ambient columns in B.")


def _links(network: scipy.sparse.csr_array, to_ambient: NDArray[np.float64], names: Sequence[str],
           ambients: Sequence[str]) -> list[Link]:
    upper = network.tocoo()
    above = upper.row < upper.col
    inside = [Link(between=(names[i], names[j]), conductance=g) for i, j, g in
              zip(upper.row[above].tolist(), upper.col[above].tolist(), upper.data[above].tolist(), strict=True)]
    rows, columns = np.nonzero(to_ambient)
    return inside + [Link(between=(names[i], ambients[k]), conductance=float(to_ambient[i, k]))
                     for i, k in zip(rows.tolist(), columns.tolist(), strict=True)]


def _names(lump_names: Sequence[str] | None, n: int) -> list[str]:
    names = [f"n{i + 1}" for i in range(n)] if lump_names is None else list(lump_names)
    if len(names) != n or len(set(names)) != n:
        raise InputError(f"{len(names)} names, {len(set(names))} of them different", where="argument lump_names",
                         expected=f"{n} different names", remedy="Name every lump once.")
    return names


def _outcome(network: scipy.sparse.csr_array, residual: NDArray[np.float64], heat: float,
             names: Sequence[str]) -> Outcome:
    worst = int(np.argmax(np.abs(residual)))
    if np.abs(residual).max() <= 1e-9 * np.abs(network.diagonal()).max():
        return ThermalCode.CLOSED.outcome()
    return ThermalCode.ROUNDED.outcome(
        f"Row sums up to {abs(residual[worst]):.2g} W/K (lump {names[worst]}) were taken as rounding and removed; left "
        f"in, they would have made {heat:.3g} W of false heat.")


def _rows(rows: NDArray[np.intp]) -> str:
    shown = ", ".join(str(row + 1) for row in rows[:_SHOWN].tolist())
    return f"rows {shown}" + (f" and {rows.size - _SHOWN} more" if rows.size > _SHOWN else "")
