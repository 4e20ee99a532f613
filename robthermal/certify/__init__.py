"""Certificates of thermal systems: contraction in a box, current limits, box invariance, runaway, large networks."""

from ._contraction import contraction as contraction
from ._enclosure import RunawayFree as RunawayFree
from ._enclosure import heater_heat as heater_heat
from ._enclosure import runaway_free as runaway_free
from ._invariance import invariance as invariance
from ._limits import CurrentLimit as CurrentLimit
from ._limits import largest_current as largest_current
from ._network import network as network
from ._observer import observer as observer
from ._runaway import Runaway as Runaway
from ._runaway import runaway as runaway

__all__ = ["CurrentLimit", "Runaway", "RunawayFree", "contraction", "heater_heat", "invariance", "largest_current",
           "network", "observer", "runaway", "runaway_free"]
