"""Variants of systems with modules that several packages test."""

from __future__ import annotations

import robthermal as rt


def constant(system: rt.System) -> rt.System:
    """The system with constant Seebeck coefficients and resistances."""
    return system.with_parameters({f"modules.{m}.{p}.slope": 0.0 for m in system.modules
                                   for p in ("seebeck", "resistance")})


def same(system: rt.System, low: float, high: float) -> dict[str, tuple[float, float]]:
    """The same interval of current [A] for all modules."""
    return dict.fromkeys(system.modules, (low, high))
