"""The section of a report that shows what splitting a lump does."""

from __future__ import annotations

from ..._pandas import pd
from ...diagnosis import Refinement
from ...report import Section, Table


def refinement_section(one: Refinement) -> Section:
    """Remainder before and after, and every way to split that was tried.

    Parameters
    ----------
    one : Refinement
        The network with a lump split in two.
    """
    before = pd.DataFrame([{"records": kind, "remainder before [K]": one.before[kind],
                            "remainder after [K]": one.after[kind]} for kind in one.before])
    ways = pd.DataFrame([{"split": split.lump, "at the other half": ", ".join(split.moved) or "nothing",
                          "rms [K]": split.rms} for split in one.tried])
    text = (f"{one.outcome.text} The answer above is of the network as it is; refined.toml holds the split one. Each "
            "half has half of the capacity and of the surface.")
    return Section("A finer network", text, anchor="refinement", tables=(
        Table(before, "What is left beyond the noise.", digits=3),
        Table(ways, "Ways to split, each fitted to the training records: root mean square of the residual.",
              digits=3)))
