"""Bounds of the frequency response, interval by interval, proven between the grid points."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import Array
from ..errors import InputError
from ..verification import Certificate, establish
from ._response import largest, read_edges
from ._systems import Plant, made_by, read_plant, scaling


def frequency_norm(system: Any, edges: ArrayLike, bounds: ArrayLike, *, left: Array | None = None,
                   right: Array | None = None, blocks: Any = None) -> Certificate:
    """Certify σ_max(L_k G R_k⁻¹) < β_k at every frequency of interval k, for intervals that leave nothing out.

    Parameters
    ----------
    system : control.StateSpace or control.TransferFunction
        G with p outputs and m inputs; unstable systems are not certified.
    edges : array_like, shape (n_intervals + 1,)
        From 0 to infinity, or to the Nyquist frequency (infinity stands for it too) [rad/s].
    bounds : array_like, shape (n_intervals,) or ()
        Bounds β of the intervals [output unit per input unit].
    left, right : ndarray, shape ([n_intervals,] p, p), ([n_intervals,] m, m), optional
        Regular scalings L, R, real or complex.
    blocks : list, optional
        Blocks ("full", rows, columns) and ("repeated", n) of an uncertainty (m, p): the checker also proves that the
        scalings commute with it, so that the bounds are bounds of the structured singular value.

    Returns
    -------
    Certificate
        Kind "frequency"; where it does not hold the reason names interval and frequency.

    Raises
    ------
    InputError
        Edges with gaps, wrong shapes, numbers that are not finite.

    Examples
    --------
    >>> import control, robthermal as rt
    >>> G = control.ss(control.tf([1], [1, 0.002, 1]))  # peak 500 at 1 rad/s, 0.002 rad/s wide
    >>> rt.certify.frequency_norm(G, [0, 0.9, 1.1, np.inf], [6, 501, 6]).holds
    True
    >>> print(rt.certify.frequency_norm(G, [0, 0.9, 1.1, np.inf], [6, 499, 6]).reason)
    interval 1, from 0.9 to 1.1 rad/s: the bound does not hold, near ...
    """
    plant = read_plant(system)
    places = read_edges(plant, np.asarray(edges, float))
    count = len(places) - 1
    region: dict[str, Any] = {"form": "norm", "edges": places[1:-1], "bounds": _positive(bounds, count)}
    region |= {key: matrix.tolist() for key, matrix in _scalings(plant, left, right, count).items()}
    if blocks is not None:
        region["blocks"] = [list(block) for block in blocks]
    return establish("frequency", system=plant.section, region=region, evidence={}, margin={},
                     made_by=made_by("none", "bounds as given"))


def frequency_radius(system: Any, edges: ArrayLike, envelopes: ArrayLike, bound: float) -> Certificate:
    """Certify ρ(abs(G) R_k) < β at every frequency of interval k: abs entry by entry, R_k an envelope.

    With β = 1, det(I - G Δ) is then not zero for any Δ with abs(Δ) <= R_k entry by entry.

    Parameters
    ----------
    system : control.StateSpace or control.TransferFunction
        G with p outputs and m inputs.
    edges : array_like, shape (n_intervals + 1,)
        As in `frequency_norm` [rad/s].
    envelopes : array_like, shape (n_intervals, m, p) or (m, p)
        R, not negative.
    bound : float
        Bound β to be proven.

    Returns
    -------
    Certificate
        Kind "frequency"; where it does not hold the reason names interval and frequency.

    Raises
    ------
    InputError
        Edges with gaps, wrong shapes, negative envelopes.

    Examples
    --------
    >>> import control, robthermal as rt
    >>> G = control.ss(np.diag([-1, -2]), [[0, 1], [2, 0]], np.eye(2), 0)  # [0, 1/(s + 1); 2/(s + 2), 0]
    >>> R = np.diag([0.5, 0.5])  # ρ is 0.5 √(1 · 1) at frequency zero
    >>> rt.certify.frequency_radius(G, [0, np.inf], R, 0.501).holds
    True
    """
    plant = read_plant(system)
    places = read_edges(plant, np.asarray(edges, float))
    region = {"form": "radius", "edges": places[1:-1], "bound": float(_positive(bound, 1)[0]),
              "envelopes": _envelopes(plant, envelopes, len(places) - 1)}
    return establish("frequency", system=plant.section, region=region, evidence={}, margin={},
                     made_by=made_by("none", "bound as given"))


def interval_norms(system: Any, edges: ArrayLike, *, left: Array | None = None, right: Array | None = None) -> Array:
    """Estimate the largest σ_max(L_k G R_k⁻¹) of every interval: floats, no proof.

    Parameters
    ----------
    system, edges, left, right
        As in `frequency_norm`.

    Returns
    -------
    ndarray, shape (n_intervals,)

    Examples
    --------
    >>> import control
    >>> interval_norms(control.ss(control.tf([1], [1, 0.002, 1])), [0, 0.9, 1.1, np.inf]).round(2).tolist()
    [5.26, 500.0, 4.76]
    """
    plant = read_plant(system)
    places = read_edges(plant, np.asarray(edges, float))
    count = len(places) - 1
    scalings = _scalings(plant, left, right, count, split=False)
    L, inverse = scalings.get("left"), None if right is None else np.linalg.inv(scalings["right"])

    def size(found: Array, which: Array) -> Array:
        found = found if L is None else L[which] @ found
        found = found if inverse is None else found @ inverse[which]
        return np.linalg.norm(found, 2, axis=(1, 2))

    return largest(plant, places, size)[0]


def interval_radii(system: Any, edges: ArrayLike, envelopes: ArrayLike) -> Array:
    """Estimate the largest ρ(abs(G) R_k) of every interval: floats, no proof.

    Parameters
    ----------
    system, edges, envelopes
        As in `frequency_radius`.

    Returns
    -------
    ndarray, shape (n_intervals,)

    Examples
    --------
    >>> import control
    >>> interval_radii(control.ss(control.tf([2], [1, 1])), [0, 1, np.inf], [[[1.0]], [[0.5]]]).round(6).tolist()
    [2.0, 0.707107]
    """
    plant = read_plant(system)
    places = read_edges(plant, np.asarray(edges, float))
    R = _envelopes(plant, envelopes, len(places) - 1)

    def size(found: Array, which: Array) -> Array:
        return np.abs(np.linalg.eigvals(abs(found) @ R[which])).max(axis=1)

    return largest(plant, places, size)[0]


def _scalings(plant: Plant, left: Any, right: Any, count: int, split: bool = True) -> dict[str, Array]:
    found = {}
    for key, value, size in (("left", left, len(plant.C)), ("right", right, plant.B.shape[1])):
        matrix = scaling(value, size, f"argument {key}")
        if matrix is None:
            continue
        if matrix.ndim > 3 or (matrix.ndim == 3 and len(matrix) != count):
            raise InputError(f"shape {matrix.shape}", where=f"argument {key}", expected=f"({count}, {size}, {size})")
        matrix = np.broadcast_to(matrix, (count, size, size))
        if split and np.iscomplexobj(matrix):  # a certificate holds numbers: real and imaginary part
            matrix = np.stack([matrix.real, matrix.imag], axis=-1)
        found[key] = np.array(matrix)
    return found


def _envelopes(plant: Plant, envelopes: ArrayLike, count: int) -> Array:
    found = np.asarray(envelopes, float)
    shape = (count, plant.B.shape[1], len(plant.C))
    if found.shape not in (shape, shape[1:]) or not np.isfinite(found).all() or (found < 0).any():
        raise InputError(f"shape {found.shape}", where="argument envelopes",
                         expected=f"finite numbers, zero or above, shape {shape}")
    return np.broadcast_to(found, shape).copy()


def _positive(values: ArrayLike, count: int) -> Array:
    found = np.asarray(values, float)
    if found.shape not in ((), (count,)) or not np.isfinite(found).all() or (found <= 0).any():
        raise InputError(f"shape {found.shape}", where="argument bounds",
                         expected=f"positive numbers, one or {count}")
    return np.broadcast_to(found, (count,)).copy()
