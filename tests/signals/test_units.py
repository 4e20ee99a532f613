"""Celsius and kelvin against decimal arithmetic."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robthermal.signals._units import celsius_to_kelvin, kelvin_to_celsius

ZERO = Decimal("273.15")


@given(st.integers(-(10**12), 10**12), st.integers(0, 12))
def test_short_decimals_convert_as_decimals(digits: int, places: int) -> None:
    decimal = Decimal(digits).scaleb(-places)
    if abs(decimal) < 800:
        assert float(celsius_to_kelvin(float(decimal))) == float(decimal + ZERO)
        assert float(kelvin_to_celsius(float(decimal))) == float(decimal - ZERO)
    else:
        assert float(celsius_to_kelvin(float(decimal))) == pytest.approx(float(decimal + ZERO), rel=1e-15)


@given(st.floats(210.0, 400.0))
def test_round_trip_is_exact(kelvin: float) -> None:
    assert float(celsius_to_kelvin(kelvin_to_celsius(kelvin))) == kelvin


def test_arrays_keep_shape_and_mixed_lengths() -> None:
    kelvin = celsius_to_kelvin(np.array([[20.58, 1 / 3], [-40.0, 25.1]]))
    third = float(Fraction(1 / 3) + Fraction("273.15"))
    np.testing.assert_array_equal(kelvin, [[293.73, third], [233.15, 298.25]])


def test_wild_numbers_pass_through_for_the_checks_to_refuse() -> None:
    assert not np.isfinite(celsius_to_kelvin([np.nan, np.inf, -np.inf])).any()
    assert celsius_to_kelvin(1e300) == 1e300
