"""Kind "frequency": a bound of the frequency response that holds at every frequency, also between the grid points.

The edges in the region cut [0, ∞] rad/s, or [0, π/T], into intervals: there is no gap because there is no way to write
one. Form "norm": σ_max(L_k M R_k⁻¹) < β_k; form "radius": ρ(|M| R_k) < β.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from flint import arb, fmpq

from robthermal.errors import InputError

from . import _frequency_norm, _frequency_radius
from ._blocks import Block, broken_structure, read_blocks, say_blocks
from ._fields import get, mapping, no_other, positive, sequence
from ._frequency_norm import Bound, Failed, Scaling
from ._hash import short_hash
from ._kind import Kind, Proof, working_precision
from ._lti import LinearSystem, Rows, expect_shape, read_linear, read_matrix, say_linear
from ._numbers import decimal, exact, name_of, show
from ._transfer import place, too_large, transfer, unstable

_COMMON = ["form", "edges"]
_MOST_WORK = 5e7  # intervals times states times what one point costs, some minutes
_FORMS = {"norm": [*_COMMON, "bounds", "left", "right", "blocks"], "radius": [*_COMMON, "envelopes", "bound"]}


@dataclass(frozen=True)
class Frequency:
    """The exact problem of one frequency certificate: bounds or envelopes, and the hash of the region."""

    system: LinearSystem
    edges: tuple[fmpq, ...]
    bounds: tuple[Bound, ...]
    blocks: tuple[Block, ...]
    envelopes: tuple[Rows, ...]
    bound: fmpq
    region: str


def read(system: Any, region: Any, evidence: Any, margin: Any) -> Frequency:
    """Return the exact problem, or raise InputError."""
    linear, table = read_linear(system), mapping(region, "region")
    no_other(mapping(evidence, "evidence"), [], "evidence")
    no_other(mapping(margin, "margin"), [], "margin")
    form = get(table, "form", "region")
    if not isinstance(form, str) or form not in _FORMS:
        raise InputError(f"form {name_of(form)}", where="region.form", expected=f"one of {list(_FORMS)}")
    no_other(table, _FORMS[form], "region")
    edges = _edges(get(table, "edges", "region"))
    if form == "radius":
        envelopes = _envelopes(get(table, "envelopes", "region"), len(edges) + 1, linear)
        return Frequency(linear, edges, (), (), envelopes, positive(get(table, "bound", "region"), "region.bound"),
                         short_hash(table))
    values = sequence(get(table, "bounds", "region"), "region.bounds")
    _expect_count(values, len(edges) + 1, "region.bounds")
    left = _scalings(table.get("left"), len(values), linear.outputs, "region.left")
    right = _scalings(table.get("right"), len(values), linear.inputs, "region.right")
    bounds = tuple(Bound(positive(value, f"region.bounds[{k}]"), left[k], right[k]) for k, value in enumerate(values))
    blocks = read_blocks(table["blocks"], linear.inputs, linear.outputs) if "blocks" in table else ()
    return Frequency(linear, edges, bounds, blocks, (), fmpq(0), short_hash(table))


def claim(problem: Frequency, machine: str) -> str:
    """Return the one sentence the data give."""
    system, edges = problem.system, problem.edges
    end = "the Nyquist frequency" if system.discrete else "infinity"
    cover = f"from 0 to {end}" if not edges else f"of {len(edges) + 1} intervals from 0 to {end}"
    start = f"The {say_linear(system, machine)} is stable, and at every frequency {cover}"
    if problem.envelopes:
        return (f"{start} the spectral radius of |M| R stays below {decimal(problem.bound)}: M is its frequency "
                f"response, |.| its entries' absolute values, R the interval's envelope in region {problem.region}.")
    largest = max(range(len(problem.bounds)), key=lambda k: problem.bounds[k].bound)
    top = decimal(problem.bounds[largest].bound)
    low = "0" if largest == 0 else decimal(edges[largest - 1])
    high = end if largest == len(edges) else f"{decimal(edges[largest])} rad/s"
    words = "the largest singular value of its frequency response M"
    if any(item.left or item.right for item in problem.bounds):
        words = ("the largest singular value of L M R^-1, M its frequency response, L and R the scalings of the "
                 f"interval in region {problem.region},")
    limit = f"{top}" if not edges else (f"the bound of the interval in region {problem.region}, the largest of "
                                              f"which is {top}, from {low} to {high}")
    structure = (f"; so does the structured singular value of M for the blocks {say_blocks(problem.blocks)}"
                 if problem.blocks else "")
    return f"{start} {words} stays below {limit}{structure}."


def prove(problem: Frequency) -> Proof:
    """Prove stability, then every interval."""
    linear = problem.system
    why = too_large(linear) or _too_many(problem)
    if why:
        return Proof(False, why)
    with working_precision():
        if any(place(linear, edge) is None for edge in problem.edges):
            return Proof(False, "an edge does not lie below the Nyquist frequency")
        for k, item in enumerate(problem.bounds):
            broken = broken_structure(problem.blocks, item.left, item.right) if problem.blocks else ""
            if broken:
                return Proof(False, f"interval {k}: {broken}")
    system = transfer(linear)
    why = unstable(system.denominator, system.degree)
    if why:
        return Proof(False, f"the system is not proven stable: {why}")

    def edges() -> list[arb]:
        return [t for t in (place(linear, edge) for edge in problem.edges) if t is not None]

    if problem.envelopes:
        failed = _frequency_radius.first_failure(system, problem.envelopes, problem.bound, edges)
    else:
        failed = _frequency_norm.first_failure(system, problem.bounds, edges)
    if failed is None:
        count = len(problem.edges) + 1
        return Proof(True, f"stable, and positive Bernstein coefficients on all {count} intervals")
    return Proof(False, say_failure(linear, problem.edges, failed))


def _too_many(problem: Frequency) -> str:
    """Return why so many intervals and channels would take too long, empty where they do not."""
    s, count = problem.system, len(problem.edges) + 1
    narrow = min(s.inputs, s.outputs)
    if count * (s.states + 1) * (s.states + s.inputs * s.outputs + narrow**3) > _MOST_WORK:
        return (f"{count} intervals of a system with {s.states} states, {s.inputs} inputs and {s.outputs} outputs are "
                "too many to check together")
    return ""


def say_failure(system: LinearSystem, edges: Sequence[fmpq], failed: Failed) -> str:
    """Return the words for an interval that is not proven."""
    low = "0" if failed.interval == 0 else show(edges[failed.interval - 1])
    high = show(edges[failed.interval]) if failed.interval < len(edges) else "the end"
    verdict = "the bound does not hold" if failed.certain else f"the bound cannot be proven ({failed.why})"
    if failed.at is None:
        at = ", at the end of the axis" if failed.certain else ""
    else:
        t = float(failed.at.mid())
        frequency = float((2 * arb(t).atan() / arb(system.sample_time)).mid()) if system.discrete else t
        at = f", near {frequency:.9g} rad/s"
    return f"interval {failed.interval}, from {low} to {high} rad/s: {verdict}{at}"


def find_margin(problem: Frequency) -> dict[str, float]:
    """Return no margin: the bounds are the claim."""
    return {}


def _edges(value: Any) -> tuple[fmpq, ...]:
    found = tuple(positive(item, f"region.edges[{k}]") for k, item in enumerate(sequence(value, "region.edges")))
    for k in range(1, len(found)):
        if found[k] <= found[k - 1]:
            raise InputError(f"{show(found[k])} after {show(found[k - 1])}", where=f"region.edges[{k}]",
                             expected="frequencies that increase [rad/s]")
    return found


def _expect_count(items: Sequence[Any], count: int, where: str) -> None:
    if len(items) != count:
        raise InputError(f"{len(items)} items", where=where, expected=f"{count}, one per interval between the edges")


def _scalings(value: Any, count: int, size: int, where: str) -> list[Scaling | None]:
    if value is None:
        return [None] * count
    items = sequence(value, where)
    _expect_count(items, count, where)
    return [read_scaling(item, size, f"{where}[{k}]") for k, item in enumerate(items)]


def read_scaling(value: Any, size: int, where: str) -> Scaling:
    """Return a square matrix whose entries are numbers or [real, imaginary]."""
    rows = tuple(tuple(_complex(item, f"{where}[{i}][{j}]") for j, item in enumerate(sequence(row, f"{where}[{i}]")))
                 for i, row in enumerate(sequence(value, where)))
    expect_shape(rows, size, size, where)
    return rows


def _complex(value: Any, where: str) -> tuple[fmpq, fmpq]:
    if not isinstance(value, (list, tuple, np.ndarray)):
        return exact(value, where), fmpq(0)
    parts = sequence(value, where)
    if len(parts) != 2:
        raise InputError(f"{len(parts)} numbers", where=where, expected="a number or [real, imaginary]")
    return exact(parts[0], where), exact(parts[1], where)


def _envelopes(value: Any, count: int, system: LinearSystem) -> tuple[Rows, ...]:
    where = "region.envelopes"
    items = sequence(value, where)
    _expect_count(items, count, where)
    found = tuple(read_matrix(item, f"{where}[{k}]") for k, item in enumerate(items))
    for k, matrix in enumerate(found):
        expect_shape(matrix, system.inputs, system.outputs, f"{where}[{k}]")
        if any(entry < 0 for row in matrix for entry in row):
            raise InputError("an entry is negative", where=f"{where}[{k}]", expected="absolute values")
    return found


FREQUENCY = Kind("frequency", read, claim, prove, find_margin)
