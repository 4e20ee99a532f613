"""Transfer matrices as exact polynomials on the imaginary axis, and their stability by the Routh array.

M = N/d with d(s) = det(sI - A), exactly. A discrete system is brought to the same form by z = (1+s)/(1-s): the unit
circle z = exp(jωT) is the axis s = jt with t = tan(ωT/2), and polynomials of formal degree n stay polynomials.
"""

from __future__ import annotations

from dataclasses import dataclass

from flint import arb, arb_poly, fmpq, fmpq_poly, fmpz, fmpz_mat, fmpz_poly

from ._kind import working_precision
from ._lti import LinearSystem, Rows

_MOST_WORK = 1.2e12  # of an exact characteristic polynomial, some 30 s
_BITS = (256, 1024, 4096, 16384)  # of the Routh array, more until every sign is decided


@dataclass(frozen=True)
class Transfer:
    """N/d on the axis s = jt: d and the entries of N, polynomials in s of formal degree ``degree``."""

    degree: int
    denominator: fmpq_poly
    numerators: tuple[tuple[fmpq_poly, ...], ...]


def too_large(system: LinearSystem) -> str:
    """Return why exact polynomials of a system would take too long, n⁴ times its digits; empty where they do not."""
    n, m, p = system.states, system.inputs, system.outputs
    bits = 1
    for matrix, rows, columns in ((system.A, n, n), (system.B, n, m), (system.C, p, n)):
        entries = _integers(matrix, rows, columns)[0].entries()
        bits = max([bits, *(entry.bit_length() for entry in entries)])
    if n**4 * bits**1.25 > _MOST_WORK:
        return f"{n} states with numbers of {bits} bits are too many for exact polynomials"
    return ""


def transfer(system: LinearSystem) -> Transfer:
    """Return the exact transfer matrix on the axis."""
    d, N = _fractions(system)
    n = system.states
    if system.discrete:
        return Transfer(n, _bilinear(d, n), tuple(tuple(_bilinear(entry, n) for entry in row) for row in N))
    return Transfer(n, d, N)


def characteristic(system: LinearSystem, rate: fmpq) -> fmpq_poly:
    """Return a polynomial that is Hurwitz if and only if all modes are stable with ``rate`` to spare.

    Continuous: real parts below -rate. Discrete: absolute values below 1 - rate.
    """
    A, scale = _integers(system.A, system.states, system.states)
    d = _rescaled(A.charpoly(), scale)
    if system.discrete:
        return _bilinear(d(fmpq_poly([0, 1 - rate])), system.states)
    return d(fmpq_poly([-rate, 1]))


def unstable(polynomial: fmpq_poly, degree: int) -> str:
    """Return why a polynomial is not proven to have all its ``degree`` roots in the open left half-plane; "" if so."""
    if polynomial.degree() != degree:
        return "a mode lies on the boundary (discrete: at z = -1)"
    coefficients = polynomial.coeffs()
    leading = coefficients[-1]
    if any(entry / leading <= 0 for entry in coefficients):
        return "a coefficient of the characteristic polynomial is not positive: a mode is not stable"
    for bits in _BITS:
        with working_precision(bits):
            found = _routh([arb(entry / leading) for entry in reversed(coefficients)])
        if found is not None:
            return found
    return f"a mode is too close to the boundary to be decided with {_BITS[-1]} bits"


def _routh(falling: list[arb]) -> str | None:
    """Decide the Routh array of a polynomial: "" all stable, text otherwise, None where a sign is not decided."""
    above, row = falling[0::2], falling[1::2]
    while row:
        pivot = row[0]
        if pivot < 0:
            return "the first column of the Routh array changes sign: a mode is not stable"
        if not pivot > 0:
            return None
        factor = above[0] / pivot
        padded = [*row[1:], *([arb(0)] * (len(above) - len(row)))]
        above, row = row, [upper - factor * lower for upper, lower in zip(above[1:], padded, strict=True)]
    return ""


def parts(polynomial: fmpq_poly) -> tuple[fmpq_poly, fmpq_poly]:
    """Return E and O with polynomial(jt) = E(x) + jt O(x), x = t²."""
    coefficients = polynomial.coeffs()
    flip = fmpq_poly([0, -1])
    return fmpq_poly(coefficients[0::2])(flip), fmpq_poly(coefficients[1::2])(flip)


def squared(polynomial: fmpq_poly) -> fmpq_poly:
    """Return |polynomial(jt)|² as a polynomial in x = t²."""
    even, odd = parts(polynomial)
    return even * even + fmpq_poly([0, 1]) * odd * odd


def place(system: LinearSystem, frequency: fmpq) -> arb | None:
    """Return t on the axis of a frequency [rad/s], None where it is not below the Nyquist frequency for certain."""
    if not system.discrete:
        return arb(frequency)
    angle = arb(frequency * system.sample_time / 2)
    return angle.tan() if 2 * angle < arb.pi() else None


def as_balls(polynomial: fmpq_poly) -> arb_poly:
    """Return a polynomial with balls of the current precision as coefficients."""
    return arb_poly([arb(entry) for entry in polynomial.coeffs()])


def _fractions(system: LinearSystem) -> tuple[fmpq_poly, tuple[tuple[fmpq_poly, ...], ...]]:
    """Return d and N, from Markov parameters: N is the polynomial part of d Σ C A^k B / s^(k+1), plus d D."""
    n, m, p = system.states, system.inputs, system.outputs
    A, a = _integers(system.A, n, n)
    B, b = _integers(system.B, n, m)
    C, c = _integers(system.C, p, n)
    integral = A.charpoly()
    d = _rescaled(integral, a)
    markov = []
    reached = B
    for _ in range(n):
        markov.append((C * reached).tolist())
        reached = A * reached
    gain = fmpq(a, b * c) / fmpq(a) ** n
    rows = []
    for i in range(p):
        row = []
        for j in range(m):
            falling = fmpz_poly([markov[n - 1 - k][i][j] for k in range(n)])
            whole = (integral * falling).coeffs()[n:]
            row.append(fmpq_poly([gain * entry * fmpq(a) ** k for k, entry in enumerate(whole)])
                       + system.D[i][j] * d)
        rows.append(tuple(row))
    return d, tuple(rows)


def _integers(matrix: Rows, rows: int, columns: int) -> tuple[fmpz_mat, fmpz]:
    """Return an integer matrix and the common denominator that belongs to it."""
    scale = fmpz(1)
    for row in matrix:
        for entry in row:
            scale = scale.lcm(entry.q)
    return fmpz_mat(rows, columns, [entry.p * (scale // entry.q) for row in matrix for entry in row]), scale


def _rescaled(integral: fmpz_poly, scale: fmpz) -> fmpq_poly:
    """Return det(sI - A) from that of scale A."""
    n = integral.degree()
    return fmpq_poly([fmpq(entry) / fmpq(scale) ** (n - k) for k, entry in enumerate(integral.coeffs())])


def _bilinear(polynomial: fmpq_poly, degree: int) -> fmpq_poly:
    """Return (1-s)^degree polynomial((1+s)/(1-s)): with w = 1-s, z = 2/w - 1."""
    shifted = polynomial(fmpq_poly([-1, 1])).coeffs()
    falling = [shifted[k] * 2**k if k < len(shifted) else fmpq(0) for k in range(degree, -1, -1)]
    return fmpq_poly(falling)(fmpq_poly([1, -1]))
