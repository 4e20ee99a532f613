"""How an estimate may end."""

from __future__ import annotations

from enum import unique

from ..errors import OutcomeCode


@unique
class CalibrationCode(OutcomeCode):
    """Codes of the outcomes of `robthermal.calibration`."""

    AT_BOUND = (True, "Converged with a parameter at a bound; standard deviations there ignore the bound.",
                "Widen it if the physics allow, else doubt the structure of the model.")
    CONVERGED = (True, "The estimate converged.")
    FITTED = (True, "A law of convection was fitted to steady plateaus.")
    NOT_CONVERGED = (False, "The estimate stopped without converging.",
                     "Raise max_iterations, start closer, or calibrate fewer parameters.")
    NOT_EXPLAINED = (False, "The model of the body does not reproduce the plateaus with any law of convection.",
                     "Calibrate its conductances first, from a frequency response or a step, and cut it finer.")
    NOT_UNIFORM = (False, "The thermometers on the body differ too much for a law that assumes one temperature.",
                   "Take convection_of_body with a model of the body; leave out thermometers of other bodies.")
    UNDETERMINED = (False, "Converged, but the data do not determine every parameter.",
                    "Fix one of these parameters, give it a prior (sigma), or excite the system differently.")
