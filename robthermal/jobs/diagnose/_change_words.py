"""What has changed between two days, in words that need no statistics."""

from __future__ import annotations

from ...diagnosis import Diagnosis, Found

_FIELDS = {"conductance": "the conductance of {0}", "capacity": "the heat capacity of {0}", "gain": "the gain of {0}",
           "drive.gain": "the gain of {0}", "conductance.value": "the conductance of {0}",
           "resistance.value": "the resistance of {0}", "seebeck.value": "the Seebeck coefficient of {0}",
           "time_constant": "the lag of {0}", "radiation": "the radiation along {0}",
           "natural.gain": "the natural convection along {0}"}


def parameter_in_words(name: str) -> str:
    """A number of the system, as "the conductance of sink-room".

    Parameters
    ----------
    name : str
        Dotted name of the number.
    """
    table, _, rest = name.partition(".")
    for field, words in sorted(_FIELDS.items(), key=lambda item: -len(item[0])):
        if rest.endswith(f".{field}"):
            part = rest.removesuffix(f".{field}")
            return words.format(f"link {part}" if table == "links" else part)
    return name


def change_in_words(found: Found) -> str:
    """A change of a parameter, as "the conductance of link sink-room is 49 % lower".

    Parameters
    ----------
    found : Found
        An accepted `parameter_change`.
    """
    value, std, _ = found.values["relative"]
    names = " and ".join(map(parameter_in_words, found.where))
    return (f"{names} {'is' if len(found.where) == 1 else 'are'} {100 * abs(value):.0f} % "
            f"{'lower' if value < 0 else 'higher'} (± {100 * std:.0f} %)")


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
    return (f"Nothing has changed: the new records are within the scatter of {records}. The model fitted to the "
            f"reference is off by {gap.before:.2g} {gap.unit} on the new records, and by {compared.rms:.2g} {gap.unit} "
            "on the reference records.")
