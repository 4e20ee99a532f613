"""python-control, imported when a name of it is first used.

It brings scipy.signal and pyplot along, which takes longer than most commands; `from .._control import control` stands
where `import control` would. From then on state spaces can be pickled: its own hold two functions that cannot.
"""

from __future__ import annotations

import copyreg
from typing import TYPE_CHECKING, Any

from ._first_use import OnFirstUse

if TYPE_CHECKING:
    import control as control
else:
    control = OnFirstUse("control", lambda module: copyreg.pickle(module.StateSpace, _reduced))


def _rebuilt(matrices: tuple[Any, ...], dt: float | bool | None, names: dict[str, Any]) -> control.StateSpace:
    return control.StateSpace(*matrices, dt, remove_useless_states=False, **names)


def _reduced(system: control.StateSpace) -> tuple[Any, ...]:
    names = {"name": system.name, "inputs": list(system.input_labels), "outputs": list(system.output_labels),
             "states": list(system.state_labels)}
    return _rebuilt, ((system.A, system.B, system.C, system.D), system.dt, names)
