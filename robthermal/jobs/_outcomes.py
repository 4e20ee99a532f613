"""How a remark of a job may read."""

from __future__ import annotations

from enum import unique

from ..errors import OutcomeCode


@unique
class JobsCode(OutcomeCode):
    """Codes of the outcomes of `robthermal.jobs`."""

    CIRCLES_LEFT_OUT = (False, "The 95 % circles of the measured responses are not in the envelope (circles = false): "
                        "a plant in them need not be stabilized.",
                        "Leave circles out of [uncertainty] to have them included.")
    FRF_WITHOUT_COVARIANCE = (False, "The envelope has the values of a response without the noise of its measurement.",
                              "Give the .json files that robthermal frf writes.")
