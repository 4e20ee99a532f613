"""What a finished coupling does over time, and on the plants under the envelope."""

from ._destabilising import Destabilising as Destabilising
from ._destabilising import destabilising as destabilising
from ._simulate import Simulation as Simulation
from ._simulate import simulate as simulate
from ._worst_case import WorstCase as WorstCase
from ._worst_case import worst_case as worst_case

__all__ = ["Destabilising", "Simulation", "WorstCase", "destabilising", "simulate", "worst_case"]
