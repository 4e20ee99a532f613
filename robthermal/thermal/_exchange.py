"""Modules seen from the other side: hot and cold exchanged, the current reversed."""

from __future__ import annotations

from collections.abc import Iterable

from ..errors import InputError
from ._parts import Drive, Module
from ._system import System


def exchange_faces(system: System, modules: Iterable[str] | str | None = None) -> System:
    """The same machine with the faces of modules exchanged and their currents counted the other way.

    A module does not know which of its faces is called hot: with I' = -I and the faces exchanged every heat is the
    same. What the package does for cold faces (feedback linearization, regulation, certificates) it then does for the
    hot ones, Evers 5.5.1, "a similar approach could be used to linearize towards x_h".

    Parameters
    ----------
    system : System
        The machine. Records that belong to it have the other sign in the columns of these modules.
    modules : str or iterable of str, optional
        Modules to exchange; default all.

    Returns
    -------
    System
        Current limits (low, high) become (-high, -low), an unequal split of the Joule heat changes its sign.

    Raises
    ------
    InputError
        Unknown modules; an amplifier, a supply, a hysteresis or a voltmeter that knows the sign of the current.

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> system = rt.systems.two_module()
    >>> other = rt.thermal.exchange_faces(system, "m1")
    >>> other.modules["m1"].hot == system.modules["m1"].cold
    True
    >>> x = np.linspace(280.0, 320.0, 18)
    >>> a, b = rt.thermal.Equations(system), rt.thermal.Equations(other)
    >>> bool(np.allclose(a.heat(x, [2.0, 1.0, 298.15]), b.heat(x, [-2.0, 1.0, 298.15])))
    True
    """
    chosen = set(system.modules if modules is None else [modules] if isinstance(modules, str) else modules)
    unknown = sorted(chosen - set(system.modules))
    if unknown:
        raise InputError(f"there is no module {unknown[0]!r}", where="argument modules",
                         expected="some of " + (", ".join(system.modules) or "(the system has none)"))
    for name in sorted(chosen):
        _refuse(system, name)
    return system.model_copy(update={"modules": {name: _exchanged(module) if name in chosen else module
                                                 for name, module in system.modules.items()}})


def _refuse(system: System, name: str) -> None:
    module = system.modules[name]
    volts = [sensor for sensor, one in system.sensors.items() if one.module == name]
    signed = {"a drive of its own": module.drive != Drive(), "a supply": module.supply is not None,
              "a hysteresis": module.hysteresis is not None, f"the voltmeter {' '.join(volts)!r}": bool(volts)}
    for what, there in signed.items():
        if there:
            raise InputError(f"module {name!r} has {what}, which knows the sign of its current",
                             where="argument modules", expected="modules without it",
                             remedy="Leave it out of the system for this purpose.")


def _exchanged(module: Module) -> Module:
    limits = module.current_limits
    return module.model_copy(update={
        "hot": module.cold, "cold": module.hot, "joule_split": -module.joule_split,
        "current_limits": None if limits is None else (-limits[1], -limits[0])})
