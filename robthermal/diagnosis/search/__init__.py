"""Which effects: short lists, decisions, joint selection, revision."""

from ._decide import Decision as Decision
from ._decide import decide as decide
from ._joint import JointSelection as JointSelection
from ._joint import select_jointly as select_jointly
from ._joint_check import JointCheck as JointCheck
from ._joint_check import checked_jointly as checked_jointly
from ._joint_sets import EffectSet as EffectSet
from ._joint_sets import refit_set as refit_set
from ._revise import needed as needed
from ._revise import revised as revised
from ._short_list import Entry as Entry
from ._short_list import ShortList as ShortList
from ._short_list import flails as flails
from ._short_list import quantities_of as quantities_of
from ._short_list import refit_short_list as refit_short_list
from ._told_apart import ruled_out as ruled_out
from ._told_apart import told_apart as told_apart
from ._unseen_doubts import supported as supported
from ._wider_noise import with_wider_noise as with_wider_noise

__all__ = ["Decision", "EffectSet", "Entry", "JointCheck", "JointSelection", "ShortList", "checked_jointly", "decide",
           "flails", "needed", "quantities_of", "refit_set", "refit_short_list", "revised", "ruled_out",
           "select_jointly", "supported", "told_apart", "with_wider_noise"]
