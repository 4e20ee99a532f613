"""That records differ from each other in the numbers of the machine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Differing:
    """What training records leave by themselves and together, beyond their noise.

    Parameters
    ----------
    alone : float
        Root mean square over all records, each fitted by itself [K].
    together : float
        The same of the common fit, with what it found [K].
    needed : bool
        Whether records by themselves need what was found: without it each leaves more than half of `together`.

    Examples
    --------
    >>> import robthermal as rt
    >>> differing = rt.diagnosis.Differing(0.002, 0.15, needed=True)
    >>> print(differing)
    Numbers of the machine differ from record to record: with what came nearest each by itself leaves 0.002 K beyond \
the noise, all together leave 0.15 K.
    """

    alone: float
    together: float
    needed: bool

    def __str__(self) -> str:
        how = "with what came nearest" if self.needed else "without any effect"
        return (f"Numbers of the machine differ from record to record: {how} each by itself leaves {self.alone:.2g} K "
                f"beyond the noise, all together leave {self.together:.2g} K.")

    def to_dict(self) -> dict[str, Any]:
        """What ``diagnosis.json`` holds under "differing".

        Returns
        -------
        dict
        """
        return dict(vars(self))
