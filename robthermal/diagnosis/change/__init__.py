"""What changed between two days: the scatter of healthy records, changes of parameters, and their yardstick."""

from ._convective import Convection as Convection
from ._convective import convection_of as convection_of
from ._excess import Excess as Excess
from ._excess import excess_of as excess_of
from ._held import Held as Held
from ._other_inputs import other_inputs as other_inputs
from ._parameter_change import NAME as NAME
from ._parameter_change import SIZE as SIZE
from ._parameter_change import parameter_changes as parameter_changes
from ._parameter_change import place_of as place_of
from ._parameter_change import relative as relative
from ._reference import Reference as Reference
from ._reference import held as held
from ._reference import pinned as pinned
from ._reference import reference_of as reference_of
from ._scatter import random_effects as random_effects
from ._search import Search as Search
from ._search import searched as searched
from ._steady import unsteady as unsteady
from ._visible import Visible as Visible
from ._visible import visible_changes as visible_changes
from ._yardstick import effective_number as effective_number

__all__ = ["Convection", "Excess", "Held", "NAME", "Reference", "SIZE", "Search", "Visible", "convection_of",
           "effective_number", "excess_of", "held", "other_inputs", "parameter_changes", "pinned", "place_of",
           "random_effects", "reference_of", "relative", "searched", "unsteady", "visible_changes"]
