"""One report of all stages: what each has said, one verdict with the gates, in the order of the chain."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from ...report import Evidence, Report, Section, Stage
from ...thermal import System
from ..claims import ARITHMETIC, GateCode
from ..evidence import checker
from ..network import NETWORK, network_section
from ..now import now
from ..provenance import provenance, subtitle
from ..request import Project
from ..run import DataFacts, applied, data_reasons, misfit_table, project_label, residual_table
from ._context import Context, Finished
from ._inputs import input_section
from ._parts import diagnosis_of, facts_of

_DATA_GATES = (GateCode.NOT_CONVERGED, GateCode.VALIDATION_MISFIT, GateCode.TRAINING_MISFIT,
               GateCode.NO_VALIDATION, GateCode.SIMULATED_DATA,
               GateCode.CONSTANT_INPUT, GateCode.RESAMPLED, GateCode.NO_NOISE_STATED, GateCode.UNDETERMINED_PARAMETER,
               GateCode.PARAMETER_AT_BOUND)
GATES: Mapping[str, tuple[GateCode, ...]] = {  # beside those that a stage says itself
    "identify": (GateCode.CONSTANT_INPUT,), "calibrate": _DATA_GATES,
    "diagnose": (GateCode.DIAGNOSIS_UNEXPLAINED, GateCode.DIAGNOSIS_AMBIGUOUS, GateCode.DIAGNOSIS_NAMED),
    "certify": (GateCode.OUTSIDE_DATA,)}


def assemble(context: Context, stages: Sequence[Stage], system: System) -> Report:
    """The report of a chain.

    Parameters
    ----------
    context : Context
        With the stages that have a result.
    stages : sequence of Stage
        What became of every stage.
    system : System
        The certified system, or the nominal one.
    """
    project, parts = context.project, [(name, one.report) for name, one in context.finished.items()]
    facts, label = _judged(facts_of(context), project), project_label(project)
    reasons = [*data_reasons(facts, diagnosis_of(context), f"{label} {project.name}"),
               *(reason for _, report in parts for reason in report.gate)]
    common = _common([report for _, report in parts])
    data = _data(context, facts)
    certified = context.finished.get("certify")
    return Report(
        title=project.name, subtitle=subtitle(system, project.name), label=label,
        claims=tuple(claim for _, report in parts for claim in report.claims),
        sections=(input_section(project, data["imports"]), replace(network_section(system), chapter="Inputs"),
                  *_sections(context.finished, stages)),
        provenance=provenance(project.files), assumptions=common, generated=now(),
        evidence=tuple(one for _, report in parts for one in _resting(report, common)), checker=checker(),
        gate=applied(reasons, project.gate), usable=certified.report.usable if certified else (),
        first=(*_notes(project), *_first(context, facts)), data=data, identity=project.identity,
        stages=tuple(replace(one, gates=_gates(one.name, context)) for one in stages))


def _judged(facts: DataFacts, project: Project) -> DataFacts:
    """Misfits with the tolerances of the gate."""
    return replace(facts, misfits=tuple(replace(one, tolerance=project.gate.of(one.sensor, one.noise))
                                        for one in facts.misfits))


def _gates(stage: str, context: Context) -> tuple[str, ...]:
    said = context.finished[stage].report.gates if stage in context.finished else ()
    return tuple(dict.fromkeys([*(code.code for code in GATES.get(stage, ())), *said]))


def _sections(finished: Mapping[str, Finished], stages: Sequence[Stage]) -> Iterator[Section]:
    for stage in stages:
        chapter = stage.name.capitalize()
        if stage.name in finished:
            yield from (replace(section, chapter=chapter) for section in finished[stage.name].report.sections
                        if section.anchor != NETWORK)
        else:
            yield Section("Not computed" if stage.status == "failed" else "Not run", stage.text, chapter=chapter,
                          anchor=f"{stage.name}-{stage.status}")


def _notes(project: Project) -> Iterator[Section]:
    if project.notes:
        yield Section("Notes", project.notes, anchor="notes")


def _first(context: Context, facts: DataFacts) -> Iterator[Section]:
    """Model against data: of the model that is certified, with the tolerances of the gate."""
    for stage in ("diagnose", "calibrate"):
        found = context.finished[stage].report.first if stage in context.finished else ()
        if found and facts.misfits:
            yield from (replace(one, tables=(misfit_table(facts.misfits),)) for one in found)
            return


def _common(parts: Sequence[Report]) -> tuple[str, ...]:
    """What the claims of every part rest on."""
    claiming = [report for report in parts if report.evidence or report.claims]
    if not claiming:
        return (ARITHMETIC,)
    return tuple(text for text in claiming[0].assumptions
                 if all(text in report.assumptions for report in claiming[1:]))


def _resting(report: Report, common: Sequence[str]) -> Iterator[Evidence]:
    own = tuple(text for text in report.assumptions if text not in common)
    for one in report.evidence:
        yield replace(one, assumptions=(*own, *one.assumptions))


def _data(context: Context, facts: DataFacts) -> dict[str, Any]:
    """Tables of the summary; those of a diagnosis with adopted effects take the place of the calibration's."""
    found: dict[str, Any] = {}
    imports: dict[str, Any] = {}
    for one in context.finished.values():
        found |= {key: value for key, value in one.report.data.items() if key not in ("facts", "ranges", "imports")}
        imports |= {report["sha256"] or report["file"]: report for report in one.report.data.get("imports", ())}
    ranges = context.data("certify").get("ranges", {})
    if "calibrate" in found:
        rows = {name: {**row, "range": _range(name, ranges)}
                for name, row in found["calibrate"]["parameters"].items()}
        found["calibrate"] = {**found["calibrate"], "parameters": rows}
    absent = dict.fromkeys(("calibrate", "certify", "design", "couple"))  # null where the stage has no result
    return {"imports": list(imports.values()), **absent, **found, "residuals": residual_table(facts.misfits)}


def _range(name: str, ranges: Mapping[str, Any]) -> list[float] | None:
    """Range of a parameter; tied ones, "a = b", have one."""
    return next((list(ranges[own]) for own in name.split(" = ") if own in ranges), None)
