"""How the estimate of a frequency response may end."""

from __future__ import annotations

from enum import unique

from robthermal.errors import OutcomeCode


@unique
class IdentifyCode(OutcomeCode):
    """Codes of the outcomes of `robthermal.identify`."""

    CONSTANT_INPUT = (None, "An input that never changes was left out of the identification.",
                      "Excite it where its response is wanted; its value is in operating_point.")
    ESTIMATED = (True, "All bins are estimated.")
    FRF_WITHOUT_COVARIANCE = (False, "The file or table brings no covariance.",
                              "Give a file that robthermal frf writes where the noise counts: calibrate and diagnose "
                              "weigh by it.")
    SUSPECT = (False, "The local model does not describe the window of some bins, or the loop hides the plant.",
               "Prescribe the slow poles (lrmp), record longer, or leave these bins out.")
    UNDETERMINED = (False, "Some bins are not determined by the data (NaN).",
                    "Excite these frequencies, widen the window, or leave these bins out.")
