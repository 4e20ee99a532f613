"""The next experiment: inputs that separate what the records could not."""

from ._measurement import Measurement as Measurement
from ._next_experiment import NextExperiment as NextExperiment
from ._next_experiment import next_experiment as next_experiment
from ._next_experiment import rivals as rivals
from ._resolving import Resolving as Resolving
from ._resolving import resolving as resolving
from ._trial_conditions import trial_conditions as trial_conditions

__all__ = ["Measurement", "NextExperiment", "Resolving", "next_experiment", "resolving", "rivals", "trial_conditions"]
