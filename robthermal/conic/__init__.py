"""The one door to the conic solver: matrices that make linear functions definite, coefficients that keep norms small.

What comes back is a candidate. The solver's status and objective are for the record: whoever asked checks the matrix,
and the certificate's checker proves it.
"""

from ._cones import ConeBounds as ConeBounds
from ._cones import least_cost as least_cost
from ._definite import Candidate as Candidate
from ._definite import Form as Form
from ._definite import largest_margin as largest_margin
from ._inequalities import Inequality as Inequality
from ._inequalities import inside as inside
from ._norms import NormBounds as NormBounds
from ._norms import smallest_bound as smallest_bound
from ._quadratic import Ball as Ball
from ._quadratic import least_quadratic as least_quadratic
from ._solver import Point as Point
from ._sparse import group_sparse as group_sparse
from ._stacked import strictly as strictly

__all__ = ["Ball", "Candidate", "ConeBounds", "Form", "Inequality", "NormBounds", "Point", "group_sparse", "inside",
           "largest_margin", "least_cost", "least_quadratic", "smallest_bound", "strictly"]
