"""Report and files of a controller design."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..._celsius import ZERO_CELSIUS
from ..._digits import in_table, inward
from ..._pandas import pd
from ...design import ClosedLoop, GainObserver
from ...report import Figure, Reason, Report, Section, Table, house_style
from ...thermal import System
from ..certify import certification_sections
from ..claims import GateCode, machine_assumptions, required_claims
from ..evidence import write_certification
from ..folder import output_folder
from ..now import now
from ..provenance import provenance, simulated_label, subtitle
from ._claims import OBSERVER_RANGES
from ._corners import Corner
from ._design import ControllerDesign
from ._file import write_design_file
from ._limits import BELOW_FOLD
from ._margin_section import margin_section
from ._request import celsius

_ENDINGS = {"c": ("c", "h"), "mat": ("mat",), "json": ("json",)}
_LARGEST_GAIN = 6  # sensors whose gains are tabulated; all are in design.json


def write_design(result: ControllerDesign, files: tuple[Path, ...], out: str | Path) -> Report:
    """Write a design into a folder, which appears only when complete.

    Parameters
    ----------
    result : ControllerDesign
        Design, as `design_system` returns it.
    files : tuple of Path
        Input files, for their hashes.
    out : str or Path
        Output folder: design.json with every number of the controller, report.html, junit.xml, summary.json,
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
    >>> system = rt.System(
    ...     ambients={"room": {"temperature": 295.15}},
    ...     lumps={"sink": {"capacity": 120.0}, "stage": {"capacity": 35.0}},
    ...     links=[{"between": ("sink", "room"), "conductance": 0.9},
    ...            {"between": ("stage", "room"), "conductance": 0.05}],
    ...     modules={"m1": rt.systems.surrogate_module("sink", "stage")})
    >>> done = rt.jobs.design_system(system, rt.jobs.DesignRequest(setpoint={"m1": 288.15}))
    >>> rt.jobs.write_design(done, (), "design").holds
    True
    >>> sorted(path.name for path in Path("design").iterdir())
    ['certificates', 'design.json', 'junit.xml', 'report.html', 'report.json', 'summary.json']
    """
    report = design_report(result, files)
    with output_folder(out) as folder:
        report = write_certification(result.certification.checked, report, folder)
        save_design(result, folder)
    return report


def design_report(result: ControllerDesign, files: tuple[Path, ...]) -> Report:
    """What is to be said of a design, as yet without evidence and not written anywhere.

    Parameters
    ----------
    result : ControllerDesign
        Design, as `design_system` returns it.
    files : tuple of Path
        Input files, for their hashes.
    """
    system = result.certification.system
    return Report(title=f"Controller for {system.name}", subtitle=subtitle(system, system.name),
                  label=simulated_label([system.name, *(file.name for file in files)]),
                  kind="Controller design report",
                  claims=required_claims(result.certification.checked), sections=tuple(_sections(result)),
                  first=(_step_section(result),), numbers=tuple(_numbers(result)),
                  provenance=provenance(files), generated=now(), gate=tuple(_reasons(result)), gates=_GATES,
                  assumptions=(*machine_assumptions(system, bool(result.request.parameters)), *_ASSUMPTIONS),
                  data={"design": _summary(result)})


def _summary(result: ControllerDesign) -> dict[str, Any]:
    """What the summary of a design says."""
    ranges = result.request.parameters or {}
    return {"holds": result.holds, "setpoint": result.request.setpoint,
            "regulates": {name: point.name for name, point in result.points.items()},
            "current_limits": {name: [float(low), float(high)] for name, low, high in
                               zip(result.law.names, result.law.current_low, result.law.current_high, strict=True)},
            "bandwidth": result.bandwidth, "tuning": result.tuning, "sample_time": result.controller.sample_time,
            "margins": result.margins.to_dict(), "margins_missed": list(result.missed),
            "parameters": {name: list(pair) for name, pair in ranges.items()},
            "nominal": {one.title: one.good for one in result.certification.checked if one.parameters == "nominal"},
            "robust": {one.title: one.good for one in result.certification.checked if one.parameters == "ranges"}}


def save_design(result: ControllerDesign, folder: Path) -> None:
    """Write design.json, with every number of the controller, and the exports that were asked for.

    Law, controller, observer and, where there is one, the ramp of the set-points become law.c, controller.c, observer.c
    and ramp.c with functions law_step, controller_init, _heat and _advance, observer_step, ramp_step, and the same as
    .h to include; .mat and .json hold their numbers. All have a test
    vector.

    Parameters
    ----------
    result : ControllerDesign
        Design, as `design_system` returns it.
    folder : Path
        Existing folder to write into.
    """
    write_design_file(result, folder / "design.json")
    parts: dict[str, Any] = {"law": result.law, "controller": result.controller, "observer": result.observer,
                             "ramp": result.request.ramp(result.law.names)}
    endings = [ending for one in result.request.export for ending in _ENDINGS[one]]
    for name, part in parts.items():
        for ending in endings if part is not None else ():
            part.export(folder / f"{name}.{ending}", name)


_ASSUMPTIONS = (
    "The closed loop of law, controller and observer is simulated, not proven: the certificates cover every current "
    "inside the limits, whatever the controller does, and the observer by itself.",
    "The runaway limit I* and the reachable set-points are computed, not proven.",
)


_GATES = tuple(code.code for code in (GateCode.NOT_CERTIFIED, GateCode.NOT_VERIFIED, GateCode.CURRENT_BEYOND_INVARIANCE,
                                      GateCode.NOT_ROBUST, GateCode.MARGIN_MISSED, GateCode.LOOP_NOT_ROBUST,
                                      GateCode.SETPOINT_NOT_HELD, GateCode.NOMINAL_ONLY))


def _reasons(result: ControllerDesign) -> Iterator[Reason]:
    """What the verdict knows beside the claims."""
    if result.missed:
        yield Reason("fail", GateCode.MARGIN_MISSED.code, "design", "margins",
                     "; ".join(result.missed)[:1].upper() + "; ".join(result.missed)[1:], GateCode.MARGIN_MISSED.remedy)
    if not result.margins.outcome:
        yield Reason("fail", GateCode.LOOP_NOT_ROBUST.code, "design", "margins", result.margins.outcome.text,
                     GateCode.LOOP_NOT_ROBUST.remedy)
    for corner in result.corners:
        if not corner.held:
            yield Reason("remark", GateCode.SETPOINT_NOT_HELD.code, "design", "setpoint", _not_held(corner),
                         GateCode.SETPOINT_NOT_HELD.remedy)
            break
    box = (result.robust or result.certification.safe).temperature
    if box and not result.contained:
        lump, (_, high) = max(box.items(), key=lambda item: item[1][1])
        top = result.request.temperature[1]
        yield Reason("fail", GateCode.CURRENT_BEYOND_INVARIANCE.code, "design", lump, "With these current limits "
                     f"{lump} may reach {high - ZERO_CELSIUS:.1f} °C, beyond the {top - ZERO_CELSIUS:.1f} °C of the "
                     "stated box.",
                     "The set-points need more than the usable current: cool the hot side better, move the "
                     "set-points, or narrow ambients and heats.", high, top)
    for one in result.certification.checked:
        if one.key == OBSERVER_RANGES and not one.required:
            why = one.certificate.reason.removeprefix("region.parameters: ").partition(". Expected")[0]
            yield Reason("remark", GateCode.NOMINAL_ONLY.code, "design", "observer", "That the error of the observer "
                         "shrinks is claimed for exactly the parameters of the model, not for their ranges: "
                         f"{why}.", "The margins are computed with it for all corner plants.")
    if not result.request.parameters:
        yield Reason("remark", GateCode.NOMINAL_ONLY.code, "design", "parameters", GateCode.NOMINAL_ONLY.meaning,
                     "Give --parameters with the calibrated.json of a calibration, or with ranges.")


def _not_held(corner: Corner) -> str:
    if corner.reach is None:
        return f"With {corner} no set-point can be held: {corner.why}."
    r = corner.reach
    reached = ", ".join(f"{name} reaches {celsius(value)} instead of {celsius(r.setpoint[name])}"
                        for name, value in r.limit.items())
    return f"With {corner} the set-points cannot be held: {r.why}, {reached}."


def _sections(result: ControllerDesign) -> Iterator[Section]:
    yield _controller_section(result)
    yield margin_section(result)
    if result.collapse is not None:
        yield _linearity_section(result)
    yield _observer_section(result.certification.system, result.observer, result.loop)
    if not (result.certification.safe.holds and result.contained):
        yield Section("No box that is never left", f"{result.certification.safe.outcome.text}\n\n"
                      "The set-points need more current than is usable. Inside the temperature box the machine "
                      "contracts at these currents, but that it stays inside is not proven: this design is not "
                      "certified. Cool the hot side better, move the set-points, or narrow the room's range.",
                      anchor="no-box")
    yield from certification_sections(result.certification)


def _numbers(result: ControllerDesign) -> Iterator[tuple[str, str, str]]:
    """What the set-points need of the current limits, and the margins of the loop that has least."""
    law, needed = result.law, result.reach.current
    for name, low, high in zip(law.names, law.current_low, law.current_high, strict=True):
        yield (f"current of {name} that holds its set-point", f"{in_table(needed[name], 3)} A",
               f"computed{_where(result.corners)}{_with_heat(result.corners, name)}; the controller keeps to "
               f"{inward(float(low), float(high))} A")
    least, loop = min((result.margins.worst(loop).phase, loop) for loop in result.margins.loops)
    yield ("least phase margin", f"{least:.3g}°" if np.isfinite(least) else "no crossover",
           f"loop of {loop}; computed, not proven")


def _where(corners: Sequence[Corner]) -> str:
    """Ambients of the first corner, the warm end of their ranges."""
    return f" with {corners[0]}" if corners and str(corners[0]) else ""


def _with_heat(corners: Sequence[Corner], name: str) -> str:
    """What a module needs beside the heats that may flow, in words; empty where nothing heats."""
    reached = [one.reach for one in corners if one.held and one.reach is not None]
    if not any(one.heated for one in corners):
        return ""
    if len(reached) < len(corners):
        return ", without heat; not held at every heat"
    most = max((one.current[name] for one in reached), key=abs)
    return f", without heat; {in_table(most, 3)} A at most with it"


def _controller_section(result: ControllerDesign) -> Section:
    c, law, fold = result.controller, result.law, result.certification.runaway
    rows = [{"module": name, "regulates": point.name, "set-point [°C]": result.request.setpoint[name] - ZERO_CELSIUS,
             "lower limit [A]": law.current_low[i], "upper limit [A]": law.current_high[i],
             "needed [A]": result.reach.current[name], "I* [A]": fold.current[name] if fold else float("nan"),
             "Kp [W/K]": c.proportional[i], "Ki [W/(K s)]": c.integral[i]}
            for i, (name, point) in enumerate(result.points.items())]
    own = " The limits are those that were asked for." if result.request.current else (
        f" The upper limits are the usable ones: the smallest of {BELOW_FOLD:g} I*, the contraction limit, the file's "
        "limit, and the largest current with which a box below the upper end of the temperature box is never left; the "
        "lower ones are the largest with which that box is still never left.")
    text = ("A linearizing feedback law turns the heat that the PI asks for into a current, within the limits; the PI "
            f"works on a linear cold side, every {c.sample_time:g} s, with a crossover of {result.bandwidth:.4g} rad/s."
            f"{' ' * bool(result.tuning)}{result.tuning}{own}\n\n"
            "design.json has every number with its unit, and the equations to program.")
    table = Table(pd.DataFrame(rows), "Limits and gains.")
    return Section("The controller", text, tables=(table,), anchor="controller")


def _step_section(result: ControllerDesign) -> Section:
    rates = ", ".join(f"{name} {rate:.4g} K/s" for name, rate in (result.request.setpoint_ramp or {}).items())
    way = "along a ramp" if rates else "after a step"
    with house_style():
        axes = result.loop.plot()
        axes[0].set_title("", loc="left")
        for limit in {*result.law.current_low, *result.law.current_high}:
            axes[1].axhline(limit, color="#888888", linestyle=":", linewidth=0.8)
        figure = Figure.draw(axes[0].figure, alt=f"Temperatures and currents over time, {way} to the set-points.",
                             caption="Above: what is regulated (lines), set-points (dashed), and cold faces where "
                             "something else is regulated (dotted). Below: currents and their limits (dotted).")
    seen = "estimated from noisy readings" if result.observer else "taken as measured, without an observer"
    text = (f"Simulated from rest at ambient temperature on the nonlinear model; the temperatures are {seen}. "
            f"{f'The set-points move no faster than {rates}. ' if rates else ''}{result.loop.outcome.text}")
    title = "Ramp to the set-points" if rates else "Step to the set-points"
    return Section(title, text, figures=(figure,), anchor="step")


def _linearity_section(result: ControllerDesign) -> Section:
    found: Any = result.collapse
    with house_style():
        axes = found.plot()
        figure = Figure.draw(axes[0].figure, alt="Normalized step responses, one curve per step size.",
                             caption="Steps of several sizes, each divided by its size. Left: the same controller with "
                             "a constant gain. Right: with the law.")
    ratio = f", {found.ratio:.3g} times less" if found.outcome and np.isfinite(found.ratio) else ""
    text = (f"A linear loop answers steps of every size alike. The largest spread between the normalized responses is "
            f"{found.before:.2g} with a constant gain and {found.after:.2g} with the law{ratio}. {found.outcome.text}")
    return Section("How linear the loop is", text, figures=(figure,), anchor="linearity")


def _observer_section(system: System, observer: GainObserver | None, loop: ClosedLoop) -> Section:
    if observer is None:
        return Section("Observer", _without_observer(system), anchor="observer")
    tail = slice(len(loop.time) // 2, None)
    rms = np.sqrt(np.mean((loop.estimate - loop.lumps)[tail] ** 2, axis=0))
    columns = dict(zip(observer.sensors, observer.gain.T, strict=True))
    shown = columns if len(columns) <= _LARGEST_GAIN else {}
    frame = pd.DataFrame({"lump": system.lump_names, "error, rms [K]": rms, **shown})
    gain = {"kalman": "steady Kalman gain of the passive network",
            "positive": "gain that keeps the error matrix nonnegative"}[observer.method]
    text = (f"All lumps are reconstructed from {', '.join(observer.sensors)}: {gain}. The errors are those of the "
            "simulated step, second half, with the sensors' noise. "
            + ("L [K/K] has one column per sensor." if shown else "The gain is in design.json.")
            + _left_out(system, observer.sensors))
    table = Table(frame, f"Error of the observer{' and its gain' if shown else ''}.", digits=3)
    return Section("Observer", text, tables=(table,), anchor="observer")


def _without_observer(system: System) -> str:
    """Why there is none, and what the feedback law needs in its place."""
    late = _left_out(system, ())
    if not system.thermometers:
        why = "The file has no sensors for one."
    else:
        why = "None was asked for." if any(not one.lag for one in system.thermometers.values()) else "There is none."
    return (f"{why}{late} The feedback law needs the temperatures of both faces of every module: add sensors, or "
            "measure the faces.")


def _left_out(system: System, read: Sequence[str]) -> str:
    """Which sensors are not read because they lag."""
    late = [f"{name} ({sensor.lag})" for name, sensor in system.thermometers.items() if sensor.lag and name not in read]
    if not late:
        return ""
    return (" Left out, because an observer is certified only with sensors that read their lump at once: "
            f"{', '.join(late)}. Describe the mass of such a sensor as a lump, linked to the lump it measures, and it "
            "is read too.")
