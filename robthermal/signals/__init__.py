"""Records of measured or simulated signals: build, read, inspect, save; and excitation signals."""

from ._record import Record as Record

__all__ = ["Record"]
