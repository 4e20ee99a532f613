"""What the report of a job says: sections with figures and tables made from finished results."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from ..._pandas import pd
from ...calibration import Estimates, Fit
from ...report import Figure, Section, Table, house_style, measured_against_model
from ...thermal import parameter_label
from ..certify import converged
from ._misfit import Misfit
from ._result import Comparison


def comparison_section(comparisons: tuple[Comparison, ...], fit: Fit | None, order: tuple[str, ...],
                       misfits: tuple[Misfit, ...] = ()) -> Section:
    """Model against data: residuals before and after; every record drawn but the one on the first screen."""
    shown = _worst_record(comparisons, misfits) if misfits else None
    rows = [{"record": f"{c.kind}: {c.record.name}", "sensor": _named(name, c.record.units.get(name)),
             "nominal model [K]": before, "calibrated model [K]": c.rmse(c.calibrated)[name]}
            for c in comparisons for name, before in c.rmse(c.nominal).items()]
    table = pd.DataFrame(rows)
    text = ("Both models run free: they see only the currents, heaters and ambients. On training records the "
            "calibrated model starts from the initial temperatures of its fit; elsewhere they are estimated on the "
            "first tenth of the record, or on all of it where that leaves them open. The table gives the root mean "
            "square of the residual, measured − model, of every sensor; for the calibrated model these are the numbers "
            "of the calibration itself.")
    if fit is not None:
        text += f"\n\n{fit.outcome.text}"
    figures = tuple(figure for c in comparisons if c is not shown for figure in _comparison_figures(c, order))
    if shown is not None:
        text += f"\n\nThe {shown.kind} record {shown.record.name} is drawn at the top of this report."
    return Section("Model against data", text, figures=figures,
                   tables=(Table(table, "Residuals (measured − model), root mean square."),), anchor="model")


def first_section(comparisons: tuple[Comparison, ...], misfits: tuple[Misfit, ...], order: tuple[str, ...]) -> Section:
    """Model against the records that were held out, for the first screen; against the training records without any."""
    kind = _shown(misfits)[0].kind
    what = ("records that were held out" if kind == "validation" else
            "its own training records: none was held out, so that nothing is known about its predictions")
    return Section("Model against data", f"The calibrated model, run freely, beside {what}.",
                   figures=_comparison_figures(_worst_record(comparisons, misfits), order),
                   tables=(misfit_table(misfits),), anchor="validation")


def _worst_record(comparisons: Sequence[Comparison], misfits: Sequence[Misfit]) -> Comparison:
    """The record on the first screen: that of the largest misfit among those that were held out."""
    first = _shown(misfits)[0]
    return next((c for c in comparisons if c.kind == first.kind and c.record.name == first.record), comparisons[0])


def misfit_table(misfits: Sequence[Misfit]) -> Table:
    """Misfits of the records that were held out, or of the training records without any; the largest first.

    Parameters
    ----------
    misfits : sequence of Misfit
        Of all records.
    """
    rows = _shown(misfits)
    frame = pd.DataFrame([{"record": one.record, "sensor": _named(one.sensor, one.unit), "mean [K]": one.mean,
                           "rms [K]": one.rms, "noise [K]": one.noise, "beyond noise [K]": one.excess,
                           "tolerance [K]": one.tolerance, "answer": _answer(one)} for one in rows])
    return Table(frame.head(_ROWS), f"Residual measured − modelled by sensor, the largest first"
                 f"{f'; {_ROWS} of {len(frame)}' * (len(frame) > _ROWS)}.", digits=3)


def _shown(misfits: Sequence[Misfit]) -> list[Misfit]:
    kind = "validation" if any(one.kind == "validation" for one in misfits) else "train"
    return sorted((one for one in misfits if one.kind == kind), key=lambda one: -one.excess / max(one.tolerance, 1e-9))


_ROWS = 6


def _named(sensor: str, unit: str | None) -> str:
    """Sensor of a row whose numbers are kelvin, unless it says volts."""
    return f"{sensor} (all in V)" if unit == "V" else sensor


def _answer(one: Misfit) -> str:
    if not one.significant:
        return "within the noise"
    return "NOT within the tolerance" if one.beyond else "beyond the noise, within the tolerance"


def _comparison_figures(c: Comparison, order: tuple[str, ...]) -> tuple[Figure, ...]:
    """One drawing of the temperatures, and one of the voltages where the record has any."""
    units = {name: c.record.units.get(name) for name in c.rmse(c.calibrated)}
    groups = {"K": [n for n, own in units.items() if own != "V"], "V": [n for n, own in units.items() if own == "V"]}
    return tuple(_comparison_figure(c, names, unit, order) for unit, names in groups.items() if names)


def _comparison_figure(c: Comparison, sensors: list[str], unit: str, order: tuple[str, ...]) -> Figure:
    names = _worst(c, sensors, 4)
    figure = measured_against_model(c.record.time, {n: c.record[n] for n in names}, {n: c.calibrated[n] for n in names},
                                    title=f"{c.kind}: {c.record.name}", unit=unit, order=order)
    what = "voltages" if unit == "V" else "temperatures"
    alt = f"Time plot of measured and simulated {what}, {c.kind} record, with residuals below."
    shown = f"the {len(names)} sensors with the largest residual" if len(names) < len(sensors) else (
        "every sensor")
    caption = f"Measured (dots) and calibrated model (lines), {c.kind} record; {shown}."
    return Figure.draw(figure, alt=alt, caption=caption)


def _worst(c: Comparison, sensors: list[str], count: int) -> list[str]:
    rmse = c.rmse(c.calibrated)
    return sorted(sensors, key=lambda name: -rmse[name])[:count]


def response_sections(fit: Fit) -> Iterator[Section]:
    """Frequency responses beside the calibrated model, fitted and only compared.

    Parameters
    ----------
    fit : Fit
        Calibration of the system.
    """
    pairs = [*(("training", one) for one in fit.responses), *(("validation", one) for one in fit.validation_responses)]
    if not pairs:
        return
    rows = [{"use": use, "outputs": ", ".join(one.outputs), "inputs": ", ".join(one.inputs),
             "bins": int(one.bins.size), "misfit": one.misfit} for use, one in pairs]
    with house_style():
        figures = [Figure.draw(one.plot().flat[0].figure, alt=f"Bode plot of the {use} response and of the model.",
                               caption=f"Measured response with 95 % bands, and the calibrated model (dashed), {use}.")
                   for use, one in pairs]
    yield Section("Model against frequency responses", "The model is linearized at the operating point of each "
                  "response. The misfit is the mean square of measured − model in standard deviations of the estimate: "
                  "1 is noise alone.", figures=tuple(figures),
                  tables=(Table(pd.DataFrame(rows), "Frequency responses beside the model.", digits=3),),
                  anchor="responses")


_COLUMNS = {"std": "standard deviation", "lower": "lower bound", "upper": "upper bound",
            "prior": "standard deviation of the prior", "at_bound": "at a bound"}


def parameter_section(fit: Estimates, ranges: Mapping[str, tuple[float, float]] | None) -> Section:
    """Calibrated parameters with their uncertainty, and what the data do not determine."""
    text = "Estimated from the training records; standard deviations are for the residuals as they are."
    frame = fit.table().rename(columns=_COLUMNS)
    if ranges:
        text += " The claims for the parameter ranges hold for all of them from lowest to highest, in any combination."
        nothing = (float("nan"), float("nan"))
        for side, column in enumerate(("lowest of the range", "highest of the range")):
            frame.insert(2 + side, column, [ranges.get(name, nothing)[side] for name in frame.index])
    if not converged(fit):
        text = f"{fit.outcome} The numbers below are where the optimizer stopped: they are no estimates."
    if fit.undetermined:
        text += "\n\nNot determined by these data: " + "; ".join(map(str, fit.undetermined)) + "."
    if fit.remarks:
        text += "\n\n" + " ".join(fit.remarks)
    frame["standard deviation"] = [float(f"{value:.3g}") for value in frame["standard deviation"]]
    frame.insert(0, "quantity", [parameter_label(name) for name in frame.index])
    table = Table(frame.reset_index(names="parameter"), "Calibrated parameters, each with its name in the files.",
                  digits=6)
    return Section("Calibrated parameters", text, tables=(table,), anchor="parameters")


