"""State spaces of python-control can be pickled: its own hold two functions that cannot.

Imported for its effect by every package whose results hold a state space.
"""

from __future__ import annotations

import copyreg
from typing import Any

import control


def _rebuilt(matrices: tuple[Any, ...], dt: float | bool | None, names: dict[str, Any]) -> control.StateSpace:
    return control.StateSpace(*matrices, dt, remove_useless_states=False, **names)


def _reduced(system: control.StateSpace) -> tuple[Any, ...]:
    names = {"name": system.name, "inputs": list(system.input_labels), "outputs": list(system.output_labels),
             "states": list(system.state_labels)}
    return _rebuilt, ((system.A, system.B, system.C, system.D), system.dt, names)


copyreg.pickle(control.StateSpace, _reduced)
