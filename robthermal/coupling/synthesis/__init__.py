"""Filters by a convex program on a basis, tightened until they can be proven."""

from ._basis import Basis as Basis
from ._basis import make_basis as make_basis
from ._design import Design as Design
from ._design import Limits as Limits
from ._design import default_pole as default_pole
from ._moments import moments as moments
from ._moments import square_root as square_root
from ._program import Demands as Demands
from ._program import Responses as Responses
from ._program import Touching as Touching
from ._program import cones as cones
from ._program import solve as solve
from ._synthesize import read_couple as read_couple
from ._synthesize import synthesize as synthesize

__all__ = ["Basis", "Demands", "Design", "Limits", "Responses", "Touching", "cones", "default_pole", "make_basis",
           "moments", "read_couple", "solve", "square_root", "synthesize"]
