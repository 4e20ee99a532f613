"""Mean period of a periodic experiment, and the noise that is left in its measured inputs."""

from __future__ import annotations

import numpy as np

from robthermal.errors import InputError
from robthermal.signals import Record

from .._checks import whole_number
from ._records import as_records

_EXACT = 1e-9  # scatter relative to the size of the input below which it is rounding


def mean_period(record: Record, period: int) -> tuple[Record, dict[str, float]]:
    """Average the periods of a record, and tell what noise its inputs carry from what differs between the periods.

    Of P periods the mean square of the deviations from the mean period, times 1/(P - 1), is the variance of the noise
    of the mean. `errors_in_variables` takes both: what is left of the noise does no harm then, however few the periods.

    Parameters
    ----------
    record : Record
        Record whose inputs repeat, also the room (a climate chamber), at least two periods long.
    period : int
        Samples in a period [-]. Samples before the last whole number of periods are left out.

    Returns
    -------
    mean : Record
        One period. A transient that is left in the record is in it too, as smooth over the bins as before.
    noise : dict
        Input: standard deviation of the noise of its mean [unit of the input]. Inputs that repeat to rounding are left
        out.

    Raises
    ------
    InputError
        For a period that does not fit twice.

    References
    ----------
    Pintelon and Schoukens (2012), System Identification, Sec. 9.2 and 10.2 (noise from periodic measurements).

    Examples
    --------
    >>> import numpy as np
    >>> import robthermal as rt
    >>> rng = np.random.default_rng(0)
    >>> room = np.tile(rng.normal(size=500), 9)
    >>> record = rt.Record(sample_time=1.0, inputs=room + 0.3 * rng.normal(size=4500), outputs=2 * room,
    ...                    input_names=["room"], output_names=["T"])
    >>> mean, noise = rt.identify.mean_period(record, 500)
    >>> len(mean), round(noise["room"], 2)  # 0.3/sqrt(9)
    (500, 0.1)
    >>> G = rt.identify.errors_in_variables(mean, noise=noise, half_width=20)
    >>> round(float(abs(G.response.mean())), 1)
    2.0
    """
    one, n = as_records(record)[0], whole_number(period, "period", least=2)
    if not isinstance(record, Record):
        raise InputError("several records", where="record", expected="one", remedy="Average them one by one.")
    count = len(one) // n
    if count < 2:
        raise InputError(f"a period of {n} samples fits {count} times into {len(one)} samples", where="period",
                         expected="at least two periods")
    folded = one.inputs[-count * n:].reshape(count, n, -1)
    inputs = folded.mean(axis=0)
    scatter = np.sqrt(np.sum((folded - inputs) ** 2, axis=(0, 1)) / ((count - 1) * n * count))
    size = np.abs(one.inputs).max(axis=0)
    noise = {name: float(value) for name, value, largest in zip(one.input_names, scatter, size, strict=True)
             if value > _EXACT * largest}
    mean = Record(sample_time=one.sample_time, inputs=inputs,
                  outputs=one.outputs[-count * n:].reshape(count, n, -1).mean(axis=0), input_names=one.input_names,
                  output_names=one.output_names, name=one.name)
    return mean, noise
