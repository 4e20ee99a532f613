"""What a report says of a certification: contraction limits, runaway limit, the box that is never left."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..._celsius import ZERO_CELSIUS
from ..._pandas import pd
from ...report import Figure, Section, Table, box_ranges, house_style
from ..claims import Certification


def limit_section(result: Certification) -> Section:
    """Contraction limits by method and direction: no limits for use."""
    low, high = result.boxes.temperature
    rows = [{"direction": limit.direction, "method": limit.method, "contraction limit [A]": limit.current,
             "proven": limit.certificate.holds} for limit in result.limits]
    text = ("Contraction limit inside the box; not a limit for use: it holds only while all lumps are between "
            f"{low - ZERO_CELSIUS:.6g} and {high - ZERO_CELSIUS:.6g} °C, and such a current may leave that box.")
    return Section("Contraction limits", text, tables=(Table(pd.DataFrame(rows), "Contraction limits."),),
                   anchor="limits")


def runaway_section(result: Certification) -> Section | None:
    """Load curve of regulated modules."""
    if result.runaway is None:
        return None
    with house_style():
        ax = result.runaway.plot()
        ax.set_title("")
        figure = Figure.draw(ax.figure, alt="Load taken from the cold face against current, with the fold marked.",
                             caption="More current takes more heat only up to the fold.")
    text = ("With its cold face regulated, a module takes more heat with more current only up to I*; a load above q* "
            "has no equilibrium and the hot side runs away. Limit the controller's current below I*, also where "
            "the closed form for constant properties is larger. "
            f"{result.runaway.outcome.text}")
    table = Table(result.runaway.table().reset_index(names="module"), "Runaway limits.")
    return Section("Runaway limit of the regulated machine", text, figures=(figure,), tables=(table,),
                   anchor="runaway")


def box_section(result: Certification) -> Section | None:
    """The box that is never left."""
    box = result.safe.temperature
    if not box:
        return None
    low, high = (np.array([pair[side] for pair in box.values()]) - ZERO_CELSIUS for side in (0, 1))
    figure = Figure.draw(box_ranges(list(box), low, high), alt="Range of every lump temperature in the box.",
                         caption="Range that each lump cannot leave, °C.")
    what = "currents, heats and ambients" if result.system.modules else "heats and ambients"
    text = (f"For the stated {what}, in whatever sequence, no lump leaves its range once all are "
            "inside. The ranges bound what the model can do, also far outside the temperatures at which its parameters "
            "were measured; they are not a prediction of what it will do.")
    return Section("The box that is never left", text, figures=(figure,),
                   tables=(Table(result.safe.table().reset_index(names="lump"), "The box."),), anchor="box")


def certification_sections(result: Certification) -> Iterator[Section]:
    """Sections about one certification, in order."""
    if result.limits:
        yield limit_section(result)
    for section in (runaway_section(result), box_section(result)):
        if section is not None:
            yield section
