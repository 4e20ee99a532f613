"""An accepted effect, as an answer has it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ._judge import Name
from .evidence import Evidence


@dataclass(frozen=True)
class Found:
    """An accepted effect.

    Parameters
    ----------
    effect : str
        Name in the catalog.
    where : tuple of str
        Parts of the system it acts on.
    values : dict
        Quantity to (value, standard deviation, unit).
    p_value : float
        Family-wise p-value of its score.
    delta_bic : float
        Against the model without it; above 10 is very strong.
    evidence : Evidence, optional
        Share of the gap, blocks and segments; None for a provisional effect.
    augmented : dict
        Quantity to its value in the augmented system, where something is left: `values` are then those beside what a
        finer network would change, and the augmented system is fitted without that. Empty where both are the same.
    either : dict
        Quantity to another value with which the records are explained as well: a lag that may change places with the
        time constant of its lump. Empty where the records tell.
    """

    effect: str
    where: tuple[str, ...]
    values: dict[str, tuple[float, float, str]]
    p_value: float
    delta_bic: float
    evidence: Evidence | None = None
    augmented: dict[str, float] = field(default_factory=dict)
    either: dict[str, float] = field(default_factory=dict)

    @property
    def key(self) -> Name:
        """Name and place, as in `Diagnosis.alternatives`."""
        return self.effect, self.where

    @property
    def label(self) -> str:
        """For tables: ``sensor_lag(T6)``."""
        return f"{self.effect}({', '.join(self.where)})"

    @property
    def quantities(self) -> str:
        """For tables: ``time_constant = 29.9 ± 0.4 s (or 200 s)``."""
        return ", ".join(f"{name} = {value:.4g} ± {std:.2g} {unit}"
                         + (f" (or {self.either[name]:.3g} {unit})" if name in self.either else "")
                         + (f" ({self.augmented[name]:.4g} {unit} in the augmented system)"
                            if abs(self.augmented.get(name, value) - value) > std else "")
                         for name, (value, std, unit) in self.values.items())

    def to_dict(self) -> dict[str, Any]:
        """What ``diagnosis.json`` holds of an effect.

        Returns
        -------
        dict
        """
        one = self.evidence
        graded = {} if one is None else {"share": one.share, "reproducible": one.reproducible,
                                         "stability": vars(one.stability),
                                         **({"predicted": one.predicted} if one.predicted else {})}
        return {"effect": self.effect, "where": list(self.where), "p_value": self.p_value, "delta_bic": self.delta_bic,
                **graded, **({"augmented": self.augmented} if self.augmented else {}),
                **({"either": self.either} if self.either else {}),
                "parameters": {name: {"value": value, "std": std, "unit": unit}
                               for name, (value, std, unit) in self.values.items()}}
