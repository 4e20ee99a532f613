"""What has changed between two days, in words that need no statistics."""

from __future__ import annotations

from ...diagnosis import Diagnosis, Found
from ...thermal import parameter_in_words


def change_in_words(found: Found) -> str:
    """A change of a parameter, as "the conductance of link sink-room is 49 % lower".

    Parameters
    ----------
    found : Found
        An accepted `parameter_change`.
    """
    value, std, _ = found.values["relative"]
    names = " and ".join(map(parameter_in_words, found.where))
    still = ""
    if "exponent" in found.values:
        still = (f" at a difference of 10 K, and now grows with the difference to the power "
                 f"{found.values['exponent'][0]:.2f} (air that stands still: 0.25 to 0.33)")
    return (f"{names} {'is' if len(found.where) == 1 else 'are'} {100 * abs(value):.0f} % "
            f"{'lower' if value < 0 else 'higher'} (± {100 * std:.0f} %){still}")


def gain_in_words(found: Found) -> str:
    """A heater or amplifier that no longer gives what its column says, as "heater gives 10 % less ...".

    Parameters
    ----------
    found : Found
        An accepted `input_gain`.
    """
    value, std, _ = found.values["gain"]
    return (f"{found.where[0]} gives {100 * abs(value):.0f} % {'less' if value < 0 else 'more'} than its record column "
            f"says (± {100 * std:.0f} %)")


def nothing_changed(found: Diagnosis) -> str:
    """The answer where the new records are within the scatter.

    Parameters
    ----------
    found : Diagnosis
        What was found, with reference records.
    """
    compared, gap = found.reference, found.gap["train"]
    assert compared is not None
    records = f"{compared.records} reference record{'s' * (compared.records > 1)}"
    return (f"Nothing has changed that the new records would show: they are within the scatter of {records}. The model "
            f"fitted to the reference is off by {gap.before:.2g} {gap.unit} on the new records, and by "
            f"{compared.rms:.2g} {gap.unit} on the reference records.")
