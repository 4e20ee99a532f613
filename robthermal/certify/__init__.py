"""Certificates of thermal systems: contraction in a box, current limits, box invariance, runaway, large networks."""

from ..linear import GainBound as GainBound
from ..linear import closed_loop as closed_loop
from ..linear import frequency_norm as frequency_norm
from ..linear import frequency_radius as frequency_radius
from ..linear import hinf as hinf
from ..linear import peak as peak
from ..linear import stability as stability
from ._authority import check_certificate as check_certificate
from ._contraction import contraction as contraction
from ._enclosure import RunawayFree as RunawayFree
from ._enclosure import runaway_free as runaway_free
from ._gains import Gains as Gains
from ._gains import gains as gains
from ._invariance import invariance as invariance
from ._limits import CurrentLimit as CurrentLimit
from ._limits import largest_current as largest_current
from ._loop import loop as loop
from ._loop_parameters import check_loop_parameters as check_loop_parameters
from ._maps import LimitMap as LimitMap
from ._maps import limit_map as limit_map
from ._network import network as network
from ._network_peak import network_peak as network_peak
from ._observer import observer as observer
from ._outcomes import CertifyCode as CertifyCode
from ._regulated import largest_regulated_current as largest_regulated_current
from ._regulated import regulated as regulated
from ._runaway import Runaway as Runaway
from ._runaway import runaway as runaway
from ._scheduled import scheduled as scheduled
from ._surroundings import claim_box as claim_box
from ._surroundings import heater_heat as heater_heat
from ._thesis import ThesisBounds as ThesisBounds
from ._thesis import thesis_bounds as thesis_bounds
from ._usable import usable_current as usable_current
from ._usable_result import CurrentBound as CurrentBound
from ._usable_result import UsableCurrent as UsableCurrent

__all__ = ["CertifyCode", "CurrentBound", "CurrentLimit", "GainBound", "Gains", "LimitMap", "Runaway", "RunawayFree",
           "ThesisBounds", "UsableCurrent", "check_certificate", "check_loop_parameters", "claim_box", "closed_loop",
           "contraction", "frequency_norm", "frequency_radius", "gains", "heater_heat", "hinf", "invariance",
           "largest_current", "largest_regulated_current", "limit_map", "loop", "network",
           "network_peak", "observer", "peak", "regulated", "runaway", "runaway_free", "scheduled", "stability",
           "thesis_bounds", "usable_current"]
