"""The zero of the Celsius scale, and what a temperature looks like that was given in the wrong unit."""

from __future__ import annotations

ZERO_CELSIUS = 273.15  # K; plots and messages show T - ZERO_CELSIUS, files are converted exactly by `signals`
LOWEST_KELVIN = 150.0  # a temperature below this, declared kelvin, is Celsius
HIGHEST_CELSIUS = 250.0  # a temperature above this, declared Celsius, is kelvin
ADD_ZERO = f"Add {ZERO_CELSIUS} to degrees Celsius."  # the remedy for Celsius where kelvin is expected
