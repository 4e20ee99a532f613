"""Report and files of a synthesis."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ..._pandas import pd
from ...design import AntiWindupDesign, FeedbackDesign, MpcDesign
from ...export import plain
from ...report import Claim, Reason, Report, Section, Table
from ..claims import ARITHMETIC, GateCode, claim_of, kind_assumptions, machine_assumptions
from ..evidence import write_certification
from ..folder import output_folder
from ..now import now
from ..provenance import provenance
from ._first_screen import first_screen, numbers_of
from ._synthesize import Synthesis

_ASSUMED = ("Plant and controller are linear and do not vary with time; no actuator saturates.",
            "Certificates speak of the floating-point numbers of plant and controller in their files.")
_SATURATED = ("Plant and controller are linear and do not vary with time, but for actuators that saturate at once.",)
_SOLVED = ("The plant moves as the sampled matrices say; disturbances are not covered.",
           "The quadratic program of every sample is solved; what its solver returns is checked in floats only.")
_TITLES = {"hinf": "H-infinity controller", "h2": "H2 controller", "mixed": "Mixed H2 and H-infinity controller",
           "mu": "Controller by D-K iteration", "output-feedback": "Controller of fixed order",
           "frf-pid": "PID from a frequency response", "polytope": "State feedback for a polytope of plants",
           "lpv": "Scheduled controller", "tem": "Current law for thermoelectric modules",
           "anti-windup": "Anti-windup compensator", "mpc": "Predictive controller"}


def write_synthesis(result: Synthesis, out: str | Path) -> Report:
    """Write a synthesis into a folder, which appears only when complete.

    Parameters
    ----------
    result : Synthesis
        Synthesis, as `synthesize_plant` returns it.
    out : str or Path
        Output folder: design.json, controller.c and .h of a sampled controller, report.html, junit.xml, summary.json,
        ``certificates/*.json``.

    Returns
    -------
    Report

    Raises
    ------
    InputError
        If the folder cannot be written, or holds something else.

    Examples
    --------
    >>> from pathlib import Path
    >>> import robthermal as rt
    >>> _ = Path("plant.toml").write_text("[plant]\\nA = [[1.0]]\\nB = [[1.0, 0.0, 1.0]]\\nC = [[1.0], [0.0], [1.0]]\\n"
    ...     "D = [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]]\\nn_meas = 1\\nn_ctrl = 1\\n")
    >>> done = rt.jobs.synthesize_plant(rt.jobs.read_plant_file("plant.toml"), "h2")
    >>> rt.jobs.write_synthesis(done, "controller").verdict
    'PASS'
    """
    design = result.design
    data = {"synthesis": {"method": result.method, "value": plain(design.value), "lower": plain(design.lower),
                          "margins": plain(design.margins), "code": design.outcome.code}}
    report = Report(title=_TITLES[result.method], subtitle=_subtitle(result), label="",
                    claims=tuple(_claims(result)), first=first_screen(design), numbers=tuple(numbers_of(design)),
                    sections=(_section(result),), kind="Controller design report",
                    provenance=provenance(result.job.files), assumptions=_assumed(result), generated=now(),
                    gate=tuple(_remarks(result)), gates=(GateCode.AT_THE_BINS.code,), data=data)
    with output_folder(out) as folder:
        report = write_certification(result.checked, report, folder)
        for name in ("design.json", *(("controller.c", "controller.h") if design.has_source else ())):
            design.export(folder / name)
    return report


def _assumed(result: Synthesis) -> tuple[str, ...]:
    if result.method == "anti-windup":
        return (*_SATURATED, _ASSUMED[1], ARITHMETIC)
    if result.method == "mpc":
        return (*kind_assumptions("ellipsoid"), *_SOLVED, ARITHMETIC)
    if result.job.plants:
        return (*kind_assumptions("polytope"), _ASSUMED[1], ARITHMETIC)
    if result.job.system is None:
        return (*_ASSUMED, ARITHMETIC)
    ranges = "covariance" in result.job.arguments
    return (*kind_assumptions("scheduled"), *machine_assumptions(result.job.system, ranges))


def _remarks(result: Synthesis) -> Iterator[Reason]:
    if result.design.holds and not result.checked:
        code = GateCode.AT_THE_BINS
        yield Reason("remark", code.code, "design", "response", code.meaning, code.remedy)


def _claims(result: Synthesis) -> Iterator[Claim]:
    design = result.design
    if not design.holds:
        yield Claim("What was asked for", "The controller reaches what was asked for.", False, None,
                    box="the plant of the file", margin="none", how="See the sections below.",
                    reason=design.outcome.text)
    elif not result.checked:  # at the bins of a response: a test, not a proof
        yield Claim("Margin at the bins", design.robust_against.text, True, None, box="the bins of the response",
                    margin=f"sensitivity at most {design.value:.4g}", how=design.method, tested=True)
    for one in result.checked:
        yield claim_of(one.file, one.certificate, one.verdict)


def _reached(result: Synthesis) -> str:
    if not result.design.holds:
        return "Nothing is proven."
    if isinstance(result.design, FeedbackDesign) and result.design.rate > 0:
        words = [f"rate {result.design.rate:.6g}"]
        words += [f"{one.title} below {one.certificate.region['bound']:.6g}" for one in result.checked
                  if "bound" in one.certificate.region]
        return f"Proven: {', '.join(words)}."
    if isinstance(result.design, AntiWindupDesign) and np.isfinite(result.design.level):
        gain = (f": L2 gain {result.design.value:.6g} from rest, for disturbances of energy up to "
                f"{result.design.energy:.6g}" if result.design.energy > 0 else "")
        return f"Proven in a region only{gain}."
    if isinstance(result.design, MpcDesign):
        level = result.design.terminal.level
        return f"Proven: from every start in the terminal set x'Px ≤ {level:.6g} the cost is at most x'Px."
    how = "Proven" if result.checked else "Evaluated at the bins in floating point, not proven"
    return f"{how}: {result.design.value:.6g}."


def _subtitle(result: Synthesis) -> str:
    """Which file, and what the controller consists of."""
    K = result.design.controller
    if not result.design.holds:
        return result.job.files[0].name
    counts = {"state": K.nstates, "input": K.ninputs, "output": K.noutputs}
    sizes = ", ".join(f"{n} {what}{'s' * (n != 1)}" for what, n in counts.items())
    return f"{result.job.files[0].name}: {sizes}, {f'sampled at {K.dt:g} s' if K.dt else 'continuous'}"


def _section(result: Synthesis) -> Section:
    design = result.design
    best = f" Best possible, estimated: {design.lower:.4g}." if np.isfinite(design.lower) else ""
    text = (f"{_capital(design.method)}, computed by: {design.solver}; {design.solve_time:.3g} s.\n\n"
            f"{_reached(result)}{best}\n\n{design.outcome.text}")
    if design.holds:
        text += f"\n\n{design.robust_against.text}"
    rows = pd.DataFrame([{"loop": name, "disk margin [-]": one["disk"], "gain margin [-]": one["gain"],
                          "phase margin [deg]": one["phase"], "delay [s]": one["delay"],
                          "modulus [-]": one["modulus"]} for name, one in design.margins.items()])
    shown = rows.map(lambda cell: cell if isinstance(cell, str) else f"{cell:.3g}" if np.isfinite(cell) else "no limit")
    tables = (Table(shown, "Margins of the loops, computed, not proven."),) if len(rows) else ()
    return Section("Controller", text, tables=tables)


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
