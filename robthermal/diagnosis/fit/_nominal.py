"""Stage 2: refit the nominal system to the records with its priors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ...errors import Diverged, InputError
from ...fitting import NONE, Choice, chosen_ranges
from ...thermal import System
from ..data import Measured, NoiseEstimate, as_measured, noise_floor, records_of, without_outliers
from ._exchanged import with_exchanged_lags
from ._noise_scaling import NoiseScaling
from ._refit import Refit
from ._refitting import extended, fitted
from ._sessions import SessionGain, sessions_of, with_late_means
from ._structure import structure_of
from ._unknown_ambients import with_unknown_ambients


def refit(system: System, records: Measured | Sequence[Measured], floor: NoiseEstimate | None = None, *,
          parameters: Choice = None, operating_point: Mapping[str, float] | None = None,
          session_gain: SessionGain = False, near: Refit | None = None) -> Refit:
    """Refit the nominal parameters and the initial temperatures to the records, with their priors.

    Parameters
    ----------
    system : System
        Nominal. `sigma` in its fit table are the priors.
    records : Record, FrequencyResponse, or list of them
        Measured data to fit.
    floor : NoiseEstimate, optional
        Noise of the data, from `noise_floor`.
    parameters : iterable or mapping, optional
        As in `rt.calibrate`. Default: the fit table; without one, all parameters are taken as known.
    operating_point : mapping, optional
        For frequency responses: mean heaters [unit], module currents [A] and ambients [K] of the experiment; default
        off and nominal.
    session_gain : bool or mapping
        Whether every record has a gain of its own of every heater and module: True, with a prior of 5 %, or a mapping
        from input to the standard deviation of its gain [-].
    near : Refit, optional
        Fit of the same parameters to much the same records: it starts from theirs.

    Returns
    -------
    Refit

    Raises
    ------
    InputError
        As `noise_floor`; a nominal model that runs away; priors that contradict the bounds.

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 100.0}},
    ...                 links=[{"between": ("bar", "room"), "conductance": 0.5}], inputs={"heater": {"lump": "bar"}},
    ...                 sensors={"T": {"lump": "bar", "noise": 0.05}})
    >>> heater = np.repeat([4.0, 0.0, 6.0, 2.0], 50)
    >>> drive = rt.Record(sample_time=10.0, inputs=heater, outputs=np.zeros((200, 0)), input_names=["heater"],
    ...                   output_names=[])
    >>> run = rt.thermal.simulate(bar, drive)
    >>> noisy = run.with_outputs(run.outputs + 0.05 * np.random.default_rng(1).standard_normal((200, 1)))
    >>> fit = rt.diagnosis.refit(bar, noisy, parameters={"lumps.bar.capacity": (10.0, 500.0)})
    >>> 0.8 < fit.variance < 1.2
    True
    """
    floor = noise_floor(system, records) if floor is None else floor
    data = without_outliers(system, as_measured(system, records, "records", operating_point), floor.noise)
    ranges = chosen_ranges(system, parameters) if parameters is not None or system.fit else NONE
    starts = [one.initial(system, "free") for one in data]
    sessions = with_unknown_ambients(sessions_of(system, session_gain), system, records_of(data), ranges.flat)
    sessions = with_late_means(sessions, records_of(data))
    structure = structure_of(system, ranges, data, starts, sessions)
    n_unknown = structure.n_parameters + structure.n_own
    if structure.n_readings <= 2 * n_unknown:
        raise InputError(f"{structure.n_readings} readings for {n_unknown} unknowns", where="argument records",
                         expected="more than two readings per unknown", remedy="Measure longer, or fix parameters.")
    try:
        start = ranges.start if near is None else ranges.values(near.v[:len(ranges.names)])
        found = fitted(structure, structure.start(start, []), floor, NoiseScaling(1.0, {}))
        found = found if structure.at_rest().n_own == structure.n_own else extended(found, structure, found.v)
        return with_exchanged_lags(found)
    except Diverged as error:
        raise InputError(f"the nominal model runs away: {error}", where="argument system",
                         remedy="Correct it first; nothing can be diagnosed on a model that leaves all data.") from None
