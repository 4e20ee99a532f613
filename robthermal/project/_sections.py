"""What the report of a job says: sections with figures and tables made from finished results."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd

from ..calibration import Fit
from ..report import Figure, Section, Table, box_ranges, house_style, measured_against_model
from ._checked import Certification
from ._job_result import Comparison
from ._misfit import Misfit

_ZERO = 273.15


def comparison_section(comparisons: tuple[Comparison, ...], fit: Fit | None) -> Section:
    """Model against data: residuals before and after, every record drawn."""
    rows = [{"record": f"{c.kind}: {c.record.name}", "sensor": name, "nominal model [K]": before,
             "calibrated model [K]": c.rmse(c.calibrated)[name]}
            for c in comparisons for name, before in c.rmse(c.nominal).items()]
    table = pd.DataFrame(rows)
    text = ("Both models run free: they see only the currents, heaters and ambients. On training records the "
            "calibrated model starts from the initial temperatures of its fit; elsewhere they are estimated on the "
            "first tenth of the record. The table gives the root mean square of the residual, measured − model, of "
            "every sensor; for the calibrated model these are the numbers of the calibration itself.")
    if fit is not None:
        text += f"\n\n{fit.outcome.text}"
    figures = tuple(_comparison_figure(c) for c in comparisons)
    return Section("Model against data", text, figures=figures,
                   tables=(Table(table, "Residuals (measured − model), root mean square."),), anchor="model")


def first_section(comparisons: tuple[Comparison, ...], misfits: tuple[Misfit, ...]) -> Section:
    """Model against the records that were held out, for the first screen; against the training records without any."""
    kind = "validation" if any(one.kind == "validation" for one in misfits) else "train"
    rows = sorted((one for one in misfits if one.kind == kind),
                  key=lambda one: -one.excess / max(one.tolerance, 1e-9))
    worst = next((c for c in comparisons if c.kind == kind and c.record.name == rows[0].record), comparisons[0])
    frame = pd.DataFrame([{"record": one.record, "sensor": one.sensor, "mean [K]": one.mean, "rms [K]": one.rms,
                           "noise [K]": one.noise, "beyond noise [K]": one.excess, "tolerance [K]": one.tolerance,
                           "answer": _answer(one)} for one in rows])
    what = ("records that were held out" if kind == "validation" else
            "its own training records: none was held out, so that nothing is known about its predictions")
    return Section("Model against data", f"The calibrated model, run freely, beside {what}.",
                   figures=(_comparison_figure(worst),),
                   tables=(Table(frame.head(_ROWS), f"Residual measured − modelled by sensor, the largest first"
                                 f"{f'; {_ROWS} of {len(frame)}' * (len(frame) > _ROWS)}.", digits=3),),
                   anchor="validation")


_ROWS = 6


def _answer(one: Misfit) -> str:
    if not one.significant:
        return "within the noise"
    return "NOT within the tolerance" if one.beyond else "beyond the noise, within the tolerance"


def _comparison_figure(c: Comparison) -> Figure:
    names = _worst(c, 4)
    figure = measured_against_model(c.record.time, {n: c.record[n] for n in names},
                                    {n: c.calibrated[n] for n in names}, title=f"{c.kind}: {c.record.name}")
    alt = f"Time plot of measured and simulated temperatures, {c.kind} record, with residuals below."
    shown = f"the {len(names)} sensors with the largest residual" if len(names) < len(c.record.output_names) else (
        "every sensor")
    caption = f"Measured (dots) and calibrated model (lines), {c.kind} record; {shown}."
    return Figure.draw(figure, alt=alt, caption=caption)


def _worst(c: Comparison, count: int) -> list[str]:
    rmse = c.rmse(c.calibrated)
    return sorted(rmse, key=lambda name: -rmse[name])[:count]


def parameter_section(fit: Fit, ranges: Mapping[str, tuple[float, float]] | None) -> Section:
    """Calibrated parameters with their uncertainty, and what the data do not determine."""
    text = "Estimated from the training records; standard deviations are for the residuals as they are."
    frame = fit.table()
    if ranges:
        text += " The claims for the parameter ranges hold for all of them from lowest to highest, in any combination."
        frame.insert(2, "lowest", [ranges[name][0] if name in ranges else float("nan") for name in frame.index])
        frame.insert(3, "highest", [ranges[name][1] if name in ranges else float("nan") for name in frame.index])
    if fit.undetermined:
        text += "\n\nNot determined by these data: " + "; ".join(map(str, fit.undetermined)) + "."
    table = Table(frame.reset_index(names="parameter"), "Calibrated parameters.", digits=6)
    return Section("Calibrated parameters", text, tables=(table,), anchor="parameters")


def limit_section(result: Certification) -> Section:
    """Contraction limits by method and direction: no limits for use."""
    low, high = result.boxes.temperature
    rows = [{"direction": limit.direction, "method": limit.method, "contraction limit [A]": limit.current,
             "proven": limit.certificate.holds} for limit in result.limits]
    text = ("Contraction limit inside the box; not a limit for use: it holds only while all lumps are between "
            f"{low - _ZERO:.6g} and {high - _ZERO:.6g} °C, and such a current may leave that box.")
    return Section("Contraction limits", text, tables=(Table(pd.DataFrame(rows), "Contraction limits."),),
                   anchor="limits")


def runaway_section(result: Certification) -> Section | None:
    """Load curve of regulated modules."""
    if result.runaway is None:
        return None
    with house_style():
        ax = result.runaway.plot()
        ax.set_title("")
        figure = Figure.draw(ax.figure, alt="Load taken from the cold face against current, with the fold marked.",
                             caption="More current takes more heat only up to the fold.")
    text = ("With its cold face regulated, a module takes more heat with more current only up to I*; a load above q* "
            "has no equilibrium and the hot side runs away. Limit the controller's current below I*, also where "
            "the closed form for constant properties is larger. "
            f"{result.runaway.outcome.text}")
    table = Table(result.runaway.table().reset_index(names="module"), "Runaway limits.")
    return Section("Runaway limit of the regulated machine", text, figures=(figure,), tables=(table,),
                   anchor="runaway")


def box_section(result: Certification) -> Section | None:
    """The box that is never left."""
    box = result.safe.temperature
    if not box:
        return None
    low, high = (np.array([pair[side] for pair in box.values()]) - _ZERO for side in (0, 1))
    figure = Figure.draw(box_ranges(list(box), low, high), alt="Range of every lump temperature in the box.",
                         caption="Range that each lump cannot leave, °C.")
    what = "currents, heats and ambients" if result.system.modules else "heats and ambients"
    text = (f"For the stated {what}, in whatever sequence, no lump leaves its range once all are "
            "inside. The ranges bound what the model can do, also far outside the temperatures at which its parameters "
            "were measured; they are not a prediction of what it will do.")
    return Section("The box that is never left", text, figures=(figure,),
                   tables=(Table(result.safe.table().reset_index(names="lump"), "The box."),), anchor="box")


def certification_sections(result: Certification) -> Iterator[Section]:
    """Sections about one certification, in order."""
    if result.limits:
        yield limit_section(result)
    for section in (runaway_section(result), box_section(result)):
        if section is not None:
            yield section
