"""What a fit leaves: scores of candidate effects, tests of what is left, its place, prediction of validation data."""

from ._adequacy import Adequacy as Adequacy
from ._adequacy import adequacy as adequacy
from ._blocks import NEEDED as NEEDED
from ._blocks import PREDICTED as PREDICTED
from ._blocks import SURE as SURE
from ._blocks import Evidence as Evidence
from ._blocks import Stability as Stability
from ._blocks import Wandering as Wandering
from ._blocks import reproducible as reproducible
from ._blocks import stability as stability
from ._blocks import wandering as wandering
from ._deviations import deviations as deviations
from ._hold_out import Gap as Gap
from ._hold_out import HoldOut as HoldOut
from ._hold_out import ValidationResiduals as ValidationResiduals
from ._hold_out import expected_rms as expected_rms
from ._hold_out import hold_out as hold_out
from ._hold_out import negative_log_predictive_density as negative_log_predictive_density
from ._hold_out import refuse_seen as refuse_seen
from ._hold_out import square_beyond_noise as square_beyond_noise
from ._hold_out import validation_data as validation_data
from ._locate import Location as Location
from ._locate import locate as locate
from ._remainder import Left as Left
from ._remainder import Remainder as Remainder
from ._remainder import left as left
from ._remainder import remainder as remainder
from ._score import ALIAS as ALIAS
from ._score import ALPHA as ALPHA
from ._score import BIC_GAP as BIC_GAP
from ._score import Scores as Scores
from ._score import explains as explains
from ._score import promised as promised
from ._score import promising as promising
from ._score import score as score
from ._score import score_candidates as score_candidates
from ._twin import Twin as Twin
from ._unknown_heat import UnknownHeat as UnknownHeat
from ._unknown_heat import unknown_heat as unknown_heat

__all__ = ["ALIAS", "ALPHA", "Adequacy", "BIC_GAP", "Evidence", "Gap", "HoldOut", "Left", "Location", "NEEDED",
           "PREDICTED", "Remainder", "SURE", "Scores", "Stability", "Twin", "UnknownHeat", "ValidationResiduals",
           "Wandering", "adequacy", "deviations", "expected_rms", "explains", "hold_out", "left", "locate",
           "negative_log_predictive_density", "promised", "promising", "refuse_seen", "remainder", "reproducible",
           "score", "score_candidates", "square_beyond_noise", "stability", "unknown_heat", "validation_data",
           "wandering"]
