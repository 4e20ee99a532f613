"""Closed loops, their coprime factors, and what measured plants make of them: the dual-Youla parameter."""

from ._coprime import CoprimeFactors as CoprimeFactors
from ._coprime import check_cutoff as check_cutoff
from ._coprime import coprime as coprime
from ._coprime import corner_grid as corner_grid
from ._dual_youla import dual_youla as dual_youla
from ._frf import Measured as Measured
from ._inner import inner_factor as inner_factor
from ._intervals import Intervals as Intervals
from ._intervals import intervals_of as intervals_of
from ._loop import Loop as Loop
from ._loop import close as close
from ._loop import feedback_matrix as feedback_matrix
from ._matrix_factors import MatrixFactors as MatrixFactors
from ._matrix_factors import MatrixLoop as MatrixLoop
from ._matrix_factors import matrix_factors as matrix_factors
from ._matrix_uncertainty import matched_matrix as matched_matrix
from ._matrix_uncertainty import matrix_uncertainty as matrix_uncertainty
from ._normalized import NormalizedFactors as NormalizedFactors
from ._normalized import normalized as normalized
from ._overbound import overbound as overbound
from ._uncertainty import Uncertainty as Uncertainty
from ._uncertainty import from_factors as from_factors

__all__ = ["CoprimeFactors", "Intervals", "Loop", "MatrixFactors", "MatrixLoop", "Measured", "NormalizedFactors",
           "Uncertainty", "check_cutoff", "close", "coprime", "corner_grid", "dual_youla", "feedback_matrix",
           "from_factors", "inner_factor", "intervals_of", "matched_matrix", "matrix_factors",
           "matrix_uncertainty", "normalized", "overbound"]
