"""Controllers and observers for systems with thermoelectric modules; syntheses for any linear plant."""

from ..synthesis import AntiWindupDesign as AntiWindupDesign
from ..synthesis import Design as Design
from ..synthesis import FeedbackDesign as FeedbackDesign
from ..synthesis import FrfDesign as FrfDesign
from ..synthesis import FrfMatrixDesign as FrfMatrixDesign
from ..synthesis import HybridIntegratorGain as HybridIntegratorGain
from ..synthesis import InvariantEllipsoid as InvariantEllipsoid
from ..synthesis import LpvDesign as LpvDesign
from ..synthesis import MpcDesign as MpcDesign
from ..synthesis import MpcStep as MpcStep
from ..synthesis import RobustAgainst as RobustAgainst
from ..synthesis import Terminal as Terminal
from ..synthesis import anti_windup as anti_windup
from ..synthesis import frf_pid as frf_pid
from ..synthesis import h2 as h2
from ..synthesis import hinf as hinf
from ..synthesis import hybrid_integrator_gain as hybrid_integrator_gain
from ..synthesis import invariant_ellipsoid as invariant_ellipsoid
from ..synthesis import lpv as lpv
from ..synthesis import mixed as mixed
from ..synthesis import mpc as mpc
from ..synthesis import mu_synthesis as mu_synthesis
from ..synthesis import output_feedback as output_feedback
from ..synthesis import polytopic_feedback as polytopic_feedback
from ..synthesis import uncertainty_weight as uncertainty_weight
from ._certify_loop import CertifiedLoop as CertifiedLoop
from ._certify_loop import certify_loop as certify_loop
from ._constant_gain import ConstantGain as ConstantGain
from ._constant_gain import constant_gain as constant_gain
from ._controller import ControllerInput as ControllerInput
from ._estimate import Estimate as Estimate
from ._extended import ExtendedKalmanFilter as ExtendedKalmanFilter
from ._feed_forward import DisturbanceObserver as DisturbanceObserver
from ._feed_forward import FeedForward as FeedForward
from ._feed_forward import disturbance_observer as disturbance_observer
from ._feed_forward import feed_forward as feed_forward
from ._linearization import Bounds as Bounds
from ._linearization import Command as Command
from ._linearization import FeedbackLinearization as FeedbackLinearization
from ._linearization import Reach as Reach
from ._linearization import feedback_linearization as feedback_linearization
from ._loop import ClosedLoop as ClosedLoop
from ._loop import simulate_loop as simulate_loop
from ._loop_margins import LoopMargins as LoopMargins
from ._loop_margins import PlantMargins as PlantMargins
from ._loop_margins import loop_margins as loop_margins
from ._lti import LinearController as LinearController
from ._lti import linear_controller as linear_controller
from ._margins import Margins as Margins
from ._matrices import Matrices as Matrices
from ._matrix_controller import DESIGN_FORMAT as DESIGN_FORMAT
from ._matrix_controller import MatrixController as MatrixController
from ._matrix_controller import gains_digest as gains_digest
from ._matrix_controller import load_controller as load_controller
from ._modal_feedback import ModalFeedback as ModalFeedback
from ._modal_feedback import modal_feedback as modal_feedback
from ._observer import GainObserver as GainObserver
from ._observer import observer as observer
from ._observer_model import ObserverModel as ObserverModel
from ._observer_model import unobservable as unobservable
from ._operated_plants import face_ranges as face_ranges
from ._outcomes import DesignCode as DesignCode
from ._pid import PID as PID
from ._pid import pid as pid
from ._placement import Placement as Placement
from ._placement import place_sensors as place_sensors
from ._plant import ColdSide as ColdSide
from ._plant import cold_side as cold_side
from ._polarity import Polarity as Polarity
from ._polarity import check_polarity as check_polarity
from ._protection import Protection as Protection
from ._protection import protection as protection
from ._protection_rules import ProtectionRules as ProtectionRules
from ._ramp import SetpointRamp as SetpointRamp
from ._ramp import setpoint_ramp as setpoint_ramp
from ._reachable import Reachable as Reachable
from ._reachable import reachable as reachable
from ._regulated_points import RegulatedPoint as RegulatedPoint
from ._regulated_points import regulated_points as regulated_points
from ._robust_feedback import corner_plants as corner_plants
from ._sampling import loop_poles as loop_poles
from ._simulate_law import simulate_law as simulate_law
from ._state_feedback import StateFeedback as StateFeedback
from ._state_feedback import state_feedback as state_feedback
from ._step_response_linearity import StepResponseLinearity as StepResponseLinearity
from ._step_response_linearity import step_response_linearity as step_response_linearity
from ._tem_feedback import TemFeedback as TemFeedback
from ._tem_feedback import tem_feedback as tem_feedback
from ._tem_hull import tem_polytope as tem_polytope
from ._thermal_modes import ModalReconstruction as ModalReconstruction
from ._thermal_modes import ThermalModes as ThermalModes
from ._thermal_modes import reconstruct as reconstruct
from ._thermal_modes import thermal_modes as thermal_modes
from ._tuning import Tuning as Tuning
from ._tuning import checked_margins as checked_margins
from ._tuning import tune_pi as tune_pi

# Former names, kept for one version.
Collapse = StepResponseLinearity
Seen = ControllerInput
collapse = step_response_linearity

__all__ = ["Bounds", "CertifiedLoop", "ClosedLoop", "ColdSide", "Collapse", "Command", "ConstantGain",
           "ControllerInput", "DESIGN_FORMAT", "DesignCode", "DisturbanceObserver", "Estimate", "ExtendedKalmanFilter",
           "FeedForward", "FeedbackLinearization", "GainObserver", "LinearController", "LoopMargins", "Margins",
           "Matrices", "MatrixController", "ModalFeedback", "ModalReconstruction", "ObserverModel", "PID", "Placement",
           "PlantMargins", "Polarity", "Protection", "ProtectionRules", "Reach", "Reachable", "RegulatedPoint", "Seen",
           "SetpointRamp", "StateFeedback", "StepResponseLinearity", "TemFeedback", "ThermalModes", "Tuning",
           "certify_loop", "check_polarity", "checked_margins", "cold_side", "collapse", "constant_gain",
           "corner_plants", "disturbance_observer", "face_ranges", "feed_forward", "feedback_linearization",
           "gains_digest", "linear_controller", "load_controller", "loop_margins", "loop_poles", "modal_feedback",
           "observer", "pid", "place_sensors", "protection", "reachable", "reconstruct", "regulated_points",
           "setpoint_ramp", "simulate_law", "simulate_loop", "state_feedback", "step_response_linearity",
           "tem_feedback", "tem_polytope", "thermal_modes", "tune_pi", "unobservable"]
# of synthesis
__all__ += ["AntiWindupDesign", "Design", "FeedbackDesign", "FrfDesign", "FrfMatrixDesign", "HybridIntegratorGain",
            "InvariantEllipsoid", "LpvDesign", "MpcDesign", "MpcStep", "RobustAgainst", "Terminal", "anti_windup",
            "frf_pid", "h2", "hinf", "hybrid_integrator_gain", "invariant_ellipsoid", "lpv", "mixed", "mpc",
            "mu_synthesis", "output_feedback", "polytopic_feedback", "uncertainty_weight"]
