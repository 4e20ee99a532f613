"""Frequency responses and excitation signals for the command line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...identify import (
    FrequencyResponse,
    IdentifyCode,
    etfe,
    lpm,
    lrm,
    lrmp,
    mean_inputs,
    pole_sensitivity,
    spectral,
)
from ...signals import Excitation, Record, multisines
from ...thermal import System
from ._import import ReadTable, read_files
from ._reference import beside_reference, closed_loop_response, noisy_input_response, with_reference

Array = NDArray[np.float64]

_METHODS = ("etfe", "spectral", "lpm", "lrm", "lrmp")


def estimate_response(paths: Sequence[Path], *, system: System | None = None, inputs: Sequence[str] = (),
                      outputs: Sequence[str] = (), method: str = "lpm", half_width: int = 8, degree: int = 2,
                      poles: Sequence[float] = (), band: tuple[float, float] | None = None,
                      operating_point: Mapping[str, float] | None = None, tables: Sequence[ReadTable] = (),
                      reading: Mapping[Path, Sequence[ReadTable]] | None = None, reference: Sequence[str] = (),
                      instruments: Mapping[str, str] | None = None, input_noise: Mapping[str, float] | None = None,
                      pole_deviation: float | None = None, basis: Sequence[str] = ()) -> FrequencyResponse:
    """Estimate a frequency response from record files.

    Parameters
    ----------
    paths : sequence of Path
        Records of one machine, each with its own transient.
    system : System, optional
        Gives the columns, and the prescribed poles of "lrmp" when `poles` is empty.
    inputs, outputs : sequence of str
        Columns, instead of or to select from those of the system.
    method : str
        "etfe", "spectral", "lpm", "lrm" or "lrmp".
    half_width : int
        Window is 2 half_width + 1 bins (local methods).
    degree : int
        Of the local polynomials ("lpm", "lrm").
    poles : sequence of float
        Prescribed poles [rad/s] for "lrmp"; empty: those of the system, else chosen from the data.
    band : tuple of float, optional
        Frequencies to keep [Hz].
    operating_point : mapping, optional
        Heaters [unit], currents [A] and ambients [K] instead of the means of the records, one by one.
    tables : sequence
        How the files are read, from `reading_from_text`.
    reading : mapping, optional
        Tables of single files by path, besides `tables`.
    reference : sequence of str, optional
        Records of a closed loop: columns of set-points or of excitation added to the inputs, one per input. The plant
        is the response from them to the outputs over that to the inputs, by local polynomials ("lpm").
    instruments : mapping, optional
        Noisy input, as a measured room: column of a second sensor of the same quantity, in any unit ("lpm").
    input_noise : mapping, optional
        Noisy input: standard deviation of its noise [unit of the input, kelvin of ambients] ("lpm").
    pole_deviation : float, optional
        Standard deviation of the prescribed poles relative to their size, for the covariance [-] ("lrmp").
    basis : sequence of str
        Functions instead of poles, as "diffusion:held:500" ("lrmp").

    Returns
    -------
    FrequencyResponse
        Inputs that never change are left out, which a note says; `operating_point` has the means of all inputs.

    Raises
    ------
    InputError
        Unknown method, missing columns, and everything the estimators refuse.

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> from pathlib import Path
    >>> u = rt.signals.multisine(400, sample_time=1.0, seed=0, band=(0.0, 0.4), rms=1.0, periods=2)
    >>> rt.Record(sample_time=1.0, inputs=u, outputs=300 + np.cumsum(u) * 0.01, input_names=["q"],
    ...           output_names=["T"]).save("run.csv")
    >>> rt.jobs.measured.estimate_response([Path("run.csv")], inputs=["q"], outputs=["T"]).response.shape[:2]
    (1, 1)
    """
    if method not in _METHODS:
        raise InputError(f"method is {method!r}", where="--method", expected=", ".join(_METHODS))
    _one_way(method, reference, instruments, input_noise)
    if basis and (method != "lrmp" or poles or pole_deviation is not None):
        raise InputError(f"method is {method!r}" + ", with poles" * (method == "lrmp"), where="--basis",
                         expected="lrmp without poles", remedy="A pole -w is the function fractional:w:1.")
    if pole_deviation is not None and method != "lrmp":
        raise InputError(f"method is {method!r}, which has no poles", where="--pole-deviation", expected="lrmp")
    beside = list((instruments or {}).values()) or reference
    parts, references = _read(paths, system, inputs, outputs, tables, reading or {}, beside)
    chosen = [part.select(inputs=list(inputs or part.input_names), outputs=list(outputs or part.output_names))
              for part in parts]
    records, constant = _changing(chosen)
    given: Any = list(poles) if poles else system if system is not None else "auto"
    estimators = {
         "etfe": lambda: etfe(records), "spectral": lambda: spectral(records),
         "lpm": lambda: lpm(records, degree=degree, half_width=half_width),
         "lrm": lambda: lrm(records, degree=degree, half_width=half_width),
         "lrmp": lambda: (lrmp(records, half_width=half_width, basis=list(basis)) if basis else
                          lrmp(records, poles=given, half_width=half_width) if pole_deviation is None else
                          pole_sensitivity(records, given, half_width).with_uncertain_poles(pole_deviation))}
    if reference:
        G = closed_loop_response(list(zip(records, references, strict=True)), reference, degree=degree,
                                 half_width=half_width)
    elif instruments or input_noise:
        G = noisy_input_response(records, references, instruments or {}, input_noise or {}, degree=degree,
                                 half_width=half_width)
    else:
        G = estimators[method]()
    note = (f"Left out because they never change: {', '.join(constant)} ({IdentifyCode.CONSTANT_INPUT.code}).",)
    G = G.replace(notes=G.notes + (note if constant else ()),
                  operating_point=mean_inputs(parts) | dict(operating_point or {}))
    return G.between(*band) if band else G


def _one_way(method: str, reference: Sequence[str], instruments: Mapping[str, str] | None,
             input_noise: Mapping[str, float] | None) -> None:
    """A closed loop, instruments and known noise are three estimators, all by local polynomials."""
    given = [name for name, value in (("reference", reference), ("instrument", instruments),
                                      ("input-noise", input_noise)) if value]
    if len(given) > 1:
        raise InputError(f"{' and '.join(given)} are given together", where=f"--{given[1]}", expected="one of them")
    if given and method != "lpm":
        raise InputError(f"method is {method!r} with {given[0]}", where="--method", expected="lpm",
                         remedy="It is estimated by local polynomials: leave method out.")


def _read(paths: Sequence[Path], system: System | None, inputs: Sequence[str], outputs: Sequence[str],
          tables: Sequence[ReadTable], reading: Mapping[Path, Sequence[ReadTable]], reference: Sequence[str]
          ) -> tuple[list[Record], list[Array]]:
    """Parts of all files, and their references where they are asked for."""
    parts: list[Record] = []
    references: list[Array] = []
    for path in paths:
        how = (*tables, *reading.get(path, ()))
        with beside_reference(reference):
            found = _parts(path, system, inputs, outputs, how)
        if reference:
            pairs = list(with_reference(path, found, reference, how))
            found = [record for record, _ in pairs]
            references += [one for _, one in pairs]
        parts += found
    return parts, references


def _changing(records: list[Record]) -> tuple[list[Record], list[str]]:
    """Records without the inputs that are constant in all of them."""
    names = records[0].input_names if records else ()
    constant = [name for name in names if all(np.ptp(record[name]) == 0.0 for record in records)]
    if not constant:
        return records, []
    left = [name for name in names if name not in constant]
    if not left:
        raise InputError(f"no input changes: {', '.join(constant)}", where=records[0].name,
                         expected="at least one input that excites the machine", remedy="Record a step or a multisine.")
    return [record.select(inputs=left) for record in records], constant


def _parts(path: Path, system: System | None, inputs: Sequence[str], outputs: Sequence[str],
           tables: Sequence[ReadTable]) -> list[Record]:
    """Uninterrupted parts of one file, with every input that the system has."""
    if system is None:
        if not inputs or not outputs:
            raise InputError("the columns are not known", where=str(path),
                             remedy="Give --system, or --input and --output for each column.")
        return read_files([path], inputs=list(inputs), outputs=list(outputs), tables=tables)
    records = read_files([path], system, tables=tables)
    if not records[0].output_names:
        raise InputError("has no sensor column", where=str(path), expected="one of " + ", ".join(system.sensor_names))
    return records


def design_excitation(names: Sequence[str], *, period: int, sample_time: float, band: tuple[float, float],
                      amplitude: float, periods: int = 1, nonnegative: bool = False, arrangement: str = "orthogonal",
                      seed: int = 0) -> Excitation:
    """Design multisines for some inputs.

    Parameters
    ----------
    names : sequence of str
        Names of the input columns.
    period, periods : int
        Samples in a period, and how many periods.
    sample_time : float
        Time between two samples [s].
    band : tuple of float
        Lowest and highest excited frequency [Hz].
    amplitude : float
        Largest deviation from the mean [unit of the inputs].
    nonnegative : bool
        Shift the mean so that no value is negative (heaters).
    arrangement : str
        "orthogonal", "zippered" or "independent".
    seed : int
        Of the random phases.

    Returns
    -------
    Excitation

    Examples
    --------
    >>> import robthermal as rt
    >>> u = rt.jobs.measured.design_excitation(["m1", "m2"], period=2000, sample_time=1.0, band=(0.001, 0.1),
    ...                                        amplitude=0.5)
    >>> len(u.experiments)
    2
    """
    return multisines(period, inputs=len(names), sample_time=sample_time, seed=seed, band=band, amplitude=amplitude,
                      offset="nonnegative" if nonnegative else 0.0, periods=periods, phases="low_crest",
                      arrangement=arrangement)  # type: ignore[arg-type]  # checked by multisines


def write_excitation(u: Excitation, names: Sequence[str], path: Path) -> list[Path]:
    """Write every experiment as a record file; several get a number in their name.

    Parameters
    ----------
    u : Excitation
        Excitation, as `design_excitation` returns it.
    names : sequence of str
        Names of the input columns.
    path : Path
        File to write (.csv, .parquet, .mat).

    Returns
    -------
    list of Path

    Examples
    --------
    >>> from pathlib import Path
    >>> import robthermal as rt
    >>> u = rt.jobs.measured.design_excitation(["q"], period=500, sample_time=1.0, band=(0.01, 0.1), amplitude=1.0)
    >>> [p.name for p in rt.jobs.measured.write_excitation(u, ["q"], Path("u.csv"))]
    ['u.csv']
    """
    several = len(u.experiments) > 1
    written = []
    for number, signals in enumerate(u.experiments, start=1):
        file = path.with_stem(f"{path.stem}_{number}") if several else path
        Record(sample_time=u.sample_time, inputs=signals, outputs=np.zeros((len(signals), 0)), input_names=list(names),
               output_names=[]).save(file)
        written.append(file)
    return written
