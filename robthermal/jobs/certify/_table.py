"""Table of a certification for summary.json."""

from __future__ import annotations

from typing import Any

from ..claims import Certification


def certify_table(result: Certification) -> dict[str, Any]:
    """Which parameters the robust claims cover, and how sure the ranges are.

    Parameters
    ----------
    result : Certification
        Certification, as `certify_system` returns it.
    """
    calibrated = result.boxes.parameters == "calibration" and result.parameters is not None
    return {"confidence": result.boxes.confidence if calibrated else None,
            "set": result.boxes.set if calibrated else None,
            "temperature_lower": result.boxes.temperature_lower,
            "parameters": {name: list(pair) for name, pair in (result.parameters or {}).items()}}
