"""Filters as a real-time controller runs them: sections, fixed point, files, C source."""

from ._export import export as export
from ._files import save_filters as save_filters
from ._fixed_point import FixedPoint as FixedPoint
from ._fixed_point import ScaledPath as ScaledPath
from ._fixed_point import fixed_point as fixed_point
from ._matrix_c_source import MatrixRecursion as MatrixRecursion
from ._recursion import Recursion as Recursion
from ._sections import sections as sections

__all__ = ["FixedPoint", "MatrixRecursion", "Recursion", "ScaledPath", "export", "fixed_point", "save_filters",
           "sections"]
