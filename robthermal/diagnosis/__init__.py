"""Where model and data differ: locate it, name the missing effect, add it, and validate."""

from ._augment import Augmented as Augmented
from ._changed import Compared as Compared
from ._differing import Differing as Differing
from ._found import Found as Found
from ._outcomes import DiagnosisCode as DiagnosisCode
from ._refinement import Refinement as Refinement
from ._refinement import Split as Split
from ._with_names import with_named_effects as with_named_effects
from .data import NoiseEstimate as NoiseEstimate
from .data import noise_floor as noise_floor
from .diagnose import diagnose as diagnose
from .diagnosis import Diagnosis as Diagnosis
from .effects import Candidate as Candidate
from .effects import Effect as Effect
from .effects import Quantity as Quantity
from .effects import Response as Response
from .effects import candidates as candidates
from .effects import effects as effects
from .effects import forget_effect as forget_effect
from .effects import register_effect as register_effect
from .evidence import Adequacy as Adequacy
from .evidence import Evidence as Evidence
from .evidence import Gap as Gap
from .evidence import HoldOut as HoldOut
from .evidence import Left as Left
from .evidence import Location as Location
from .evidence import Remainder as Remainder
from .evidence import Scores as Scores
from .evidence import Stability as Stability
from .evidence import UnknownHeat as UnknownHeat
from .evidence import ValidationResiduals as ValidationResiduals
from .evidence import adequacy as adequacy
from .evidence import hold_out as hold_out
from .evidence import locate as locate
from .evidence import score as score
from .evidence import unknown_heat as unknown_heat
from .fit import FoundAmbient as FoundAmbient
from .fit import NoiseScaling as NoiseScaling
from .fit import Refit as Refit
from .fit import refit as refit
from .path import LinearizedRecord as LinearizedRecord
from .plan import Measurement as Measurement
from .plan import NextExperiment as NextExperiment
from .plan import Resolving as Resolving
from .plan import next_experiment as next_experiment
from .search import Decision as Decision
from .search import EffectSet as EffectSet
from .search import Entry as Entry
from .search import JointCheck as JointCheck
from .search import JointSelection as JointSelection
from .search import ShortList as ShortList
from .search import decide as decide
from .search import refit_short_list as refit_short_list
from .search import select_jointly as select_jointly

__all__ = ["Adequacy", "Augmented", "Candidate", "Compared", "Decision", "Diagnosis", "DiagnosisCode", "Differing",
           "Effect", "EffectSet", "Entry", "Evidence", "Found", "FoundAmbient", "Gap", "HoldOut", "JointCheck",
           "JointSelection", "Left", "LinearizedRecord", "Location", "Measurement", "NextExperiment", "NoiseEstimate",
           "NoiseScaling", "Quantity", "Refinement", "Refit", "Remainder", "Resolving", "Response", "Scores",
           "ShortList", "Split", "Stability", "UnknownHeat", "ValidationResiduals", "adequacy", "candidates", "decide",
           "diagnose", "effects", "forget_effect", "hold_out", "locate", "next_experiment", "noise_floor", "refit",
           "refit_short_list", "register_effect", "score", "select_jointly", "unknown_heat", "with_named_effects"]
