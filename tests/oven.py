"""Two lumps, two heaters, two thermometers: a network whose readings a matrix exponential gives as well."""

from __future__ import annotations

import robthermal as rt

ROOM, NOISE = 295.0, 0.02
OVEN = rt.System(
    name="oven", ambients={"room": {"temperature": ROOM}},
    lumps={"block": {"capacity": 200.0}, "plate": {"capacity": 150.0}},
    links=[{"between": ("block", "plate"), "conductance": 1.5}, {"between": ("plate", "room"), "conductance": 0.8},
           {"between": ("block", "room"), "conductance": 0.2}],
    inputs={"q": {"lump": "block", "limits": (0.0, 20.0)}, "p": {"lump": "plate", "limits": (0.0, 20.0)}},
    sensors={"T_block": {"lump": "block", "noise": NOISE}, "T_plate": {"lump": "plate", "noise": NOISE}},
    fit={"lumps.block.capacity": {"lower": 50.0, "upper": 800.0},
         "links.block-plate.conductance": {"lower": 0.2, "upper": 10.0},
         "links.plate-room.conductance": {"lower": 0.1, "upper": 5.0}})
