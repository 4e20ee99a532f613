"""Candidate effects of a diagnosis; the effects themselves are in `robthermal.thermal.effects`."""

from ...thermal.effects import Effect as Effect
from ...thermal.effects import Quantity as Quantity
from ...thermal.effects import Response as Response
from ...thermal.effects import TrialContext as TrialContext
from ...thermal.effects import effects as effects
from ...thermal.effects import forget_effect as forget_effect
from ...thermal.effects import register_effect as register_effect
from ._ambient_drift import AMBIENT_DRIFT as AMBIENT_DRIFT
from ._ambient_drift import conductances as conductances
from ._candidate import Candidate as Candidate
from ._candidate import candidates as candidates

__all__ = ["AMBIENT_DRIFT", "Candidate", "Effect", "Quantity", "Response", "TrialContext", "candidates",
           "conductances", "effects", "forget_effect", "register_effect"]
