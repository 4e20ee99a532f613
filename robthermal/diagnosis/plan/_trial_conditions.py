"""What a planned record has in common with the present data: sampling, sensors, start and noise."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...fitting import Initial
from ...signals import Record
from ...thermal import System, steady_state
from ..data import NoiseEstimate, RecordData, records_of, responses_of
from ..fit import NoiseScaling, Refit, Structure

_MOST = 2000  # samples planned: the present record may have ten thousand, that of a response a million


@dataclass(frozen=True, eq=False)
class TrialConditions:
    """Where a trial is run.

    Parameters
    ----------
    one : RecordData
        Its sensors, its number of samples, and the inputs that cannot be chosen.
    place : int or None
        Of the present record that it continues; None after frequency responses.
    floor : NoiseEstimate
        Of its sensors.
    levels : NoiseScaling
        Factors on it.
    """

    one: RecordData
    place: int | None
    floor: NoiseEstimate
    levels: NoiseScaling

    def start(self, structure: Structure, system: System) -> Initial:
        """Prior of the initial temperatures."""
        return self.one.initial(system, "free") if self.place is None else structure.starts[self.place]


def trial_conditions(fit: Refit) -> TrialConditions | None:
    """As the first record; after frequency responses, as their record was, if the system declares sensor noise.

    As many samples as that has had, 2000 at most: a search that needs more prolongs its best trial.
    """
    for one in records_of(fit.structure.data):
        return TrialConditions(one.first(_MOST), fit.structure.data.index(one), fit.floor, fit.levels)
    first, system = responses_of(fit.structure.data)[0], fit.system
    noise = {name: sensor.noise for name, sensor in system.thermometers.items() if sensor.noise}
    found = steady_state(system, first.operating_point)
    if not noise or not found.equilibria:
        return None
    n = min(first.response.n_samples, _MOST)
    nominal = {name: ambient.temperature for name, ambient in system.ambients.items()}
    held = [first.operating_point.get(name, nominal.get(name, 0.0)) for name in system.exogenous_names]
    seen = [found.equilibria[0].temperatures[system.sensors[name].lump] for name in noise]
    record = Record(sample_time=first.response.sample_time * first.response.n_samples / n, inputs=np.tile(held, (n, 1)),
                    outputs=np.tile(seen, (n, 1)), input_names=list(system.exogenous_names), output_names=list(noise))
    one = RecordData(record, tuple(noise), np.array([system.sensor_names.index(name) for name in noise], np.intp),
               record.outputs)
    heat = {name: lump.disturbance for name, lump in system.lumps.items()}
    return TrialConditions(one, None, replace(fit.floor, noise=noise, disturbance=heat), NoiseScaling(1.0, {}))
