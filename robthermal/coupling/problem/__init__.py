"""What a coupling is designed for, its closed loop, its numbers and their proofs."""

from ._certificates import Proofs as Proofs
from ._norms import NORMS as NORMS
from ._norms import Norm as Norm
from ._performance import Performance as Performance
from ._performance import coupled as coupled
from ._performance import h2 as h2
from ._performance import variances as variances
from ._problem import Problem as Problem
from ._problem import Subsystem as Subsystem
from ._problem import prepare as prepare
from ._radius import radius as radius
from ._realization import Realization as Realization
from ._realization import RunningLoops as RunningLoops
from ._realization import assembled as assembled
from ._realization import coupling_controller as coupling_controller
from ._realization import realization as realization
from ._realization import running_loops as running_loops
from ._realization import youla_parameter as youla_parameter

__all__ = ["NORMS", "Norm", "Performance", "Problem", "Proofs", "Realization", "RunningLoops", "Subsystem", "assembled",
           "coupled", "coupling_controller", "h2", "prepare", "radius", "realization", "running_loops", "variances",
           "youla_parameter"]
