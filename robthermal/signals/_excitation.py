"""Multisines for several inputs: orthogonal over experiments, zippered or independent within one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
import scipy
from numpy.typing import ArrayLike

from .._checks import whole_number
from ..errors import InputError
from ._checks import Array, positive_number
from ._crest import crest_of, schroeder_phases, wave_of
from ._excitation_set import Excitation
from ._excitation_settings import Lines, given_lines, line_amplitudes, one_of, per_input, scaled, shifted
from ._multisine import chosen_phases


def multisines(
    period: int,
    *,
    inputs: int,
    sample_time: float,
    seed: int,
    arrangement: Literal["orthogonal", "zippered", "independent"] = "orthogonal",
    band: tuple[float, float] | None = None,
    lines: Sequence[int] | None = None,
    rms: float | Sequence[float] | None = None,
    amplitude: float | Sequence[float] | None = None,
    offset: float | Literal["nonnegative"] | Sequence[float | Literal["nonnegative"]] = 0.0,
    periods: int = 1,
    spectrum: Literal["linear", "logarithmic"] | ArrayLike = "linear",
    phases: Literal["random", "schroeder", "low_crest"] = "random",
    realizations: int = 1,
) -> Excitation:
    """Multisines for all inputs of a machine, all experiments and realizations.

    Parameters
    ----------
    period : int
        Length of one period [samples].
    inputs : int
        Number of inputs [-].
    sample_time : float
        Time between two samples [s].
    seed : int
        Of the random phases.
    arrangement : {"orthogonal", "zippered", "independent"}, optional
        "orthogonal": as many experiments as inputs; at every line the inputs of the experiments form an orthogonal
        matrix (Hadamard where the number of inputs is a power of two, else DFT). "zippered": one experiment, every
        line excites one input, in turn. "independent": one experiment, every input has all lines and its own phases.
    band : (float, float), optional
        Lowest and highest frequency [Hz]. Give this or `lines`.
    lines : sequence of int, optional
        Numbers of the excited lines, from 1 to below period / 2.
    rms : float or sequence of float, optional
        Standard deviation, for all inputs or one per input, in their units. Give this or `amplitude`.
    amplitude : float or sequence of float, optional
        Largest deviation from the mean over all experiments and realizations, in the units of the inputs.
    offset : float or "nonnegative", or a sequence of them, optional
        Mean, in the units of the inputs; "nonnegative" is the smallest mean for which no value of the input is below
        zero in any experiment, so that all share one operating point.
    periods : int, optional
        How often the period is repeated.
    spectrum : {"linear", "logarithmic"} or array_like, optional
        As in `multisine`.
    phases : {"random", "schroeder", "low_crest"}, optional
        As in `multisine`. With several inputs or realizations only "random" and "low_crest" tell them apart.
    realizations : int, optional
        How many independent draws of the phases.

    Returns
    -------
    Excitation

    Raises
    ------
    InputError
        As `multisine`; fewer lines than inputs when zippered; Schroeder phases for several independent inputs or
        realizations, which would all be the same.

    References
    ----------
    T. P. Dobrowiecki, J. Schoukens and P. Guillaume, Optimized excitation signals for MIMO frequency response function
    measurements, IEEE Trans. Instrum. Meas. 55 (2006) 2072-2079.

    Examples
    --------
    >>> import robthermal as rt
    >>> heat = rt.signals.multisines(600, inputs=2, sample_time=1.0, band=(0.0, 0.05), amplitude=5.0,
    ...                              offset="nonnegative", phases="low_crest", seed=1)
    >>> [u.shape for u in heat.experiments]
    [(600, 2), (600, 2)]
    >>> bool((heat.crest_factors < heat.schroeder_crest_factors).all())
    True
    """
    n, n_u = whole_number(period, "period", 3), whole_number(inputs, "inputs", 1)
    R, repeats = whole_number(realizations, "realizations", 1), whole_number(periods, "periods", 1)
    h = positive_number(sample_time, "sample_time", "s")
    excited = given_lines(band, lines, n, h)
    amplitudes = line_amplitudes(spectrum, excited)
    _check_arrangement(arrangement, phases, n_u, R, excited)
    rng = np.random.default_rng(whole_number(seed, "seed", 0))
    random = rng.uniform(0.0, 2.0 * np.pi, (R, n_u, excited.size))
    turns = _experiment_phases(n_u) if arrangement == "orthogonal" else np.zeros((1, n_u))
    signals = np.empty((R, len(turns), n, n_u))
    parts, schroeder = [], np.empty(n_u)
    own_rms, own_amplitude = per_input(rms, "rms", n_u), per_input(amplitude, "amplitude", n_u)
    own_offset = per_input(offset, "offset", n_u)
    for i in range(n_u):
        part = slice(i, None, n_u) if arrangement == "zippered" else slice(None)
        mine, sizes = excited[part], amplitudes[part]
        base = np.array([chosen_phases(phases, mine, sizes, one[i, part], n, turns[:, i]) for one in random])
        waves = wave_of(mine, sizes, base[:, None, :] + turns[:, i, None], n)
        signals[..., i] = shifted(scaled(waves, own_rms[i], own_amplitude[i]), own_offset[i])
        schroeder[i] = crest_of(wave_of(mine, sizes, schroeder_phases(mine, sizes), n))
        parts.append(mine)
    return Excitation(
        signals=np.tile(signals, (1, 1, repeats, 1)),
        lines=tuple(parts),
        period=n,
        sample_time=h,
        arrangement=arrangement,
        phases=phases,
        schroeder_crest_factors=schroeder,
    )


def _check_arrangement(arrangement: object, phases: object, n_u: int, realizations: int, lines: Lines) -> None:
    word = one_of(arrangement, "arrangement", ("orthogonal", "zippered", "independent"))
    if word == "zippered" and lines.size < n_u:
        raise InputError(
            f"{lines.size} lines for {n_u} zippered inputs",
            where="argument lines",
            expected="at least one line per input",
            remedy="Widen the band, or lengthen the period.",
        )
    if phases == "schroeder" and (realizations > 1 or (word == "independent" and n_u > 1)):
        raise InputError(
            "Schroeder phases are the same for every input and realization",
            where="argument phases",
            expected="'random' or 'low_crest' for several realizations or independent inputs",
        )


def _experiment_phases(n_u: int) -> Array:
    """Phases [rad] added to input i in experiment e, (n_u, n_u): e^j of them is an orthogonal matrix."""
    power_of_two = n_u & (n_u - 1) == 0
    # Hadamard: experiments differ by signs only, which leaves every crest factor as it is.
    return np.angle(scipy.linalg.hadamard(n_u) if power_of_two else scipy.linalg.dft(n_u))
