"""A gain between what is attained and what is proven."""

from __future__ import annotations

from dataclasses import dataclass
from math import isnan

from ..verification import Certificate


@dataclass(frozen=True)
class GainBound:
    """Gain of a linear system: a proven upper bound, and a lower bound that is attained.

    Parameters
    ----------
    upper : float
        Proven by the certificate; infinity where nothing is proven [output unit per input unit].
    lower : float
        Largest singular value at ``frequency``, in floats [output unit per input unit].
    frequency : float
        Where that is attained [rad/s]; may be infinity in continuous time; NaN of a system that is not stable.
    certificate : Certificate
        Proof of the upper bound, checked when it was made; `rt.verify` checks it again.

    Examples
    --------
    >>> import control, robthermal as rt
    >>> gain = rt.certify.hinf(control.ss(control.tf([1], [1, 0.2, 1])))
    >>> gain.holds, gain.lower < gain.upper < 1.006 * gain.lower
    (True, True)
    """

    upper: float
    lower: float
    frequency: float
    certificate: Certificate

    @property
    def holds(self) -> bool:
        """Whether the upper bound is proven."""
        return self.certificate.holds

    def __str__(self) -> str:
        attained = ("no gain is attained" if isnan(self.frequency)  # of a system that is not stable
                    else f"attained: {self.lower:.6g} at {self.frequency:.6g} rad/s")
        return f"proven: {self.upper:.6g}, {attained}" if self.holds else f"not proven, {attained}\n{self.certificate}"
