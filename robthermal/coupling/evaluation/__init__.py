"""From filters to the result: numbers, proofs and spectra; the result reduced, or joined over several axes."""

from ._evaluate import evaluate as evaluate
from ._evaluate import finish as finish
from ._evaluate import refused as refused
from ._evaluate import verdict as verdict
from ._filters import Filters as Filters
from ._joint import Joint as Joint
from ._joint import joint as joint
from ._reduce import reduce as reduce
from ._result import CouplingResult as CouplingResult
from ._sampled import discretize as discretize
from ._spectra import Spectra as Spectra
from ._spectra import cumulative as cumulative
from ._spectra import spectra as spectra

__all__ = ["CouplingResult", "Filters", "Joint", "Spectra", "cumulative", "discretize", "evaluate", "finish", "joint",
           "reduce", "refused", "spectra", "verdict"]
