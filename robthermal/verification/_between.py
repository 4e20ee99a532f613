"""What happens between two samples: the passive network sampled exactly, and how far the held heat is from the true.

dx(T) = A_d dx + Γ φ + Σ_j ∫ g_j(s) d_j(s) ds, with φ the change of the heats into the ports (faces of modules, ends of
links that are not linear) at the start of the sample, d_j their further change while the temperatures move, and g_j the
response of the network to heat at port j. d is bounded in the mean square over the sample (proof note, loops).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from flint import arb, arb_mat, fmpq

from ._definite import approximate, is_positive_preconditioned
from ._numbers import name_of, show
from ._system import ThermalSystem
from ._vertices import Entries

_LONGEST = 60  # |E^-1 A| T_s beyond which the exponentials lose too many digits


@dataclass(frozen=True)
class Sampled:
    """Balls around F = E^-1 A of the passive network, exp(F T_s) and Γ = ∫ exp(F s) ds E^-1."""

    F: arb_mat
    passive: arb_mat
    hold: arb_mat


@dataclass(frozen=True)
class Bounds:
    """|J| and its change over a sample, (p, p); what free currents of the modules add, (p, 4 m)."""

    size: list[list[fmpq]]
    state: list[list[arb]]
    free: list[list[arb]]


@dataclass(frozen=True)
class Deviation:
    """Matrices of the bound: the scatter X of what d does, the Gram matrix of how far the ports move."""

    scatter: arb_mat
    moved: arb_mat


def sample(system: ThermalSystem, links: Entries, sample_time: fmpq) -> Sampled | str:
    """Return the sampled passive network (modules at their reference conductance), or why there is none."""
    n = len(system.lumps)
    entries = dict(links)
    for module in system.modules:
        h, c, K = module.hot, module.cold, module.conductance[0]
        if K < 0:
            return f"the conductance of module {name_of(module.name)} at its reference temperature is negative"
        for place, value in (((h, h), -K), ((c, c), -K), ((h, c), K), ((c, h), K)):
            entries[place] = entries.get(place, fmpq(0)) + value
    rows: list[list[arb]] = [[arb(0)] * n for _ in range(n)]
    largest = fmpq(0)
    for (i, j), value in entries.items():
        rows[i][j] = arb(value / system.capacity[i])
        largest = max(largest, abs(value / system.capacity[i]))
    if largest * sample_time > _LONGEST:
        return f"sample time {show(sample_time)} s: too long to enclose the sampled network"
    inverse = [[arb(0)] * n for _ in range(n)]
    for i, capacity in enumerate(system.capacity):
        inverse[i][i] = arb(1 / capacity)
    F, zero = arb_mat(rows), arb_mat(n, n)
    both = (blocks([[F, arb_mat(inverse)], [zero, zero]]) * arb(sample_time)).exp()
    return Sampled(F, part(both, 0, 0, n, n), part(both, 0, n, n, n))


def deviation(sampled: Sampled, ports: Sequence[int], capacity: Sequence[fmpq], sample_time: fmpq, bounds: Bounds,
              weights: Sequence[fmpq], sizes: Sequence[fmpq]) -> Deviation | str:
    """Check the multipliers and return the matrices of the bound.

    With D_j = |d_j|, Y_k = |x_k(s) - x_k(0)| (norms over the sample, k a port) and |.| taken entrywise,
    D <= size (Y0 + G D) + sqrt(T) (state |dx| + free |u|), G = Γ at the ports (entries of exp(F s) are not negative),
    u the four numbers that bound |dI| of every module whose current is free, zero for the others. ``weights`` l and
    ``sizes`` w must give Σ l_j D_j² <= Σ w_o q_o² for q = (Y0, sqrt(T) |dx|, sqrt(T) |u|).
    """
    n, count = len(capacity), len(ports)
    if any(value <= 0 for value in (*weights, *sizes)):
        return "a multiplier of the deviation is not positive"
    size = _dense(bounds.size)
    loop = size * arb_mat([[sampled.hold[i, j] for j in ports] for i in ports])
    for row in loop.tolist():
        if not sum(row, arb(0)) < 1:
            return "the sample is too long: the heat of the modules changes too much within it to be bounded"
    answer = (arb_mat(count, count, 1) - loop).solve(
        arb_mat([[*a, *b, *c] for a, b, c in zip(size.tolist(), bounds.state, bounds.free, strict=True)]))
    scaled = arb_mat([[arb(w) * entry for entry in row] for w, row in zip(weights, answer.tolist(), strict=True)])
    rest = diagonal([arb(value) for value in sizes]) - answer.transpose() * scaled
    if not is_positive_preconditioned(rest, approximate(rest)):
        return "the multipliers do not bound how far the heat is from the held one"
    time = arb(sample_time)
    inputs, outputs = [arb(0)] * n, [arb(0)] * n
    for j, port in enumerate(ports):
        inputs[port] = 1 / (arb(weights[j]) * arb(capacity[port]) ** 2)
        outputs[port] = arb(sizes[j])
    scatter = _gramian(sampled.F.transpose(), diagonal(inputs), time)
    zero = arb_mat(n, n)
    moving = blocks([[sampled.F, arb_mat(n, n, 1)], [zero, zero]])
    gram = _gramian(moving, blocks([[diagonal(outputs), zero], [zero, zero]]), time)
    return Deviation(scatter, part(gram, n, n, n, n))


def _gramian(A: arb_mat, Q: arb_mat, time: arb) -> arb_mat:
    """Return ∫_0^T exp(A's) Q exp(A s) ds (Van Loan 1978)."""
    n = A.nrows()
    both = (blocks([[-A.transpose(), Q], [arb_mat(n, n), A]]) * time).exp()
    return part(both, n, n, n, n).transpose() * part(both, 0, n, n, n)


def blocks(rows: Sequence[Sequence[arb_mat]]) -> arb_mat:
    """Return a matrix from its blocks."""
    return arb_mat([[entry for line in lines for entry in line]
                    for row in rows for lines in zip(*(block.tolist() for block in row), strict=True)])


def part(matrix: arb_mat, first: int, left: int, rows: int, columns: int) -> arb_mat:
    """Return a block of a matrix."""
    return arb_mat([[matrix[i, j] for j in range(left, left + columns)] for i in range(first, first + rows)])


def diagonal(values: Sequence[arb]) -> arb_mat:
    """Return a diagonal matrix."""
    return arb_mat([[value if i == j else arb(0) for j in range(len(values))] for i, value in enumerate(values)])


def _dense(rows: Sequence[Sequence[fmpq]]) -> arb_mat:
    return arb_mat([[arb(value) for value in row] for row in rows])
