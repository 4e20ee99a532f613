"""Roots of what floating-point numbers say, exactly: polynomials with rational coefficients, roots to the last bit.

An eigenvalue solver places the zeros of a lightly damped stage with eight digits. P⁻¹X divides by them, and near the
Nyquist frequency the plant is so small that the error shows in the control sensitivity of the coupled loop.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from flint import acb, fmpq, fmpq_mat, fmpq_poly

from ..._arrays import Array
from ._zpk import Zpk


def roots_of(polynomial: fmpq_poly) -> Array:
    """Every root, repeated ones as often as they are, as exact conjugate pairs and exact reals.

    Parameters
    ----------
    polynomial : fmpq_poly
        Rational coefficients, not all zero.

    Returns
    -------
    ndarray of complex
    """
    pairs: list[complex] = []
    reals: list[complex] = []
    found: list[tuple[acb, int]] = polynomial.numer().complex_roots()  # type: ignore[assignment]  # stub: no multiplicity
    for root, multiplicity in found:
        value = complex(root)
        if root.imag.is_zero():
            reals += [complex(value.real)] * multiplicity
        elif value.imag > 0:
            pairs += [value] * multiplicity
    return np.array([*pairs, *(root.conjugate() for root in pairs), *reals], dtype=complex)


def from_coefficients(falling: Iterable[float]) -> fmpq_poly:
    """Polynomial of coefficients in falling powers.

    Parameters
    ----------
    falling : iterable of float
        Finite coefficients, highest power first.
    """
    return fmpq_poly([_rational(value) for value in falling][::-1])


def transfer(A: Array, B: Array, C: Array, D: Array) -> tuple[fmpq_poly, fmpq_poly]:
    """Numerator and denominator of one channel: det(λ - A + BC) + (D - 1) det(λ - A), and det(λ - A).

    Parameters
    ----------
    A, B, C, D : ndarray
        (n, n), (n, 1), (1, n), (1, 1), finite.
    """
    exact_A, exact_B, exact_C = (fmpq_mat([[_rational(v) for v in row] for row in matrix]) for matrix in (A, B, C))
    denominator = exact_A.charpoly()
    return (exact_A - exact_B * exact_C).charpoly() + (_rational(D[0, 0]) - 1) * denominator, denominator


def truncated(polynomial: fmpq_poly, degree: int) -> fmpq_poly:
    """Without powers above a degree: those coefficients are rounding.

    Parameters
    ----------
    polynomial : fmpq_poly
        Rational coefficients of a numerator.
    degree : int
        Highest power that is kept.
    """
    return fmpq_poly(polynomial.coeffs()[: degree + 1])


def closed_loop_poles(plant: Zpk, controller: Zpk) -> Array:
    """Roots of 1 + PC.

    Parameters
    ----------
    plant, controller : Zpk
        Proper, 1 + P(∞)C(∞) not zero; poles and zeros that coincide stay poles of the loop.
    """
    zeros = [_product(factor.zeros) * _rational(factor.gain) for factor in (plant, controller)]
    poles = [_product(factor.poles) for factor in (plant, controller)]
    return roots_of(poles[0] * poles[1] + zeros[0] * zeros[1])


def _product(roots: Array) -> fmpq_poly:
    """Monic polynomial with these roots, in exact conjugate pairs."""
    result = fmpq_poly([1])
    for root in roots:
        real, imaginary = _rational(root.real), _rational(root.imag)
        if imaginary > 0:
            result *= fmpq_poly([real * real + imaginary * imaginary, -2 * real, 1])
        elif imaginary == 0:
            result *= fmpq_poly([-real, 1])
    return result


def _rational(value: float) -> fmpq:
    return fmpq(*float(value).as_integer_ratio())
