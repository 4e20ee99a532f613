"""How a remark of a job may read."""

from __future__ import annotations

from enum import unique

from ..errors import OutcomeCode


@unique
class JobsCode(OutcomeCode):
    """Codes of the outcomes of `robthermal.jobs`."""

    BINS_LEFT_OUT = (False, "The lowest measured frequencies are not in the envelope: their confidence circle is "
                     "infinite, or holds plants that make det(I + P K0) zero. The model error assumed there is the "
                     "first value of the envelope.",
                     "Measure longer, or with more excitation at these frequencies.")
    CIRCLES_LEFT_OUT = (False, "The confidence circles of the responses are not in the envelope (circles = false): "
                        "a plant in them need not be stabilized.",
                        "Leave circles out of [uncertainty] to have them included.")
    FRF_WITHOUT_COVARIANCE = (False, "The envelope has the values of a response without the noise of its measurement.",
                              "Give the .json files that robthermal frf writes.")
