"""Measured plants of a coupling file: frequency responses of one subsystem each, or of both together."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from ...errors import InputError, Outcome
from ...identify import FrequencyResponse, read_response
from .._outcomes import JobsCode

CIRCLES_LEFT_OUT = JobsCode.CIRCLES_LEFT_OUT.outcome()


def plants_from_pairs(first: list[Path], second: list[Path], dt: float) -> tuple[FrequencyResponse, ...]:
    """Diagonal 2x2 plants, the k-th file of each list one machine position.

    Parameters
    ----------
    first, second : list of Path
        Files of the subsystems, one input and one output each.
    dt : float
        Sample time of the loops [s]; CSV files do not say theirs.
    """
    return tuple(_diagonal(_read(one, dt, (1, 1)), _read(two, dt, (1, 1)), one, two)
                 for one, two in zip(first, second, strict=True))


def plants_from_whole(files: list[Path], dt: float, shape: tuple[int, int]) -> tuple[FrequencyResponse, ...]:
    """Plants of both subsystems, one file each.

    Parameters
    ----------
    files : list of Path
        Files with the inputs and outputs of both.
    dt : float
        Sample time of the loops [s]; CSV files do not say theirs.
    shape : tuple of int
        Outputs and inputs of both subsystems together.
    """
    return tuple(_read(file, dt, shape) for file in files)


def plant_remarks(measured: Sequence[FrequencyResponse], names: Sequence[str], circles: bool) -> Iterator[Outcome]:
    """What the claims about the measured plants leave out.

    Parameters
    ----------
    measured : sequence of FrequencyResponse
        Plants of all machine positions.
    names : sequence of str
        Files of each, for the text.
    circles : bool
        Whether confidence circles are to be in the envelope.
    """
    bare = [name for plant, name in zip(measured, names, strict=True) if not plant.has_covariance]
    if bare:
        listed = ", ".join(bare[:3]) + (f" and {len(bare) - 3} more" if len(bare) > 3 else "")
        yield JobsCode.FRF_WITHOUT_COVARIANCE.outcome(
            f"Responses without covariance: {listed}. The envelope holds their values without the noise of the "
            "measurement.")
    if len(bare) < len(measured) and not circles:
        yield CIRCLES_LEFT_OUT


def _read(path: Path, dt: float, wanted: tuple[int, int]) -> FrequencyResponse:
    found = read_response(path, sample_time=dt or None)
    shape = len(found.output_names), len(found.input_names)
    if shape != wanted:
        raise InputError(f"is a response with {shape[0]} outputs and {shape[1]} inputs", where=str(path),
                         expected=f"{wanted[0]} of each" if wanted[0] == wanted[1] else
                         f"{wanted[0]} outputs and {wanted[1]} inputs",
                         remedy="Files of frf hold both subsystems, those of frf_1 and frf_2 one each; robthermal frf "
                                "--input --output chooses the columns.")
    return found


def _diagonal(one: FrequencyResponse, two: FrequencyResponse, first: Path, second: Path) -> FrequencyResponse:
    """Two subsystems measured by themselves as one plant; where one has no covariance the pair has none."""
    if len(one) != len(two) or not np.allclose(one.frequencies, two.frequencies, rtol=1e-9, atol=0.0):
        raise InputError(f"its frequencies differ from those of {first.name!r}", where=str(second),
                         expected="the same frequencies in both files of a machine position")
    times = [G.sample_time for G in (one, two) if not np.isnan(G.sample_time)]
    if len(times) == 2 and not np.isclose(times[0], times[1], rtol=1e-6):
        raise InputError(f"its sample time is {times[1]:g} s, that of {first.name!r} {times[0]:g} s",
                         where=str(second), expected="one sample time", remedy="Measure both at one rate.")
    n_f = len(one)
    response, noise = np.zeros((2, 2, n_f), dtype=complex), np.zeros((2, 2, n_f), dtype=complex)
    covariance = np.zeros((4, 4, n_f), dtype=complex)  # entries of the columns of G: 11, 21, 12, 22
    ratio = np.zeros((2, 2, n_f))
    for k, G in enumerate((one, two)):
        response[k, k], noise[k, k], covariance[3 * k, 3 * k] = G.response, G.noise_covariance, G.covariance
        if G.ratio_uncertainty is not None:
            ratio[k, k] = G.ratio_uncertainty
    known = one.has_covariance and two.has_covariance
    freedom = np.minimum(one.degrees_of_freedom, two.degrees_of_freedom)  # fewer: a wider circle
    notes = tuple(dict.fromkeys((*one.notes, *two.notes)))
    return FrequencyResponse(
        frequencies=one.frequencies, response=response, noise_covariance=noise,
        covariance=covariance if known else np.full_like(covariance, np.nan),
        degrees_of_freedom=freedom if known else np.zeros(n_f), suspect=one.suspect | two.suspect,
        ratio_uncertainty=ratio, input_names=("u1", "u2"), output_names=("y1", "y2"),
        sample_time=times[0] if times else np.nan, n_samples=min(one.n_samples, two.n_samples),
        half_width=max(one.half_width, two.half_width), method=f"{one.method}; {two.method}", notes=notes)
