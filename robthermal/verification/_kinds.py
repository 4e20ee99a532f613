"""The kinds of certificates that can be checked: one line each."""

from __future__ import annotations

from ._contraction import CONTRACTION
from ._gain import GAIN
from ._invariance import INVARIANCE
from ._kind import Kind
from ._network import NETWORK
from ._observer import OBSERVER
from ._runaway import RUNAWAY

KINDS: dict[str, Kind] = {kind.name: kind for kind in (CONTRACTION, INVARIANCE, RUNAWAY, NETWORK, OBSERVER, GAIN)}
