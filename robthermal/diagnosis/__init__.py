"""Where data and simulation part: locate it, name the missing effect, add it, show the gap shrink on unseen records."""

from ._adequacy import Adequacy as Adequacy
from ._adequacy import adequacy as adequacy
from ._along import Along as Along
from ._along import Response as Response
from ._catalogue import candidates as candidates
from ._catalogue import effects as effects
from ._catalogue import forget_effect as forget_effect
from ._catalogue import register_effect as register_effect
from ._decide import Decision as Decision
from ._decide import decide as decide
from ._diagnose import diagnose as diagnose
from ._diagnosis import Diagnosis as Diagnosis
from ._diagnosis import Found as Found
from ._effect import Candidate as Candidate
from ._effect import Effect as Effect
from ._effect import Quantity as Quantity
from ._hold_out import Gap as Gap
from ._hold_out import HoldOut as HoldOut
from ._hold_out import ValidationResiduals as ValidationResiduals
from ._hold_out import hold_out as hold_out
from ._joint import JointSelection as JointSelection
from ._joint import select_jointly as select_jointly
from ._joint_check import JointCheck as JointCheck
from ._joint_sets import EffectSet as EffectSet
from ._levels import Levels as Levels
from ._locate import Location as Location
from ._locate import locate as locate
from ._measurement import Measurement as Measurement
from ._next_experiment import NextExperiment as NextExperiment
from ._next_experiment import next_experiment as next_experiment
from ._noise_floor import NoiseFloor as NoiseFloor
from ._noise_floor import noise_floor as noise_floor
from ._refit import Refit as Refit
from ._refitting import refit as refit
from ._score import Scores as Scores
from ._score import score as score
from ._short_list import Entry as Entry
from ._short_list import ShortList as ShortList
from ._short_list import refit_short_list as refit_short_list
from ._unknown_heat import UnknownHeat as UnknownHeat
from ._unknown_heat import unknown_heat as unknown_heat

__all__ = ["Adequacy", "Along", "Candidate", "Decision", "Diagnosis", "Effect", "EffectSet", "Entry", "Found",
           "Gap", "HoldOut", "JointCheck", "JointSelection", "Levels", "Location", "Measurement", "NextExperiment",
           "NoiseFloor", "Quantity", "Refit", "Response", "Scores", "ShortList", "UnknownHeat", "ValidationResiduals",
           "adequacy", "candidates", "decide", "diagnose", "effects", "forget_effect", "hold_out", "locate",
           "next_experiment", "noise_floor", "refit", "refit_short_list", "register_effect", "score", "select_jointly",
           "unknown_heat"]
