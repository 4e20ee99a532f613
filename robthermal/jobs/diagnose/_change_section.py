"""The section of a report that shows the change of every parameter beside the scatter of healthy records."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from ..._drawing import size_of
from ..._pandas import pd
from ...diagnosis import Compared, Diagnosis
from ...report import Figure, Section, Table, house_style


def change_section(found: Diagnosis, compared: Compared) -> Section:
    """Scatter among the reference records and the deviation of the new records, parameter by parameter.

    Parameters
    ----------
    found : Diagnosis
        What was found.
    compared : Compared
        What the reference records say.
    """
    text = (f"The common fit to {compared.records} reference record{'s' * (compared.records > 1)} leaves "
            f"{compared.rms:.3g} K, {compared.remainder:.3g} K of it beyond the noise. A deviation counts as a change "
            "where it exceeds the scatter; that of one parameter that is not accepted may be due to another.")
    if not compared.scatter:
        return Section("Reference and new records", text, anchor="reference")
    rows = [{"parameter": name, "scatter of healthy records [%]": 100 * scatter,
             "new records [%]": 100 * compared.deviation[name]} for name, scatter in compared.scatter.items()]
    with house_style():
        figure = Figure.draw(_drawn(compared).figure, alt="Deviation of every parameter on the new records beside the "
                             "scatter of healthy records.", caption="Grey: twice the scatter among healthy records. "
                             "Dots: the new records.")
    return Section("Reference and new records", text, figures=(figure,), anchor="reference",
                   tables=(Table(pd.DataFrame(rows), "Parameters of the fit, relative to the mean of the reference "
                                 "records.", digits=3), *_visible(compared)))


def _visible(compared: Compared) -> Iterator[Table]:
    """How large a change would have been seen, where none was."""
    rows = [{"parameter": name, "visible if lower by [%]": _percent(size["lower"]),
             "visible if higher by [%]": _percent(size["higher"])} for name, size in compared.visible.items()]
    if rows:
        yield Table(pd.DataFrame(rows), "Changes that the new records would have shown with a probability of about "
                    "0.9; smaller ones may not be visible.", digits=2)


def _percent(size: float) -> str:
    return f"{math.ceil(100 * size)}" if math.isfinite(size) else "not visible"


def _drawn(compared: Compared) -> Any:
    """Bars of twice the scatter, and the deviations."""
    from matplotlib import pyplot as plt  # heavy, only when a picture is wanted

    names = list(compared.scatter)
    _, ax = plt.subplots(figsize=size_of(1.2 + 0.35 * len(names)), layout="constrained")
    place = np.arange(len(names))
    ax.barh(place, [400 * compared.scatter[name] for name in names], left=[-200 * compared.scatter[name] for name in
                                                                         names], color="0.85", height=0.6)
    ax.plot([100 * compared.deviation[name] for name in names], place, "o")
    ax.axvline(0.0, color="black", linewidth=0.7)
    ax.set(yticks=place, yticklabels=names, xlabel="deviation from the reference records [%]")
    ax.invert_yaxis()
    return ax
