"""Coupling filters between two controlled subsystems: Youla factors, measured uncertainty, proven robust stability."""

from ._outcomes import CouplingCode as CouplingCode
from .analysis import Destabilizing as Destabilizing
from .analysis import Simulation as Simulation
from .analysis import WorstCase as WorstCase
from .analysis import destabilizing as destabilizing
from .analysis import simulate as simulate
from .analysis import worst_case as worst_case
from .evaluation import Filters as Filters
from .evaluation import Joint as Joint
from .evaluation import Spectra as Spectra
from .evaluation import discretize as discretize
from .evaluation import evaluate as evaluate
from .evaluation import joint as joint
from .evaluation import spectra as spectra
from .factors import CoprimeFactors as CoprimeFactors
from .factors import NormalizedFactors as NormalizedFactors
from .factors import Uncertainty as Uncertainty
from .factors import coprime as coprime
from .factors import dual_youla as dual_youla
from .factors import inner_factor as inner_factor
from .factors import normalized as normalized
from .factors import overbound as overbound
from .implementation import FixedPoint as FixedPoint
from .implementation import ScaledPath as ScaledPath
from .matrix import MatrixFilters as MatrixFilters
from .matrix import evaluate_matrix as evaluate_matrix
from .matrix import synthesize_matrix as synthesize_matrix
from .mu_bounds import MuBound as MuBound
from .mu_bounds import mu as mu
from .mu_bounds import mu_bound as mu_bound
from .problem import NORMS as NORMS
from .problem import Norm as Norm
from .problem import Performance as Performance
from .synthesis import synthesize as synthesize

__all__ = ["NORMS", "CoprimeFactors", "CouplingCode", "Destabilizing", "Filters", "FixedPoint", "Joint",
           "MatrixFilters", "MuBound", "Norm", "NormalizedFactors", "Performance", "ScaledPath", "Simulation",
           "Spectra", "Uncertainty", "WorstCase", "coprime", "destabilizing", "discretize", "dual_youla", "evaluate",
           "evaluate_matrix", "inner_factor", "joint", "mu", "mu_bound", "normalized", "overbound", "simulate",
           "spectra", "synthesize", "synthesize_matrix", "worst_case"]
