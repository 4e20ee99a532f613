"""Coupling filters between two controlled subsystems: Youla factors, measured uncertainty, proven robust stability."""

from ._coprime import CoprimeFactors as CoprimeFactors
from ._coprime import coprime as coprime
from ._destabilising import Destabilising as Destabilising
from ._destabilising import destabilising as destabilising
from ._evaluate import evaluate as evaluate
from ._filters import Filters as Filters
from ._fixed_point import FixedPoint as FixedPoint
from ._fixed_point import ScaledPath as ScaledPath
from ._inner import inner_factor as inner_factor
from ._joint import Joint as Joint
from ._joint import joint as joint
from ._mu import mu as mu
from ._mu_bound import mu_bound as mu_bound
from ._mu_result import MuBound as MuBound
from ._normalized import NormalizedFactors as NormalizedFactors
from ._normalized import normalized as normalized
from ._norms import NORMS as NORMS
from ._norms import Norm as Norm
from ._overbound import overbound as overbound
from ._performance import Performance as Performance
from ._sampled import discretize as discretize
from ._simulate import Simulation as Simulation
from ._simulate import simulate as simulate
from ._spectra import Spectra as Spectra
from ._spectra import spectra as spectra
from ._synthesize import synthesize as synthesize
from ._uncertainty import Uncertainty as Uncertainty
from ._uncertainty import dual_youla as dual_youla
from ._worst_case import WorstCase as WorstCase
from ._worst_case import worst_case as worst_case

__all__ = ["NORMS", "CoprimeFactors", "Destabilising", "Filters", "FixedPoint", "Joint", "MuBound", "Norm",
           "NormalizedFactors",
           "Performance", "ScaledPath", "Simulation", "Spectra", "Uncertainty", "WorstCase", "coprime",
           "destabilising", "discretize", "dual_youla", "evaluate", "inner_factor", "joint", "mu", "mu_bound",
           "normalized", "overbound", "simulate", "spectra", "synthesize", "worst_case"]
