"""A report into a folder, in all its forms."""

from __future__ import annotations

from pathlib import Path

from ..report import Report, write_content, write_html, write_json, write_junit


def write_report(report: Report, folder: Path) -> Report:
    """Page, JUnit and summary, and everything from which they can be written again.

    Parameters
    ----------
    report : Report
        What to show.
    folder : Path
        Existing folder to write into.
    """
    write_html(report, folder / "report.html")
    write_junit(report, folder / "junit.xml")
    write_json(report, folder / "summary.json")
    write_content(report, folder / "report.json")
    return report
