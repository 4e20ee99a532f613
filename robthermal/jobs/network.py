"""The drawing of the machine in a report."""

from __future__ import annotations

from ..report import Figure, Section, house_style
from ..thermal import System

NETWORK = "network"  # address of the section
_LARGEST = 60  # lumps and ambients; more cannot be read on a page


def network_section(system: System) -> Section:
    """The network of a system, drawn; of a large one the number of its parts."""
    parts = f"{len(system.lumps)} lumps and {len(system.ambients)} ambients"
    text = ("The network that all numbers of this report are about. A lump is a mass whose temperature is taken to be "
            "the same everywhere.")
    if len(system.lumps) + len(system.ambients) > _LARGEST:
        return Section("The machine as modeled", f"{text} It has {parts}, too many to draw.", anchor=NETWORK)
    with house_style():
        drawn = system.plot().figure
    joined = [f"{' to '.join(link.between)}" for link in system.links]
    joined += [f"module {name} from {module.cold} to {module.hot}" for name, module in system.modules.items()]
    figure = Figure.draw(drawn, alt=f"Network of {parts}: {'; '.join(joined)}.",
                         caption="Lumps, heat paths, sensors, heaters and modules. A sensor has the same color in all "
                                 "figures; from the seventh on its curves are dashed too.")
    return Section("The machine as modeled", text, figures=(figure,), anchor=NETWORK)
