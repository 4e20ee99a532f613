"""Report and files of a diagnosis."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..._digits import chance
from ..._pandas import pd
from ...diagnosis import Diagnosis, Found, effects
from ...fitting import rmse
from ...report import Figure, Reason, Report, Section, Table, house_style, residuals_before_after, spectra_before_after
from ...signals import Record
from ...thermal import write_system
from ..claims import GateCode
from ..folder import output_folder
from ..network import network_section
from ..now import now
from ..provenance import provenance, simulated_label, subtitle
from ..report_files import write_report
from ._answer import answer_sentence, number_that_matters
from ._change_section import change_section
from ._claims import diagnosis_assumptions, diagnosis_claims
from ._diagnose import Diagnosed, Residuals, ResponseResiduals
from ._effect_words import labels_in_words
from ._ranking import NOT_NEEDED, ranking
from ._refinement_section import refinement_section

_DRAWN = 6  # sensors: more curves are not told apart


def write_diagnosis(result: Diagnosed, out: str | Path) -> Report:
    """Write a diagnosis into a folder, which appears only when complete.

    Parameters
    ----------
    result : Diagnosed
        Diagnosis, as `diagnose_records` returns it.
    out : str or Path
        Output folder: diagnosis.json, augmented.toml, report.html, report.json, junit.xml, summary.json;
        next_experiment.csv if one was found, refined.toml if a lump was split.

    Returns
    -------
    Report

    Raises
    ------
    InputError
        If the folder cannot be written, or holds something else.

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 100.0}},
    ...                 links=[{"between": ("bar", "room"), "conductance": 0.5}], inputs={"heater": {"lump": "bar"}},
    ...                 sensors={"T": {"lump": "bar", "noise": 0.05}})
    >>> drive = rt.Record(sample_time=10.0, inputs=np.repeat([4.0, 0.0, 6.0, 2.0], 50), outputs=np.zeros((200, 0)),
    ...                   input_names=["heater"], output_names=[])
    >>> run = rt.thermal.simulate(bar, drive)
    >>> noisy = run.with_outputs(run.outputs + 0.05 * np.random.default_rng(1).standard_normal((200, 1)))
    >>> rt.jobs.write_diagnosis(rt.jobs.diagnose_records(bar, (), [noisy]), "diagnosed").answer
    'CONSISTENT'
    """
    report = diagnosis_report(result)
    with output_folder(out) as folder:
        save_diagnosis(result.diagnosis, folder)
        write_report(report, folder)
    return report


def diagnosis_report(result: Diagnosed) -> Report:
    """What is to be said of a diagnosis, as yet not written anywhere.

    Parameters
    ----------
    result : Diagnosed
        Diagnosis, as `diagnose_records` returns it.
    """
    found = result.diagnosis
    remarks = tuple(_remarks(found))
    return Report(title=f"Diagnosis of {found.system.name}", subtitle=subtitle(found.system, found.system.name),
                  label=simulated_label([found.system.name, *(one.name for one in result.residuals),
                                         *(file.name for file in result.files)], result.files),
                  claims=tuple(diagnosis_claims(result)), sections=tuple(_sections(result)), first=(_first(result),),
                  provenance=provenance(result.files), assumptions=tuple(diagnosis_assumptions(found)),
                  generated=now(), answer=found.verdict.upper(), headline=answer_sentence(found),
                  numbers=(number_that_matters(found),), gate=remarks, gates=tuple(one.code for one in remarks))


def _remarks(found: Diagnosis) -> Iterator[Reason]:
    if found.verdict == "named_with_remainder":
        code = GateCode.REMAINDER
        yield Reason("remark", code.code, "diagnose", "records", str(found.remainder or code.meaning), code.remedy)


def save_diagnosis(found: Diagnosis, folder: Path) -> None:
    """Write diagnosis.json, augmented.toml, refined.toml if a lump was split, next_experiment.csv if one was found.

    Parameters
    ----------
    found : Diagnosis
        What was found.
    folder : Path
        Existing folder to write into.
    """
    found.save(folder / "diagnosis.json")
    write_system(found.system, folder / "augmented.toml")
    if found.refinement is not None:
        write_system(found.refinement.system, folder / "refined.toml")
    _write_experiment(found, folder / "next_experiment.csv")


def _write_experiment(found: Diagnosis, path: Path) -> None:
    """Inputs to apply; without the predicted readings, which somebody would take for measured ones."""
    if found.next_experiment is not None:
        plan, system = found.next_experiment.record, found.system
        inputs = Record(sample_time=plan.sample_time, inputs=plan.inputs, outputs=np.zeros((len(plan), 0)),
                        input_names=plan.input_names, output_names=[])
        ambients = [name for name in plan.input_names if name in system.ambients]
        inputs.save(path, temperature_unit=system.temperature_unit if ambients else "K", temperatures=ambients or None)


def _first(result: Diagnosed) -> Section:
    """The residual before and after; of a record that no fit has seen, if there is any."""
    found = result.diagnosis
    text = "With the provisional effects: " if found.provisional and found.remainder is not None else ""
    text += str(found.remainder or "")
    return Section("What the model leaves of the readings", text, anchor="answer",
                   figures=[_figure(one, found) for one in _shown_first(result)])


def _shown_first(result: Diagnosed) -> list[Residuals]:
    """The record on the first screen: one that no fit has seen, if there is any."""
    validation = [one for one in result.residuals if one.kind == "validation"]
    return (validation or list(result.residuals))[:1]


def _sections(result: Diagnosed) -> Iterator[Section]:
    found = result.diagnosis
    yield network_section(found.system)
    yield _effect_section(found)
    if found.reference is not None:
        yield change_section(found, found.reference)
    yield _gap_section(result)
    yield Section("Candidates", "Every effect of the catalog at every place of the system, ranked by what it "
                  "explains after the nominal parameters were refitted. The limit is the size that would have been "
                  "seen with a probability of 0.9 beside the misfit of the nominal system.",
                  tables=_candidate_tables(ranking(found)), anchor="candidates")
    yield _located_section(found)
    yield _validation_section(found)
    if found.refinement is not None:
        yield refinement_section(found.refinement)
    yield _next_section(found)


def _candidate_tables(ranked: pd.DataFrame) -> tuple[Table, ...]:
    """Those that explain more than noise with the reason, and the others without one."""
    noise = ranked["answer"] == NOT_NEEDED
    tables = [Table(ranked[~noise].reset_index(drop=True), "Candidates, and why each was taken or not.", digits=3),
              Table(ranked[noise].drop(columns="answer").reset_index(drop=True),
                    "Not needed: they explain no more than noise would.", digits=3)]
    return tuple(table for table in tables if len(table.frame))


def _effect_section(found: Diagnosis) -> Section:
    listed = found.effects or found.provisional
    rows = [{"effect": effect.label, "quantity": name, "value": value, "standard deviation": std,
             **({"or as well": effect.either[name]} if name in effect.either else {}),
             **({"in augmented.toml": effect.augmented[name]} if name in effect.augmented else {}), "unit": unit,
             "ΔBIC": effect.delta_bic, "p": chance(effect.p_value), **_evidence(effect)}
            for effect in listed for name, (value, std, unit) in effect.values.items()]
    text = f"{_own_words(found)}\n\n"
    text += "augmented.toml holds these effects." if found.effects else "augmented.toml holds the system refitted."
    if found.effects and found.effects[0].augmented:
        text += (" Sizes are those beside what a finer network would change, their standard deviations include the "
                 "remainder; augmented.toml has the sizes with which the network as it is fits best.")
    if found.provisional:
        text += " The effects below help, but do not explain everything: they are not names."
    tables = [Table(pd.DataFrame(rows), "Effects, in order of acceptance.")] if rows else []
    others = [{"accepted": effect.label, "cannot be excluded": f"{name}({', '.join(where)})"}
              for effect, names in zip(found.effects, found.alternatives, strict=True) for name, where in names]
    if others:
        tables.append(Table(pd.DataFrame(others), "What these records cannot tell from it."))
    return Section("What was found", text, tables=tables, anchor="effects")


def _own_words(found: Diagnosis) -> str:
    """Why the verdict is as it is, without what the claims and the first screen say already."""
    said = [found.adequacy.outcome.text, str(found.remainder or ""), found.nearest]
    said += [] if found.hold_out is None else [found.hold_out.outcome.text]
    text = found.outcome.text
    for sentence in said:
        text = text.replace(sentence, "")
    return labels_in_words(" ".join(text.split()))


def _evidence(effect: Found) -> dict[str, float]:
    """Columns that say how far a name can be relied on."""
    one = effect.evidence
    return {} if one is None else {"share of the gap": one.share, "better in blocks": one.reproducible,
                                   "spread over segments": one.stability.spread}


def _gap_section(result: Diagnosed) -> Section:
    found = result.diagnosis
    rows = [{"records": _called(kind, found), "before": gap.before, "after": gap.after, "noise alone": gap.noise,
             "unit": gap.unit} for kind, gap in found.gap.items()]
    rows += [{"records": f"{_called(one.kind, found)}: {one.name}, {name}", "before": rmse([one.before[name]]),
              "after": rmse([one.after[name]]), "noise alone": float("nan"), "unit": one.unit}
             for one in result.residuals for name in one.before]
    text = ("Before: the nominal system, its parameters refitted. After: with the effects. Both models run free; on "
            "the validation records only the initial temperatures were estimated, from the first tenth, or from the "
            "whole record where that leaves them open (and, where records have gains of their own or lack an ambient, "
            "those, from the whole record).")
    if not (found.effects or found.provisional):
        text = text.replace("After: with the effects. Both models run free",
                            "After: the same, for no effect was added. It runs free")
    if found.reference is not None:
        text = ("Before: the model fitted to the reference records. After: with the change. Initial temperatures, and "
                "ambients that a record does not hold, are refitted in both.")
    if found.provisional:
        text += " The effects are provisional, not names."
    figures = [_figure(one, found) for one in result.residuals if one not in _shown_first(result)]
    figures += [_spectrum(one, found) for one in result.residuals] + [_response(one) for one in result.responses]
    return Section("Residual before and after", text, figures=tuple(figures),
                   tables=(Table(pd.DataFrame(rows), "Residuals, root mean square; all sensors, then each."),),
                   anchor="gap")


def _called(kind: str, found: Diagnosis) -> str:
    """Kind of a record: of what is compared with a healthy machine, "new"."""
    return "new" if kind == "train" and found.reference is not None else kind


def _figure(one: Residuals, found: Diagnosis) -> Figure:
    kind = _called(one.kind, found)
    names = sorted(one.before, key=lambda name: -rmse([one.before[name]]))[:_DRAWN]
    drawn = residuals_before_after(one.time, {n: one.before[n] for n in names}, {n: one.after[n] for n in names},
                                   noise=_noise(one, found), order=found.system.sensor_names, unit=one.unit,
                                   title=f"{kind}: {one.name}")
    shown = f"the {len(names)} sensors with the largest residual" if len(names) < len(one.before) else "every sensor"
    return Figure.draw(drawn, alt=f"Residuals of the {kind} record over time, without and with the effects.",
                       caption=f"Measured − model, {kind} record, {shown}, on one scale. Grey: twice what noise "
                       "alone would give."
                       + (" After: with provisional effects, which are no names." if found.provisional else ""))


def _noise(one: Residuals, found: Diagnosis) -> float:
    """What noise alone would leave of the residuals drawn; the gap is about temperatures where there are any."""
    gap = found.gap[one.kind]
    return gap.noise if gap.unit == one.unit else rmse([np.array([found.noise_floor.noise[n] for n in one.before])])


def _spectrum(one: Residuals, found: Diagnosis) -> Figure:
    kind = _called(one.kind, found)
    names = sorted(one.before, key=lambda name: -rmse([one.before[name]]))[:_DRAWN]
    before, after = ({name: sizes[name] for name in names} for sizes in one.spectra())
    drawn = spectra_before_after(one.frequency, before, after, unit=f"{one.unit}/√Hz", order=found.system.sensor_names,
                                 title=f"{kind}: {one.name}")
    return Figure.draw(drawn, alt=f"Spectral densities of the residuals of the {kind} record, without "
                       "and with the effects.", caption=f"The same residuals over frequency, {kind} record.")


def _response(one: ResponseResiduals) -> Figure:
    names = list(one.before)[:_DRAWN]
    before, after = ({name: sizes[name] for name in names} for sizes in (one.before, one.after))
    drawn = spectra_before_after(one.frequency, before, after, unit="output/input", title=one.name)
    return Figure.draw(drawn, alt="Residuals of the frequency response, without and with the effects.",
                       caption=f"Measured − model, {one.name}.")


def _located_section(found: Diagnosis) -> Section:
    where = found.located
    lumps = pd.DataFrame({"lump": list(where.lumps), "F of an extra heat": [where.strength[n] for n in where.lumps],
                          "p": [chance(p) for p in where.lumps.values()]})
    lumps = lumps.sort_values("F of an extra heat", ascending=False, ignore_index=True)
    sensors = pd.DataFrame({"sensor": list(where.sensors),
                            "p of whiteness": [chance(p) for p in where.sensors.values()]})
    conditions = pd.DataFrame([line.split(": ", 1) for line in where.conditions], columns=["condition", "misfit"])
    with house_style():
        figures = [_from_axes(where.plot(), "Evidence of an extra heat by lump.", "F statistic of an extra heat.")]
        if found.unknown_heat is not None:
            caption = (f"Heat into {found.unknown_heat.lump} that would explain the residual, smoothed: mean and 95 % "
                       "band. It is located, not named.")
            figures.append(_from_axes(found.unknown_heat.plot(), caption, caption))
    tables = [Table(lumps, "Lumps.", digits=3), Table(sensors, "Sensors.", digits=3)]
    if where.conditions:
        tables.append(Table(conditions, "Operating conditions."))
    return Section("Where the misfit sits", "Of the nominal system, refitted. An extra heat into a lump stands for "
                   "anything that acts there.", figures=tuple(figures), tables=tuple(tables), anchor="located")


def _validation_section(found: Diagnosis) -> Section:
    rows = [{"effect": effect, "where": ", ".join(where), "why": why}
            for (effect, where), why in found.not_testable.items()]
    if not rows:
        return Section("What could not have been seen", "Every candidate of a physically possible size would have "
                       "been seen.", anchor="not-testable")
    return Section("What could not have been seen", "These records are silent about the following; their absence from "
                   "the answer means nothing.", tables=(Table(pd.DataFrame(rows), "Not testable."),),
                   anchor="not-testable")


def _next_section(found: Diagnosis) -> Section:
    plan = found.next_experiment
    if plan is not None:
        with house_style():
            figure = _from_axes(plan.plot(), "Inputs of the next experiment and the readings predicted.",
                                "Inputs to apply, and what the best candidate predicts.")
        return Section("Next experiment", f"{plan.advice} The inputs are in next_experiment.csv.", figures=(figure,),
                       anchor="next")
    return Section("Next experiment", _advice(found), anchor="next")


def _advice(found: Diagnosis) -> str:
    if found.verdict == "ambiguous":
        known = effects()
        names = {effect.effect for effect in found.effects}
        names |= {name for others in found.alternatives for name, _ in others}
        hints = [f"{name}: {known[name].separated_by}." for name in sorted(names) if known[name].separated_by]
        return "\n\n".join(["The alternatives act alike on every reading: no input separates them. What does:", *hints])
    if found.verdict == "unexplained":
        return ("Look at the lump, sensor and conditions above; repeat the experiment there, with more sensors. A "
                "cause outside the catalog can be added with rt.diagnosis.register_effect.")
    return "There is nothing to separate. Larger or faster inputs lower the detection limits of the table above."


def _from_axes(axes: Any, alt: str, caption: str) -> Figure:
    return Figure.draw(np.ravel(axes)[0].figure, alt=alt, caption=caption)
