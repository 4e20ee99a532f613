"""Report and files of a coupling."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..._digits import in_table
from ..._pandas import pd
from ...coupling import NORMS, Filters, MatrixFilters, Norm
from ...export import plain
from ...report import Reason, Report, Section, Table
from ..evidence import write_certification
from ..folder import output_folder
from ..now import now
from ..provenance import provenance
from ._claims import coupling_assumptions, coupling_claims
from ._couple import Coupling
from ._figures import envelope_figure, robust_figure, spectrum_figures, time_figure

_SYSTEMS = ("X_hat", "Y_hat", "Z1", "Z2", "X", "Y", "X_input", "Y_input", "controller")


def write_coupling(result: Coupling, out: str | Path) -> Report:
    """Write a coupling into a folder, which appears only when complete.

    Parameters
    ----------
    result : Coupling
        Coupling, as `couple_subsystems` returns it.
    out : str or Path
        Output folder: coupling.json with the filters (coupling.c, .h, .mat if the job says so), report.html,
        junit.xml, summary.json, ``certificates/*.json``.

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
    >>> loop = "plant = { num = [0.01], den = [1.0, -0.99] }\\ncontroller = 20.0\\n"
    >>> _ = Path("SPEC.toml").write_text('[coupling]\\nname = "pair"\\nsample_time = 0.01\\n'
    ...     f"[subsystems.1]\\n{loop}[subsystems.2]\\n{loop}[design]\\nX_hat = -0.9\\n")
    >>> done = rt.jobs.couple_subsystems(rt.jobs.read_coupling("SPEC.toml"))
    >>> rt.jobs.write_coupling(done, "coupled").holds
    True
    >>> sorted(path.name for path in Path("coupled").iterdir())
    ['certificates', 'coupling.json', 'junit.xml', 'report.html', 'report.json', 'summary.json']
    """
    report = coupling_report(result)
    with output_folder(out) as folder:
        report = write_certification(result.checked, report, folder)
        save_coupling(result, folder)
    return report


def coupling_report(result: Coupling) -> Report:
    """What is to be said of a coupling, as yet without evidence and not written anywhere.

    Parameters
    ----------
    result : Coupling
        Coupling, as `couple_subsystems` returns it.
    """
    job = result.job
    return Report(title=f"Coupling of {job.names[0]} and {job.names[1]}", subtitle=_subtitle(result), label="",
                  kind="Coupling report",
                  claims=tuple(coupling_claims(result)), sections=tuple(_sections(result)),
                  first=tuple(_first(result)), numbers=tuple(_numbers(result)),
                  provenance=provenance(job.files), assumptions=tuple(coupling_assumptions(result)), generated=now(),
                  gate=tuple(_gate(result)), data={"couple": _summary(result)})


def _gate(result: Coupling) -> Iterator[Reason]:
    for remark in result.remarks:
        yield Reason("remark", remark.code, "couple", "measured plants", remark.text)


def _summary(result: Coupling) -> dict[str, Any]:
    norms, uncertainty = result.filters.norms, result.filters.problem.uncertainty
    left_out = [] if uncertainty is None else (uncertainty.left_out / (2 * np.pi)).tolist()
    return {"robust": plain(norms["robust"]), "robust_without_circles": plain(norms["robust_without_circles"]),
            "left_out": left_out, "confidence": None if uncertainty is None else uncertainty.confidence}


def save_coupling(result: Coupling, folder: Path) -> None:
    """Write coupling.json with the filters, and what the job exports beside it.

    Parameters
    ----------
    result : Coupling
        Coupling, as `couple_subsystems` returns it.
    folder : Path
        Existing folder to write into.
    """
    job = result.job
    result.filters.save(folder / "coupling.json", job.name, remarks=result.remarks)
    for ending in job.exports:
        result.filters.export(folder / f"coupling.{ending}", job.name)


def _subtitle(result: Coupling) -> str:
    job, filters = result.job, result.filters
    rate = f"sampled every {filters.problem.dt:g} s" if filters.problem.dt else "in continuous time"
    plants = f"{len(job.measured)} measured plant{'s' * (len(job.measured) != 1)}" if job.measured else "none measured"
    kind = "given filters" if job.manual else f"basis {filters.basis}, order {filters.order}"
    return f"{job.name}: {rate}, {plants}, {kind}"


def _sections(result: Coupling) -> Iterator[Section]:
    yield _performance_section(result)
    if not result.found:
        return
    yield _norm_section(result)
    yield Section("Over frequency", "Computed at frequencies; corners, resonances and the measured frequencies are "
                  "among them.", figures=tuple(spectrum_figures(result.spectra)), anchor="spectra")
    if result.filters.problem.uncertainty is not None:
        yield _robustness_section(result)
    yield _filter_section(result.filters)


def _first(result: Coupling) -> Iterator[Section]:
    """The synchronization error over time, without and with coupling."""
    if result.found and result.simulation is not None:
        yield Section("Over time", "Plants, controllers, coupling controller and disturbances run sample by sample "
                      "from rest; the first half is not shown. Both traces have the same noise.",
                      figures=(time_figure(result.simulation),), anchor="time")


def _numbers(result: Coupling) -> Iterator[tuple[str, str, str]]:
    """What coupling does to the synchronization error of the model."""
    p = result.filters.performance
    if result.found and result.filters.problem.samples:
        for what, before, after in (("moving average of e12 = y2 − y1, 3σ", p.ma_before, p.ma_after),
                                    ("moving standard deviation of e12, 3σ", p.msd_before, p.msd_after)):
            scale, unit = _prefix(max(before, after))
            yield (what, f"{in_table(before / scale, 3)} → {in_table(after / scale, 3)} {unit}",
                   "without → with coupling; computed for the model, not proven")


def _prefix(size: float) -> tuple[float, str]:
    """Meters, or the part of one in which a length is written without an exponent."""
    return next(((scale, unit) for scale, unit in ((1.0, "m"), (1e-3, "mm"), (1e-6, "µm")) if size >= scale),
                (1e-9, "nm"))


def _performance_section(result: Coupling) -> Section:
    filters, p, n = result.filters, result.filters.performance, result.filters.norms
    rows = [("weighted e12, H2", n["h2_uncoupled"], n["h2"]), ("weighted e12, H∞", n["hinf_uncoupled"], n["hinf"])]
    if filters.problem.samples:
        rows = [("moving average, 3σ [m]", p.ma_before, p.ma_after),
                ("moving standard deviation, 3σ [m]", p.msd_before, p.msd_after), *rows]
    frame = pd.DataFrame([{"e12": name, "without coupling": before, "with coupling": after,
                           "smaller by": before / after if after else float("nan")} for name, before, after in rows])
    window = f" The exposure window is {filters.problem.window:g} s." if filters.problem.window else ""
    text = (f"{filters.outcome.text}\n\nSynchronization error e12 = y2 − y1 of the model.{window}"
            f"{_of_measured_plants(result)}")
    return Section("Performance of the model", text, tables=(Table(frame, "Before and after."),), anchor="performance")


def _of_measured_plants(result: Coupling) -> str:
    """Limits on MA and MSD are kept by the model; what the machine does must stand beside it."""
    worst = result.worst_case
    if worst is None or not result.found or not result.filters.problem.samples:
        return ""
    smaller, larger = worst.ma_before[:-1] / worst.ma_after[:-1], worst.msd_after[:-1] / worst.msd_before[:-1]
    return (f" On the measured plants MA is smaller by {smaller.min():.3g} to {smaller.max():.3g}, and MSD with "
            f"coupling is {larger.min():.3g} to {larger.max():.3g} times that without. A limit on MSD is one on the "
            "model.")


def _norm_section(result: Coupling) -> Section:
    filters, good = result.filters, {c.key for c in result.checked if c.good}
    rows = [{"number": norm.symbol, "value": filters.norms[key], "proven": _proven(filters, norm, good),
             "solver's own": filters.requested.get(key, float("nan")),
             "asked at most": filters.asked.get(key, float("nan"))}
            for key, norm in NORMS.items() if key in filters.norms]
    if "msd" in filters.asked:
        rows.append({"number": "MSD, after over before", "value": filters.performance.msd_growth, "proven": "computed",
                     "solver's own": float("nan"), "asked at most": filters.asked["msd"]})
    text = ("Proven numbers are upper bounds at every frequency, also between grid points. The solver's own numbers "
            "are those it optimized on its grid; they prove nothing.")
    return Section("Norms", text, tables=(Table(pd.DataFrame(rows), "Norms, proven and asked for."),), anchor="norms")


def _proven(filters: Filters | MatrixFilters, norm: Norm, good: set[str]) -> str:
    if not norm.proof:
        return "computed"
    if norm.file in good:
        return "yes"
    if norm.key == "robust" and filters.problem.uncertainty is None:
        return "no uncertainty"
    return "a constant" if np.isfinite(filters.norms[norm.key]) else "no"


def _robustness_section(result: Coupling) -> Section:
    worst, filters = result.worst_case, result.filters
    assert filters.problem.uncertainty is not None
    if worst is None:
        text = (f"The robust number is largest near {filters.worst_frequency / (2 * np.pi):.4g} Hz. Stable for every "
                "plant under the envelope does not mean good for every one. For several inputs and outputs the number "
                "is sufficient, not necessary.")
        return Section("Robustness", text, anchor="robustness",
                       figures=(robust_figure(result.spectra), envelope_figure(filters.problem.uncertainty)))
    text = (f"The robust number is largest near {filters.worst_frequency / (2 * np.pi):.4g} Hz. Stable for every plant "
            "under the envelope does not mean good for every one: the table says what the measured plants do, and the "
            "most that any plant under the envelope could do. A wider margin in [design] narrows the spread.")
    figures = robust_figure(result.spectra), envelope_figure(filters.problem.uncertainty)
    if not filters.problem.samples:
        return Section("Robustness", text.replace("the table", "the python function rt.coupling.worst_case"),
                       figures=figures, anchor="robustness")
    frame = pd.DataFrame({"plant": [*result.job.measured_files, "bound for every plant"],
                          "MA before [m]": worst.ma_before, "MA after [m]": worst.ma_after,
                          "MSD before [m]": worst.msd_before, "MSD after [m]": worst.msd_after})
    caption = "Moving average and moving standard deviation of e12, 3σ, integrated on a grid. inf: no bound."
    return Section("Robustness", text, figures=figures, tables=(Table(frame, caption),), anchor="robustness")


def _filter_section(filters: Filters | MatrixFilters) -> Section:
    frame = pd.DataFrame([{"filter": name, "states": getattr(filters, name).nstates} for name in _SYSTEMS])
    text = ("coupling.json holds the state space of every filter, and in discrete time second-order sections of X, Y "
            "and their inputs where those are accurate to 0.1 %. e1⁺ = e1 + X e2⁺, e2⁺ = e2 + Y e1⁺; X_input and "
            "Y_input add P1⁻¹X e2⁺ to u1 and P2⁻¹Y e1⁺ to u2. controller is the same as one 2x2 system, from (e1, e2) "
            "to (u1, u2). Shorter filters: rt.coupling, Filters.reduce.")
    if isinstance(filters, MatrixFilters):
        text = ("coupling.json holds the state space of every filter. e1⁺ = e1 + X e2⁺, e2⁺ = e2 + Y e1⁺ with vectors; "
                "X_input and Y_input go from e2⁺ to u1 and from e1⁺ to u2, with P1 X_input = X and P2 Y_input = Y. "
                "controller is the same as one system, from (e1, e2) to (u1, u2). The key export of the coupling file "
                "writes them as C source with a test vector, too. Shorter filters: rt.coupling, MatrixFilters.reduce.")
    return Section("Filters", text, tables=(Table(frame, "Sizes."),), anchor="filters")
