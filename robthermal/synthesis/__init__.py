"""Controllers by convex programs and Riccati equations, each with a proof of what it reaches.

For any linear plant; thermal front ends are in `robthermal.design`, which also re-exports what is here.
"""

from ._anti_windup import AntiWindupDesign as AntiWindupDesign
from ._anti_windup import anti_windup as anti_windup
from ._design import Design as Design
from ._design import RobustAgainst as RobustAgainst
from ._ellipsoid import InvariantEllipsoid as InvariantEllipsoid
from ._ellipsoid import invariant_ellipsoid as invariant_ellipsoid
from ._feedback import FeedbackDesign as FeedbackDesign
from ._feedback import polytopic_feedback as polytopic_feedback
from ._frf_design import FrfDesign as FrfDesign
from ._frf_matrix_design import FrfMatrixDesign as FrfMatrixDesign
from ._frf_pid import frf_pid as frf_pid
from ._h2 import h2 as h2
from ._hinf import hinf as hinf
from ._hybrid_integrator_gain import HybridIntegratorGain as HybridIntegratorGain
from ._hybrid_integrator_gain import hybrid_integrator_gain as hybrid_integrator_gain
from ._lpv import lpv as lpv
from ._lpv_design import LpvDesign as LpvDesign
from ._mixed import mixed as mixed
from ._mpc import MpcDesign as MpcDesign
from ._mpc import mpc as mpc
from ._mpc_step import MpcStep as MpcStep
from ._mpc_terminal import Terminal as Terminal
from ._mu_synthesis import mu_synthesis as mu_synthesis
from ._outcomes import SynthesisCode as SynthesisCode
from ._output_feedback import output_feedback as output_feedback
from ._uncertainty_weight import uncertainty_weight as uncertainty_weight

__all__ = ["AntiWindupDesign", "Design", "FeedbackDesign", "FrfDesign", "FrfMatrixDesign", "HybridIntegratorGain",
           "InvariantEllipsoid", "LpvDesign", "MpcDesign", "MpcStep", "RobustAgainst", "SynthesisCode", "Terminal",
           "anti_windup", "frf_pid", "h2", "hinf", "hybrid_integrator_gain", "invariant_ellipsoid", "lpv", "mixed",
           "mpc", "mu_synthesis", "output_feedback", "polytopic_feedback", "uncertainty_weight"]
