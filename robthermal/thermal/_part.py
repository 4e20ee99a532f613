"""What all parts of a system have in common: immutable, strict numbers, no unknown keys."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from .._celsius import LOWEST_KELVIN

Finite = Annotated[float, Field(allow_inf_nan=False, strict=True)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False, strict=True)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False, strict=True)]
Share = Annotated[float, Field(ge=-1, le=1, allow_inf_nan=False, strict=True)]
Exponent = Annotated[float, Field(ge=-10, le=10, allow_inf_nan=False, strict=True)]
Kelvin = Annotated[float, Field(ge=LOWEST_KELVIN, allow_inf_nan=False, strict=True)]
Name = Annotated[str, Field(min_length=1, max_length=200)]
Range = tuple[Finite, Finite]


class Part(BaseModel):
    """Immutable; unknown keys are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid")


def ordered(value: Range | None) -> Range | None:
    """Refuse a range whose ends are not in order."""
    if value is not None and not value[0] < value[1]:
        raise ValueError("must be [lower, upper] with lower < upper")
    return value
