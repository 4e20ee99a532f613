"""Write the results of a job: report, certificates, JUnit, calibrated system."""

from __future__ import annotations

from pathlib import Path

from ...report import Report
from ...thermal import write_system
from ..certify import certification_sections, stays_usable
from ..claims import machine_assumptions, required_claims
from ..evidence import write_certification
from ..folder import output_folder
from ..network import network_section
from ..now import now
from ..provenance import provenance, subtitle
from ..request import write_calibrated
from ._gate import GATES
from ._label import project_label
from ._result import JobResult
from ._sections import comparison_section, first_section, parameter_section
from ._tables import summary_tables


def write_job(result: JobResult, out: str | Path) -> Report:
    """Write everything the main job found into a folder, which appears only when complete.

    Parameters
    ----------
    result : JobResult
        Result of the main job, as `run_job` returns it.
    out : str or Path
        Output folder to create or replace.

    Returns
    -------
    Report
        What report.html shows.

    Raises
    ------
    InputError
        If the folder cannot be written, or holds something else.

    Examples
    --------
    >>> from dataclasses import replace
    >>> from pathlib import Path
    >>> import robthermal as rt
    >>> demo = rt.jobs.read_project(rt.jobs.demo_project())
    >>> bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 50.0}},
    ...                 links=[{"between": ("bar", "room"), "conductance": 0.5}])
    >>> result = rt.jobs.run_job(replace(demo, system=bar, train=(), validation=(), boxes=rt.jobs.Boxes()))
    >>> report = rt.jobs.write_job(result, "results")
    >>> sorted(path.name for path in Path("results").iterdir())
    ['calibrated.toml', 'certificates', 'junit.xml', 'report.html', 'report.json', 'summary.json']
    """
    project, certified = result.project, result.certification
    sections = [network_section(result.system)]
    order = result.system.sensor_names
    if result.comparisons:
        sections.append(comparison_section(result.comparisons, result.fit, order, result.misfits))
    if result.fit is not None:
        sections.append(parameter_section(result.fit, certified.parameters))
    sections.extend(certification_sections(certified))
    first = (first_section(result.comparisons, result.misfits, order),) if result.misfits else ()
    report = Report(title=project.name, subtitle=subtitle(result.system, project.name), label=project_label(project),
                    claims=required_claims(certified.checked, stays_usable(certified)), sections=tuple(sections),
                    provenance=provenance(project.files), generated=now(),
                    assumptions=machine_assumptions(result.system, certified.parameters is not None),
                    gate=result.reasons, gates=GATES, usable=certified.usable, first=first,
                    data=summary_tables(result), identity=project.identity)
    with output_folder(out) as folder:
        report = write_certification(result.certification.checked, report, folder)
        write_system(result.system, folder / "calibrated.toml")
        if result.fit is not None:
            result.fit.table().to_csv(folder / "parameters.csv", index_label="parameter")
            write_calibrated(result.fit, project.files, folder / "calibrated.json")
    return report


