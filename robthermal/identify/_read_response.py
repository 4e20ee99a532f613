"""The one reader of frequency-response files."""

from __future__ import annotations

import math
from os import PathLike

from robthermal._checks import positive_number

from ._response import FrequencyResponse
from ._response_files import load


def read_response(path: str | PathLike[str], *, sample_time: float | None = None) -> FrequencyResponse:
    """Read a frequency response: JSON, .npz or .mat of `FrequencyResponse.save`, or CSV without covariance.

    The content tells the format, not the ending.

    Parameters
    ----------
    path : str or path-like
        File to read. CSV has a header row: frequency [Hz], real, imag; or frequency [Hz], re11, im11, re12, im12, re21,
        im21, re22, im22.
    sample_time : float, optional
        Sample time of a CSV file [s], which does not say it; not a number where it is left out.

    Returns
    -------
    FrequencyResponse
        From CSV: `has_covariance` is False, the confidence radii are infinite and the outcome is
        ``frf_without_covariance``.

    Raises
    ------
    InputError
        In one line, whatever the file: no frequency response, damaged, too large, numbers that are not finite.

    Examples
    --------
    >>> from pathlib import Path
    >>> import robthermal as rt
    >>> _ = Path("G.csv").write_text("frequency [Hz],real,imag\\n1,2,-0.5\\n2,1.5,-1\\n")
    >>> G = rt.identify.read_response("G.csv", sample_time=0.1)
    >>> complex(G.response[0, 0, 1]), G.has_covariance, G.outcome.code
    ((1.5-1j), False, 'frf_without_covariance')
    """
    given = math.nan if sample_time is None else positive_number(sample_time, "sample_time", "s")
    return FrequencyResponse(**load(path, given))
