"""Linear time-invariant systems: candidates in floats for certificates that the checker proves. No conic solver.

Shared by the packages certify and coupling; public through `robthermal.certify`.
"""

from ._bound import GainBound as GainBound
from ._closed_loop import close as close
from ._closed_loop import closed_loop as closed_loop
from ._closed_loop import h2_norm as h2_norm
from ._closed_loop import prove_closed_loop as prove_closed_loop
from ._frequency import frequency_norm as frequency_norm
from ._frequency import frequency_radius as frequency_radius
from ._frequency import interval_norms as interval_norms
from ._frequency import interval_radii as interval_radii
from ._hinf import hinf as hinf
from ._levels import hinf_norm as hinf_norm
from ._levels import plant_norm as plant_norm
from ._peak import peak as peak
from ._response import responder as responder
from ._stability import stability as stability
from ._systems import Plant as Plant
from ._systems import made_by as made_by
from ._systems import read_plant as read_plant

__all__ = ["GainBound", "Plant", "close", "closed_loop", "frequency_norm", "frequency_radius", "h2_norm", "hinf",
           "hinf_norm", "interval_norms", "interval_radii", "made_by", "peak", "plant_norm", "prove_closed_loop",
           "read_plant", "responder", "stability"]
