"""What a unit of an effect does to a record: heats of all lumps, or of those that have any."""

from __future__ import annotations

import numpy as np

from robthermal.diagnosis import Response


def test_heats_of_all_lumps_are_kept_as_those_of_the_lumps_that_have_any():
    start, end = np.zeros((4, 3)), np.zeros((4, 3))
    start[1, 2], end[2, 0] = 1.0, -2.0
    found = Response(heat=(start, end)).heat
    assert sorted(found) == [0, 2]
    for lump, (first, last) in found.items():
        assert np.array_equal(first, start[:, lump]) and np.array_equal(last, end[:, lump])
    assert Response(heat=found).heat is found and Response().heat is None
    assert Response(heat=(start * 0.0, end * 0.0)).heat == {}
