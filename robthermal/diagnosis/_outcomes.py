"""How a diagnosis, or a stage of it, may end."""

from __future__ import annotations

from enum import unique

from ..errors import OutcomeCode


@unique
class DiagnosisCode(OutcomeCode):
    """Codes of the outcomes of `robthermal.diagnosis`."""

    ADEQUATE = (True, "Nothing is left to explain.")
    AMBIGUOUS = (False, "The records cannot distinguish some effects.",
                 "See the alternatives, and the next experiment for what separates them.")
    CONSISTENT = (True, "Nothing is missing that these records could show: see what they could not have shown, and "
                  "the detection limits.")
    CONVERGED = (True, "The fit converged.")
    DECLARED = (True, "Noise as declared.")
    DOUBTFUL = (False, "The declared noise is far from what the record shows.",
                "Correct it: every test below rests on it.")
    ESTIMATED = (True, "The noise was estimated, from third differences of the readings or with the frequency "
                 "response.")
    FINER = (True, "A lump split in two removes most of what the network left.",
             "Look where heaters and sensors really sit before you keep the split: refined.toml holds it.")
    FOUND = (True, "An unknown heat into the lump would explain the residual; it is located, not named.")
    INADEQUATE = (False, "Something is left: the model with these effects does not explain the records.",
                  "Look for further effects with rt.diagnose.")
    INEXACT = (False, "The convex program was not solved.",
               "Do not rely on this selection where `kkt` is large.")
    NAMED = (True, "One set of effects explains the records.")
    NAMED_WITH_REMAINDER = (True, "One set of effects is reproducibly better than every other; what is left beyond the "
                            "noise is stated, and has no name.")
    NONE = (False, "The records are as likely without any extra heat into the lump.",
            "Look at another lump: rt.diagnosis.locate ranks them.")
    NOT_FINER = (False, "No lump split in two removes enough of what the network leaves.",
                 "Measure more there: a sensor in that lump, or an input that drives it alone.")
    NOTHING = (True, "No candidate stands out of the noise.")
    NOT_CONVERGED = (False, "The fit stopped without converging.",
                     "Narrow the bounds, or give priors (sigma) to parameters the data do not determine.")
    NOT_PREDICTED = (False, "The validation records are not predicted: something else is missing, or has changed.",
                     "If nothing has changed in between, diagnose with them among the training records.")
    PREDICTED = (True, "The validation records are predicted as well as the training records are fitted.")
    SELECTED = (True, "The convex program was solved.")
    UNEXPLAINED = (False, "None of the known effects explains the records.",
                   "Look where the misfit sits: lump, sensor and conditions.")
