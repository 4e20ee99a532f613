"""Certificates of thermal systems: contraction in a box, current limits, box invariance, runaway, large networks."""

from ._contraction import contraction as contraction
from ._enclosure import RunawayFree as RunawayFree
from ._enclosure import heater_heat as heater_heat
from ._enclosure import runaway_free as runaway_free
from ._gains import Gains as Gains
from ._gains import gains as gains
from ._invariance import invariance as invariance
from ._limits import CurrentLimit as CurrentLimit
from ._limits import largest_current as largest_current
from ._maps import LimitMap as LimitMap
from ._maps import limit_map as limit_map
from ._network import network as network
from ._observer import observer as observer
from ._runaway import Runaway as Runaway
from ._runaway import runaway as runaway
from ._thesis import ThesisBounds as ThesisBounds
from ._thesis import thesis_bounds as thesis_bounds

__all__ = ["CurrentLimit", "Gains", "LimitMap", "Runaway", "RunawayFree", "ThesisBounds", "contraction", "gains",
           "heater_heat", "invariance", "largest_current", "limit_map", "network", "observer", "runaway",
           "runaway_free", "thesis_bounds"]
