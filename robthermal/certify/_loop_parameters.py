"""Which ranges of parameters a certificate of a sampled loop or an observer covers; others are refused by name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal

from ..errors import InputError
from ..thermal import System
from ._sections import Interval, parameter_box

Plant = Literal["continuous", "held"]


def check_loop_parameters(system: System, parameters: Mapping[str, Interval] | None,
                          plant: Plant = "continuous", *, observer: bool = False) -> None:
    """Refuse, by name, ranges of parameters that no certificate of a sampled loop covers.

    Parameters
    ----------
    system : System
        Plant of the loop.
    parameters : mapping or None
        {parameter name: (lower, upper)}, for example of `Fit.ranges`; those that no loop depends on pass.
    plant : {"continuous", "held"}
        Plant of the claim, as in `loop`.
    observer : bool
        Whether the linearizing feedback law and the controller read estimates.

    Raises
    ------
    InputError
        A number of a module, a capacity, natural convection or radiation; any conductance with an observer or the
        sampled model.

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.certify.check_loop_parameters(rt.systems.two_module(), {"lumps.x1.capacity": (35.0, 45.0)})
    Traceback (most recent call last):
    ...
    robthermal.errors.InputError: argument parameters: 'lumps.x1.capacity' cannot be uncertain in a loop. ...
    """
    box = parameter_box(system, parameters or {})
    for name in box:
        if name.startswith("links.") and name.endswith(".conductance"):
            continue
        why = ": the feedback law is made of the module's own numbers" if name.startswith("modules.") else ""
        raise InputError(f"{name!r} cannot be uncertain in a loop{why}", where="argument parameters",
                         expected="conductances of links",
                         remedy="Leave it out here. With its range rt.certify.runaway_free and usable_current claim "
                                "that a box is not left, and contracts, whatever the currents within the limits do; "
                                "rt.certify.regulated that the rest contracts while the cold faces are held.")
    if box and (observer or plant == "held"):
        what = "with an observer" if observer else "in the sampled model"
        raise InputError(f"{next(iter(box))!r} cannot be uncertain {what}", where="argument parameters",
                         expected="no observer, and the continuous plant",
                         remedy="Certify the loop at the true temperatures and rt.certify.observer with its range.")


def refuse_uncertain_sensors(system: System, names: Sequence[str], parameters: Mapping[str, Interval]) -> None:
    """Refuse ranges of what an observer's sensors do to a difference of temperatures; an offset does nothing to it."""
    for key in parameters:
        table, _, rest = key.partition(".")
        name, _, field = rest.rpartition(".")
        if table == "sensors" and name in names and field != "offset" and key in system.parameter_names:
            raise InputError(f"a range of {key} cannot be covered: the observer reads this sensor",
                             where=f"argument parameters[{key!r}]", expected="sensors known but for their offset",
                             remedy="Calibrate the sensor, then leave it out of `parameters`.")
