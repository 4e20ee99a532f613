"""Commands of a record: its inputs but for recorded ambients, which are readings."""

from __future__ import annotations

import numpy as np

from ...signals import Record
from ...thermal import System


def commands(system: System, record: Record) -> list[str]:
    """Inputs of a record that are no ambients of the system, in the order of the record.

    Parameters
    ----------
    system : System
        Model with the ambients.
    record : Record
        Rows with heaters, currents and ambients.
    """
    return [name for name in record.input_names if name not in system.ambients]


def moves(system: System, record: Record) -> bool:
    """Whether any command changes within a record.

    Parameters
    ----------
    system : System
        Model with the ambients.
    record : Record
        Rows with heaters, currents and ambients.
    """
    return any(np.ptp(record[name]) > 0.0 for name in commands(system, record))
