"""Write a certification without data: report, certificates, JUnit."""

from __future__ import annotations

from pathlib import Path

from ...report import Report
from ..claims import Certification, machine_assumptions, required_claims
from ..evidence import write_certification
from ..folder import output_folder
from ..network import network_section
from ..now import now
from ..provenance import provenance, simulated_label, subtitle
from ._reasons import CERTIFY_GATES, certification_reasons, stays_usable
from ._sections import certification_sections
from ._table import certify_table


def write_certify(result: Certification, files: tuple[Path, ...], out: str | Path) -> Report:
    """Write a certification without data; as `write_job`.

    Parameters
    ----------
    result : Certification
        Certification, as `certify_system` returns it.
    files : tuple of Path
        Input files, for their hashes.
    out : str or Path
        Output folder to create or replace.

    Returns
    -------
    Report

    Examples
    --------
    >>> import robthermal as rt
    >>> done = rt.jobs.certify_system(rt.systems.tclab(), rt.jobs.Boxes())
    >>> rt.jobs.write_certify(done, (), "certified").holds
    True
    """
    report = certification_report(result, files)
    with output_folder(out) as folder:
        report = write_certification(result.checked, report, folder)
    return report


def certification_report(result: Certification, files: tuple[Path, ...]) -> Report:
    """What is to be said of a certification, as yet without evidence and not written anywhere.

    Parameters
    ----------
    result : Certification
        Certification, as `certify_system` returns it.
    files : tuple of Path
        Input files, for their hashes.
    """
    return Report(title=result.system.name, subtitle=subtitle(result.system, result.system.name),
                  label=simulated_label([result.system.name, *(file.name for file in files)]),
                  claims=required_claims(result.checked, stays_usable(result)),
                  sections=tuple(certification_sections(result)), first=(network_section(result.system),),
                  provenance=provenance(files), generated=now(),
                  assumptions=machine_assumptions(result.system, result.parameters is not None),
                  gate=certification_reasons(result), gates=CERTIFY_GATES, usable=result.usable,
                  data={"certify": certify_table(result)})
