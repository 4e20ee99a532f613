"""Coupling of subsystems with several inputs and outputs: factors are matrices, of which the order counts."""

from ._evaluate import evaluate_matrix as evaluate_matrix
from ._filters import MatrixFilters as MatrixFilters
from ._problem import MatrixProblem as MatrixProblem
from ._synthesize import synthesize_matrix as synthesize_matrix

__all__ = ["MatrixFilters", "MatrixProblem", "evaluate_matrix", "synthesize_matrix"]
