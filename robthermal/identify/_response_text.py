"""A frequency response in words: what to trust, and a short table."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from robthermal._html import short_table
from robthermal.errors import Outcome

from ._outcomes import IdentifyCode

if TYPE_CHECKING:
    from ._response import FrequencyResponse


def outcome(result: FrequencyResponse) -> Outcome:
    """Whether the estimate may be used as it stands, and what to distrust."""
    if not result.has_covariance:
        return IdentifyCode.FRF_WITHOUT_COVARIANCE.outcome(" ".join(result.notes), remedy="")
    undetermined = np.isnan(result.response).any(axis=(0, 1))
    if undetermined.any():
        text = f"{int(undetermined.sum())} of {len(result)} bins are not determined by the data (NaN)."
        return IdentifyCode.UNDETERMINED.outcome(text, remedy=" ".join(result.notes))
    if result.suspect.any():
        where = result.frequencies[result.suspect]
        text = (
            f"{where.size} of {len(result)} bins are suspect, from {where[0]:.3g} to {where[-1]:.3g} Hz: the local "
            "model does not describe the window (wider than the slowest pole, or wrong poles), or the loop hides "
            "the plant."
        )
        return IdentifyCode.SUSPECT.outcome(text, remedy=" ".join([IdentifyCode.SUSPECT.remedy, *result.notes]))
    return IdentifyCode.ESTIMATED.outcome(" ".join([f"All {len(result)} bins estimated.", *result.notes]))


def remarks(result: FrequencyResponse) -> tuple[Outcome, ...]:
    """What has to stand beside any claim that rests on the estimate."""
    left_out = [note for note in result.notes if f"({IdentifyCode.CONSTANT_INPUT.code})" in note]
    found = [IdentifyCode.CONSTANT_INPUT.outcome(note, ok=True) for note in left_out]
    if not result.has_covariance:
        found.append(IdentifyCode.FRF_WITHOUT_COVARIANCE.outcome())
    return tuple(found)


def html(result: FrequencyResponse) -> str:
    """Short table for notebooks."""
    f = result.frequencies
    rows = [("method", result.method), ("bins", f"{len(result)}, {f[0]:.4g} to {f[-1]:.4g} Hz"),
            ("inputs", ", ".join(result.input_names)), ("outputs", ", ".join(result.output_names))]
    return short_table("Frequency response", rows, str(result.outcome))


def table(result: FrequencyResponse) -> str:
    """A few frequencies of every entry of G, and the outcome."""
    lines = [
        f"Frequency response by {result.method}: {len(result)} bins, "
        f"{result.frequencies[0]:.4g} to {result.frequencies[-1]:.4g} Hz",
        f"{'output':<14}{'input':<14}{'f [Hz]':>12}{'|G|':>12}{'phase [deg]':>13}{'radius 95 %':>13}  suspect",
    ]
    radius = result.confidence_radius(0.95)
    chosen = np.unique(np.geomspace(1, len(result), 4).astype(int) - 1)
    for o, output in enumerate(result.output_names):
        for i, name in enumerate(result.input_names):
            for f in chosen:
                g = result.response[o, i, f]
                numbers = f"{result.frequencies[f]:>12.4g}{abs(g):>12.4g}{np.degrees(np.angle(g)):>13.1f}"
                doubt = "yes" if result.suspect[f] else "no"
                lines.append(f"{output:<14}{name:<14}{numbers}{radius[o, i, f]:>13.3g}  {doubt}")
    return "\n".join([*lines, str(result.outcome)])
