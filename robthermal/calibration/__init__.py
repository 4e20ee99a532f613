"""Parameters of a thermal system from records, frequency responses or both, and what the data do not determine."""

from ._calibrate import calibrate as calibrate
from ._convection import convection_law as convection_law
from ._convection_law import ConvectionLaw as ConvectionLaw
from ._convection_of_body import convection_of_body as convection_of_body
from ._estimates import Estimates as Estimates
from ._fit import Fit as Fit
from ._module_batch import ModuleBatch as ModuleBatch
from ._module_batch import module_batch as module_batch
from ._module_properties import ModuleProperties as ModuleProperties
from ._module_properties import module_properties as module_properties
from ._outcomes import CalibrationCode as CalibrationCode
from ._response_comparison import ResponseComparison as ResponseComparison
from ._score import Score as Score
from ._varying import VaryingModel as VaryingModel
from ._varying import join_models as join_models
from ._whiteness import Whiteness as Whiteness

__all__ = ["CalibrationCode", "ConvectionLaw", "Estimates", "Fit", "ModuleBatch", "ModuleProperties",
           "ResponseComparison", "Score", "VaryingModel", "Whiteness", "calibrate", "convection_law",
           "convection_of_body", "join_models", "module_batch", "module_properties"]
