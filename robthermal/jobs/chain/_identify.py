"""Stage "identify": frequency responses from records, each in responses/NAME.json."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..._pandas import pd
from ...errors import InputError
from ...identify import FrequencyResponse, IdentifyCode
from ...report import Figure, Reason, Report, Section, Table, house_style
from ...thermal import System
from .._outcomes import JobsCode
from ..measured import estimate_response, import_report_beside
from ..request import Identification, Project
from ._context import Context, StageJob, read_files_key
from ._measured import RESPONSES
from ._parts import part


def _absent(project: Project) -> str:
    return "" if project.identify else "The project file has no table [identify.NAME]."


def _depends(project: Project) -> Mapping[str, Any]:
    return {one.name: {"options": one.options.model_dump(mode="json", exclude={"use", "records"}),
                       "point": dict(one.operating_point), "records": read_files_key(project, one.records)}
            for one in project.identify}


def _run(context: Context, folder: Path) -> Report:
    project = context.project
    (folder / RESPONSES).mkdir()
    sections, tables, reasons, imports = [], {}, [], []
    for one in project.identify:
        context.progress(f"estimating the frequency response {one.name}")
        model = _model(project.system, one)
        found = _estimate(project, one, model)
        found.save(folder / RESPONSES / f"{one.name}.json")
        sections.append(_section(one, found))
        tables[one.name] = {"method": found.method, "bins": len(found), "inputs": list(found.input_names),
                            "outputs": list(found.output_names), "suspect_bins": int(found.suspect.sum()),
                            "use": one.use, "notes": list(found.notes)}
        reasons += [Reason("remark", remark.code, "identify", one.name, f"{one.name}: {remark.text}")
                    for remark in found.remarks]
        reasons += _left_out(one.name, found)
        beside = list(one.options.instruments.values()) or one.reference
        imports += [import_report_beside(path, model, project.reading.get(path, ()), inputs=one.options.inputs,
                                         outputs=one.options.outputs, beside=beside).to_dict()
                    for path in one.records]
    return part("identify", sections, gate=reasons, data={"identify": tables, "imports": imports})


def _left_out(name: str, found: FrequencyResponse) -> Iterator[Reason]:
    """A remark where bins say nothing: calibration and diagnosis leave them out."""
    unknown = np.isnan(found.response).any(axis=(0, 1)) | ~np.isfinite(found.confidence_radius(0.95)).all(axis=(0, 1))
    if unknown.any():
        f = found.frequencies[unknown]
        text = (f"{name}: {f.size} of {len(found)} bins, from {f[0]:.3g} to {f[-1]:.3g} Hz, are not determined by the "
                "data; calibration and diagnosis leave them out")
        yield Reason("remark", JobsCode.BINS_LEFT_OUT.code, "identify", name, f"{text}.", value=float(f.size),
                     limit=0.0, remedy=IdentifyCode.UNDETERMINED.remedy)


def _model(system: System, one: Identification) -> System | None:
    """The system that names the columns; None where a column is none of it: a machine beside the certified one."""
    known = {*system.inputs, *system.modules, *system.ambients, *system.sensors}
    asked = {*one.options.inputs, *one.options.outputs}
    return system if asked <= known else None


def _estimate(project: Project, one: Identification, model: System | None) -> FrequencyResponse:
    options = one.options
    try:
        found = estimate_response(one.records, system=model, inputs=options.inputs, outputs=options.outputs,
                                  method=options.method, half_width=options.half_width, degree=options.degree,
                                  poles=options.poles, band=options.band, reading=project.reading,
                                  reference=one.reference, instruments=options.instruments,
                                  input_noise=options.input_noise, pole_deviation=options.pole_deviation,
                                  basis=options.basis)
    except InputError as error:
        if any(path.name in error.where for path in one.records):
            raise
        key = error.where.removeprefix("--").replace("low, high", "band").replace("-", "_")
        raise InputError(error.what, where=f"{project.path} [identify.{one.name}] {key}", expected=error.expected,
                         remedy=error.remedy) from None
    return found.replace(operating_point={**found.operating_point, **one.operating_point})


def _section(one: Identification, found: FrequencyResponse) -> Section:
    with house_style():
        axes = found.plot()
        figure = Figure.draw(axes.flat[0].figure, alt=f"Bode plot of the frequency response {one.name}, with its 95 % "
                             "bands.", caption=f"Measured frequency response {one.name}, with 95 % bands.")
    use = {"train": "Calibration and diagnosis are fitted to it.", "none": "Calibration and diagnosis do not use it.",
           "validation": "Calibration and diagnosis are only compared with it."}[one.use]
    rows = [{"method": found.method, "bins": len(found), "lowest [Hz]": float(found.frequencies[0]),
             "highest [Hz]": float(found.frequencies[-1]), "suspect bins": int(found.suspect.sum())}]
    text = "\n\n".join([f"From {', '.join(path.name for path in one.records)}; in {RESPONSES}/{one.name}.json. {use}",
                        *found.notes])
    return Section(f"Frequency response {one.name}", text, figures=(figure,),
                   tables=(Table(pd.DataFrame(rows), "What was estimated."),), anchor=f"frf-{one.name}")


IDENTIFY = StageJob("identify", _absent, lambda project: (), _depends, _run)
