"""Banner of a project."""

from __future__ import annotations

from ..provenance import simulated_label
from ..request import Project


def project_label(project: Project) -> str:
    """Banner of a project: its label, and that its records are simulated where a name or a file says so.

    Parameters
    ----------
    project : Project
        What is asked for.
    """
    records = [*project.train, *project.validation, *(path for one in project.identify for path in one.records)]
    said = "" if "simulated" in project.label.lower() else simulated_label(
        [project.name, project.system.name, *(path.name for path in records)], records)
    return "; ".join(filter(None, (project.label, said)))
