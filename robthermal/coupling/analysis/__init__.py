"""What a finished coupling does over time, and on the plants under the envelope."""

from ._destabilizing import Destabilizing as Destabilizing
from ._destabilizing import destabilizing as destabilizing
from ._simulate import Simulation as Simulation
from ._simulate import simulate as simulate
from ._worst_case import WorstCase as WorstCase
from ._worst_case import worst_case as worst_case

__all__ = ["Destabilizing", "Simulation", "WorstCase", "destabilizing", "simulate", "worst_case"]
