"""Write the results of a job: report, certificates, JUnit, calibrated system."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from ..report import Claim, Report, file_hash, versions
from ..thermal import System, write_system
from ._assumptions import machine_assumptions
from ._checked import Certification, Checked
from ._evidence import write_certification
from ._folder import output_folder
from ._gate import CERTIFY_GATES, GATES, certification_reasons, stays_usable
from ._job_result import JobResult
from ._now import now
from ._sections import certification_sections, comparison_section, first_section, parameter_section
from ._summary_tables import certify_table, summary_tables
from ._words import claim_of


def write_job(result: JobResult, out: str | Path) -> Report:
    """Write everything the main job found into a folder, which appears only when complete.

    Parameters
    ----------
    result : JobResult
        From `run_job`.
    out : str or Path
        Output folder.

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
    >>> demo = rt.project.read_project(rt.project.demo_project())
    >>> bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 50.0}},
    ...                 links=[{"between": ("bar", "room"), "conductance": 0.5}])
    >>> result = rt.project.run_job(replace(demo, system=bar, train=(), validation=(), boxes=rt.project.Boxes()))
    >>> report = rt.project.write_job(result, "results")
    >>> sorted(path.name for path in Path("results").iterdir())
    ['calibrated.toml', 'certificates', 'junit.xml', 'report.html', 'report.json', 'summary.json']
    """
    project, certified = result.project, result.certification
    sections = [comparison_section(result.comparisons, result.fit)] if result.comparisons else []
    if result.fit is not None:
        sections.append(parameter_section(result.fit, certified.parameters))
    sections.extend(certification_sections(certified))
    first = (first_section(result.comparisons, result.misfits),) if result.misfits else ()
    report = Report(title=project.name, subtitle=subtitle(result.system), label=project.label,
                    claims=claims(certified.checked, stays_usable(certified)), sections=tuple(sections),
                    provenance=provenance(project.files), generated=now(),
                    assumptions=machine_assumptions(result.system, certified.parameters is not None),
                    gate=result.reasons, gates=GATES, usable=certified.usable, first=first,
                    data=summary_tables(result))
    with output_folder(out) as folder:
        report = write_certification(result.certification.checked, report, folder)
        write_system(result.system, folder / "calibrated.toml")
        if result.fit is not None:
            result.fit.table().to_csv(folder / "parameters.csv", index_label="parameter")
    return report


def write_certify(result: Certification, files: tuple[Path, ...], out: str | Path) -> Report:
    """Write a certification without data; as `write_job`.

    Parameters
    ----------
    result : Certification
        From `certify_system`.
    files : tuple of Path
        Input files, for their hashes.
    out : str or Path
        Output folder.

    Returns
    -------
    Report

    Examples
    --------
    >>> import robthermal as rt
    >>> done = rt.project.certify_system(rt.systems.tclab(), rt.project.Boxes())
    >>> rt.project.write_certify(done, (), "certified").holds
    True
    """
    report = Report(title=result.system.name, subtitle=subtitle(result.system), label="",
                    claims=claims(result.checked, stays_usable(result)),
                    sections=tuple(certification_sections(result)), provenance=provenance(files),
                    generated=now(),
                    assumptions=machine_assumptions(result.system, result.parameters is not None),
                    gate=certification_reasons(result), gates=CERTIFY_GATES, usable=result.usable,
                    data={"certify": certify_table(result)})
    with output_folder(out) as folder:
        report = write_certification(result.checked, report, folder)
    return report


def claims(checked: Sequence[Checked], usable: bool = False) -> tuple[Claim, ...]:
    """Required claims, for the first screen; the others are in the table of certificates.

    Parameters
    ----------
    checked : sequence of Checked
        Certificates with their checks.
    usable : bool, optional
        Whether their currents are inside the usable range.
    """
    return tuple(claim_of(one.file, one.certificate, one.verdict, title=one.title, breaks=one.breaks, usable=usable)
                 for one in checked if one.required)


def provenance(files: tuple[Path, ...]) -> Mapping[str, str]:
    """Versions, and the SHA-256 of every input file by its name."""
    return {**versions(), **{f"SHA-256 of {file.name}": file_hash(file) for file in files}}


def subtitle(system: System) -> str:
    """What a machine consists of."""
    counts = {"lump": len(system.lumps), "module": len(system.modules), "heater": len(system.inputs),
              "sensor": len(system.sensors)}
    return f"{system.name}: " + ", ".join(f"{n} {what}{'s' * (n > 1)}" for what, n in counts.items() if n)
