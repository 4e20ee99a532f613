"""python-control, imported when a name of it is first used.

It brings scipy.signal and pyplot along, which takes longer than most commands; `from .._control import control` stands
where `import control` would. From then on state spaces can be pickled: its own hold two functions that cannot.
"""

from __future__ import annotations

import copyreg
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any


class _OnFirstUse(ModuleType):
    """A module that becomes another one when it is asked for a name."""

    def __getattr__(self, name: str) -> Any:
        module = import_module(self.__name__)
        copyreg.pickle(module.StateSpace, _reduced)
        self.__dict__.update({key: value for key, value in vars(module).items() if not key.startswith("__")})
        return getattr(module, name)


if TYPE_CHECKING:
    import control as control
else:
    control = _OnFirstUse("control")


def _rebuilt(matrices: tuple[Any, ...], dt: float | bool | None, names: dict[str, Any]) -> control.StateSpace:
    return control.StateSpace(*matrices, dt, remove_useless_states=False, **names)


def _reduced(system: control.StateSpace) -> tuple[Any, ...]:
    names = {"name": system.name, "inputs": list(system.input_labels), "outputs": list(system.output_labels),
             "states": list(system.state_labels)}
    return _rebuilt, ((system.A, system.B, system.C, system.D), system.dt, names)
