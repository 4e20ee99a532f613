"""The kinds of certificates that can be checked: one line each."""

from __future__ import annotations

from ._closed_loop import CLOSED_LOOP
from ._contraction import CONTRACTION
from ._ellipsoid import ELLIPSOID
from ._frequency import FREQUENCY
from ._gain import GAIN
from ._hinf import HINF
from ._invariance import INVARIANCE
from ._kind import Kind
from ._loop import LOOP
from ._network import NETWORK
from ._network_peak import NETWORK_PEAK
from ._observer import OBSERVER
from ._peak import PEAK
from ._polytope import POLYTOPE
from ._regulated import REGULATED
from ._runaway import RUNAWAY
from ._scheduled import SCHEDULED
from ._stability import STABILITY

KINDS: dict[str, Kind] = {kind.name: kind for kind in (CONTRACTION, INVARIANCE, RUNAWAY, NETWORK, OBSERVER, GAIN,
                                                       REGULATED, STABILITY, HINF, PEAK, FREQUENCY, LOOP,
                                                       CLOSED_LOOP, POLYTOPE, ELLIPSOID, SCHEDULED, NETWORK_PEAK)}
