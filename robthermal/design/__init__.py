"""Controllers and observers for systems with thermoelectric modules."""

from ._controller import Controller as Controller
from ._controller import Seen as Seen
from ._feed_forward import DisturbanceObserver as DisturbanceObserver
from ._feed_forward import FeedForward as FeedForward
from ._feed_forward import disturbance_observer as disturbance_observer
from ._feed_forward import feed_forward as feed_forward
from ._linearization import Bounds as Bounds
from ._linearization import Command as Command
from ._linearization import FeedbackLinearization as FeedbackLinearization
from ._linearization import Reach as Reach
from ._linearization import feedback_linearization as feedback_linearization
from ._lti import LinearController as LinearController
from ._lti import linear_controller as linear_controller
from ._pid import PID as PID
from ._pid import pid as pid
from ._plant import ColdSide as ColdSide
from ._plant import cold_side as cold_side
from ._sampling import loop_poles as loop_poles
from ._state_feedback import StateFeedback as StateFeedback
from ._state_feedback import state_feedback as state_feedback

__all__ = ["Bounds", "ColdSide", "Command", "Controller", "DisturbanceObserver", "FeedForward", "FeedbackLinearization",
           "LinearController", "PID", "Reach", "Seen", "StateFeedback", "cold_side", "disturbance_observer",
           "feed_forward", "feedback_linearization", "linear_controller", "loop_poles", "pid", "state_feedback"]
