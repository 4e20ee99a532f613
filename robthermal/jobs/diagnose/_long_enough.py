"""Parts of a cut file that are too short for a diagnosis are left out, and that is said; a whole file never is."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

from ...diagnosis.data import SHORTEST
from ...identify import FrequencyResponse
from ...signals import Record


def long_enough(data: Sequence[Record | FrequencyResponse]) -> list[Record | FrequencyResponse]:
    """The data without parts of a file that are too short, where another part of it is not; a warning names them.

    Parameters
    ----------
    data : sequence of Record or FrequencyResponse
        As read: the parts of one file share the report of their import.
    """
    long = {id(one.imported) for one in data if isinstance(one, Record) and len(one) >= SHORTEST}
    out: list[Record | FrequencyResponse] = []
    for one in data:
        if isinstance(one, Record) and one.imported is not None and len(one) < SHORTEST and id(one.imported) in long:
            warnings.warn(f"{one.name} has {len(one)} samples, fewer than the {SHORTEST} that a diagnosis needs: left "
                          "out", UserWarning, stacklevel=2)
        else:
            out.append(one)
    return out
