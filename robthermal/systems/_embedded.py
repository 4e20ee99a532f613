"""Systems shipped as files inside the package."""

from __future__ import annotations

from importlib.resources import files

from ..thermal import System, parse_system


def two_module() -> System:
    """Two-module application setup: 18 lumps, two thermoelectric modules, eleven sensors.

    The network is Evers (2021), appendix 5.A, with the edges and ambient conductances of (5.46)-(5.47) and the diagonal
    derived from them. The thesis prints no module numbers: the modules are the surrogate of `surrogate_module`.

    Returns
    -------
    System

    Examples
    --------
    >>> import robthermal as rt
    >>> system = rt.systems.two_module()
    >>> len(system.lumps), system.module_names
    (18, ('m1', 'm2'))
    """
    return _read("two_module.toml")


def tclab() -> System:
    """Temperature Control Lab board: two heaters that lose heat by convection and radiation, coupled, lagged sensors.

    The values are the published ones and only a start: boards differ. What calibration may change, and why not more,
    is in the file's comments.

    Returns
    -------
    System

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.systems.tclab().input_names
    ('Q1', 'Q2')
    """
    return _read("tclab.toml")


def tclab_two_state() -> System:
    """Temperature Control Lab board, heater 1 alone: heater mass and sensor mass.

    Returns
    -------
    System

    References
    ----------
    A. Dowling and co-workers, repository dowlinglab/pyomo-doe (BSD-3-Clause): structure and values.

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.systems.tclab_two_state().lump_names
    ('heater', 'sensor')
    """
    return _read("tclab_two_state.toml")


def _read(name: str) -> System:
    return parse_system(files(__package__).joinpath(name).read_text(encoding="utf-8"), name)
