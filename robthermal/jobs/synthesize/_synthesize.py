"""Run the synthesis that a plant file asks for, and check its certificates again."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..._checks import quoted
from ...design import (
    Design,
    anti_windup,
    frf_pid,
    h2,
    hinf,
    lpv,
    mixed,
    mpc,
    mu_synthesis,
    output_feedback,
    polytopic_feedback,
    tem_feedback,
)
from ...errors import InputError
from ...verification import Certificate, verify
from ..claims import Checked, loop_title, measure_of
from ._file import SynthesisJob
from ._methods import METHODS


def _lpv(plants: Sequence[Any], n_meas: int, n_ctrl: int, *, scheduling: Mapping[str, Sequence[float]],
         rates: Mapping[str, float] | None = None, gamma: float | None = None) -> Design:
    """`lpv` with its scheduling among the keys of table [design]."""
    return lpv(plants, scheduling, n_meas, n_ctrl, rates=rates, gamma=gamma)


_VERBS: dict[str, Callable[..., Design]] = {"hinf": hinf, "h2": h2, "mixed": mixed, "mu": mu_synthesis,
                                           "output-feedback": output_feedback, "frf-pid": frf_pid,
                                           "polytope": polytopic_feedback, "lpv": _lpv, "tem": tem_feedback,
                                           "anti-windup": anti_windup, "mpc": mpc}


@dataclass(frozen=True)
class Synthesis:
    """A design with its certificates checked again.

    Parameters
    ----------
    job : SynthesisJob
        What was asked for.
    method : str
        One of `METHODS`.
    design : Design
        What was found.
    checked : tuple of Checked
        Certificates with their independent checks.
    """

    job: SynthesisJob
    method: str
    design: Design
    checked: tuple[Checked, ...]


def synthesize_plant(job: SynthesisJob, method: str) -> Synthesis:
    """Design the controller that a plant file asks for.

    Parameters
    ----------
    job : SynthesisJob
        Plant or response and arguments, as `read_plant_file` returns them.
    method : str
        One of `METHODS`.

    Returns
    -------
    Synthesis

    Raises
    ------
    InputError
        Unknown method or arguments, [frf] for a method that needs a plant; what the synthesis refuses.

    Examples
    --------
    >>> from pathlib import Path
    >>> import robthermal as rt
    >>> _ = Path("plant.toml").write_text("[plant]\\nA = [[1.0]]\\nB = [[1.0, 0.0, 1.0]]\\nC = [[1.0], [0.0], [1.0]]\\n"
    ...     "D = [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]]\\nn_meas = 1\\nn_ctrl = 1\\n")
    >>> rt.jobs.synthesize_plant(rt.jobs.read_plant_file("plant.toml"), "hinf").design.holds
    True
    """
    if method not in _VERBS:
        raise InputError(f"method = {quoted(method)}", where="--method", expected=f"one of {list(METHODS)}")
    verb, given = _VERBS[method], _first(job, method)
    allowed = [name for name, one in inspect.signature(verb).parameters.items() if one.kind is one.KEYWORD_ONLY]
    if method == "mu":  # blocks is its last positional argument
        allowed = ["blocks", *allowed]
    unknown = [name for name in job.arguments if name not in allowed]
    if unknown:
        raise InputError(f"unknown key {quoted(unknown[0])}", where=f"{job.files[0]} [design]",
                         expected=f"arguments of {method}: {', '.join(allowed)}")
    missing = [name for name, one in inspect.signature(verb).parameters.items()
               if name in allowed and one.default is one.empty and name not in job.arguments]
    if missing:
        raise InputError(f"key design.{missing[0]} is missing", where=f"{job.files[0]} [design]",
                         expected=f"arguments of {method}: {', '.join(allowed)}")
    try:
        design = verb(*given, **job.arguments)
    except InputError as error:
        raise _in_file(error, job) from None
    return Synthesis(job, method, design, tuple(_check(k, one) for k, one in enumerate(design.certificates)))


def _in_file(error: InputError, job: SynthesisJob) -> InputError:
    """The error of a verb, which names its arguments, with the table of the file that they come from."""
    name = re.match(r"(?:argument )?(\w+)", error.where)
    word = name.group(1) if name else ""
    tables = {"P": "plant", "plant": "plant", "plants": "plant", "n_meas": "plant", "n_ctrl": "plant",
              "K": "controller", "G": "frf", "system": "system", **dict.fromkeys(job.arguments, "design")}
    if word not in tables:
        return error
    where = f"{job.files[0]} [{tables[word]}]" + (f" {word}" if tables[word] == "design" else "")
    return InputError(error.what, where=where, expected=error.expected, remedy=error.remedy)


def _check(k: int, certificate: Certificate) -> Checked:
    verdict = verify(certificate) if certificate.holds else None
    return Checked(f"{k + 1}_{measure_of(certificate)}", loop_title(certificate), certificate, verdict, True)


def _first(job: SynthesisJob, method: str) -> tuple[Any, ...]:
    if method == "frf-pid":
        return (job.plant if job.response is None else job.response,)
    if method == "tem":
        if job.system is None:
            raise InputError("method tem needs a thermal system", where=f"{job.files[0]}",
                             expected="a table [system] with file and box")
        return (job.system,)
    if method == "lpv":
        if not job.plants:
            raise InputError("method lpv needs plants at vertices", where=f"{job.files[0]}",
                             expected="a table [plant] with vertices, n_meas and n_ctrl")
        return list(job.plants), job.n_meas, job.n_ctrl
    if method == "polytope" and (job.plants or job.plant is not None):
        return list(job.plants) or [job.plant], job.n_ctrl
    if job.plant is None:
        raise InputError(f"method {method} needs a plant", where=f"{job.files[0]}", expected="a table [plant]",
                         remedy="A measured response is designed for with --method frf-pid.")
    if method == "mpc":
        return (job.plant,)
    if method == "anti-windup":
        if job.controller is None:
            raise InputError("method anti-windup needs the controller", where=f"{job.files[0]}",
                             expected="a table [controller] with A, B, C, D")
        return job.plant, job.controller
    if not job.n_meas:
        raise InputError("key plant.n_meas is missing", where=f"{job.files[0]}", expected="number of measurements")
    return job.plant, job.n_meas, job.n_ctrl
