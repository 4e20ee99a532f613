"""Which effects: short lists, decisions, joint selection, revision."""

from ._contradicted import without_contradicted as without_contradicted
from ._decide import Accepted as Accepted
from ._decide import Decision as Decision
from ._decide import decide as decide
from ._implausible import implausible_names as implausible_names
from ._joint import JointSelection as JointSelection
from ._joint import select_jointly as select_jointly
from ._joint_check import JointCheck as JointCheck
from ._joint_check import checked_jointly as checked_jointly
from ._joint_sets import EffectSet as EffectSet
from ._joint_sets import refit_set as refit_set
from ._neighbors import ALIKE as ALIKE
from ._neighbors import MASSES as MASSES
from ._neighbors import one_place as one_place
from ._neighbors import with_neighbors as with_neighbors
from ._other_end import with_other_end as with_other_end
from ._other_law import other_laws as other_laws
from ._other_thermometer import heats_instead as heats_instead
from ._other_thermometer import other_thermometers as other_thermometers
from ._periods import between_trials as between_trials
from ._periods import other_periods as other_periods
from ._places import resolve_places as resolve_places
from ._resolve_alternatives import resolve_alternatives as resolve_alternatives
from ._resolve_alternatives import ruled_out as ruled_out
from ._revise import needed as needed
from ._revise import revised as revised
from ._revise import without as without
from ._short_list import Entry as Entry
from ._short_list import ShortList as ShortList
from ._short_list import beside as beside
from ._short_list import delta_bic as delta_bic
from ._short_list import leaves_large_misfit as leaves_large_misfit
from ._short_list import quantities_of as quantities_of
from ._short_list import refit_short_list as refit_short_list
from ._slow_thermometer import from_slow_thermometer as from_slow_thermometer
from ._stages import accept as accept
from ._stages import begin as begin
from ._stages import compare as compare
from ._stages import exchange as exchange
from ._stages import reconsider as reconsider
from ._stages import refit_candidates as refit_candidates
from ._stages import revise as revise
from ._stages import shortlist as shortlist
from ._stages import validate as validate
from ._state import SearchState as SearchState
from ._wider_noise import with_wider_noise as with_wider_noise

__all__ = ["ALIKE", "MASSES", "Accepted", "Decision", "EffectSet", "Entry", "JointCheck", "JointSelection",
           "SearchState", "ShortList", "accept", "begin", "beside", "between_trials", "checked_jointly", "compare",
           "decide", "delta_bic", "exchange", "from_slow_thermometer", "heats_instead", "implausible_names",
           "leaves_large_misfit", "needed", "one_place", "other_laws", "other_periods", "other_thermometers",
           "quantities_of", "reconsider", "refit_candidates", "refit_set", "refit_short_list", "resolve_alternatives",
           "resolve_places", "revise", "revised", "ruled_out", "select_jointly", "shortlist", "validate",
           "with_neighbors", "with_other_end", "with_wider_noise", "without", "without_contradicted"]
