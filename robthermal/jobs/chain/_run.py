"""The chain: its stages one after the other, each taken from the cache where nothing it depends on has changed."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from threadpoolctl import threadpool_limits

from ...errors import Diverged, InputError
from ...report import Report, Stage, versions
from ..folder import check_free
from ..rebuild import checked_again
from ..report_files import write_report
from ..request import Project
from ._assemble import assemble
from ._cache import clear_other, commit, drop_report, forget, read_cached, staging, still_there
from ._calibrate import CALIBRATE
from ._certify import CERTIFY
from ._context import Context, Finished, StageJob
from ._couple import COUPLE
from ._design import DESIGN
from ._diagnose import DIAGNOSE
from ._identify import IDENTIFY
from ._parts import certified_system

STAGES: tuple[StageJob, ...] = (IDENTIFY, CALIBRATE, DIAGNOSE, CERTIFY, DESIGN, COUPLE)
NAMES = tuple(stage.name for stage in STAGES)
Progress = Callable[..., None]


@threadpool_limits.wrap(limits=1, user_api="blas")  # products are small: threads only wait for each other
def run_project(project: Project, out: str | Path, *, only: Sequence[str] = (), start: str = "", force: bool = False,
                progress: Progress = lambda stage, done=None, total=None: None) -> Report:
    """Run the chain of a project: identify, calibrate, diagnose, certify, design, couple, as far as it asks for them.

    Every stage keeps its result; it is computed again only if its input files, its tables, the stages before it or the
    version of the package have changed, or a file that it wrote. Certificates of a kept result are verified again.

    Parameters
    ----------
    project : Project
        Project, as `read_project` returns it.
    out : str or Path
        Results folder to create, or to bring up to date.
    only : sequence of str, optional
        Names of the stages to compute; what they need must be there from an earlier run. Default: all.
    start : str, optional
        First stage that is computed again even if nothing has changed, with all after it.
    force : bool, optional
        Whether all stages are computed again.
    progress : callable, optional
        Called with a sentence, and before every stage with its number and how many there are.

    Returns
    -------
    Report
        What report.html shows.

    Raises
    ------
    InputError
        Anything wrong with the project's data and tables: finished stages stay, the next run continues. What [design]
        and [couple] ask for is looked at before any stage is computed. A stage in `only` without what it needs; names
        that are no stages; a folder that is in use for something else.

    Examples
    --------
    >>> from pathlib import Path
    >>> import robthermal as rt
    >>> _ = Path("bar.toml").write_text('[system]\\nname = "bar"\\ntemperature_unit = "K"\\n'
    ...     '[ambients.room]\\ntemperature = 295.0\\n'
    ...     '[lumps.bar]\\ncapacity = 50.0\\n[[links]]\\nbetween = ["bar", "room"]\\nconductance = 0.5\\n')
    >>> _ = Path("project.toml").write_text('[project]\\nname = "bar"\\nsystem = "bar.toml"\\n')
    >>> project = rt.jobs.read_project("project.toml")
    >>> [stage.status for stage in rt.jobs.run_project(project, "results").stages]
    ['skipped', 'skipped', 'skipped', 'done', 'skipped', 'skipped']
    >>> rt.jobs.run_project(project, "results").stages[3].status
    'cached'
    """
    target = Path(out)
    _check_names(only, start)
    check_free(target)
    for job in STAGES:
        if not job.absent(project) and (not only or job.name in only):
            job.check(project)
    context = Context(project, target, progress)
    stages: list[Stage] = []
    try:
        asked = [job.name for job in STAGES if not job.absent(project)]
        for job in STAGES:
            if job.name in asked:
                progress(job.name, asked.index(job.name), len(asked))
            forced = force or bool(start) and NAMES.index(job.name) >= NAMES.index(start)
            stages.append(_stage(job, context, only, forced, stages))
    except (InputError, Diverged, KeyboardInterrupt) as error:
        _write_failed(context, stages, STAGES[len(stages)].name, error)
        raise
    progress("writing the report", len(asked), len(asked))
    return write_report(assemble(context, stages, certified_system(context)[0]), target)


def _check_names(only: Sequence[str], start: str) -> None:
    for name, option in (*((one, "--only") for one in only), *([(start, "--from")] if start else [])):
        if name not in NAMES:
            raise InputError(f"there is no stage {name!r}", where=option, expected=", ".join(NAMES))


def _stage(job: StageJob, context: Context, only: Sequence[str], forced: bool, before: Sequence[Stage]) -> Stage:
    """Compute a stage, or take its earlier result, or skip it."""
    project, wanted = context.project, not only or job.name in only
    absent = job.absent(project)
    if absent:
        if not only:
            forget(context.out, job.name)
        return Stage(job.name, "skipped", text=absent)
    lacking = [name for name in job.after(project) if name not in context.finished and _asked(name, before)]
    if lacking and wanted:
        raise InputError(f"{job.name} needs {', '.join(lacking)}, which {'has' if len(lacking) == 1 else 'have'} no "
                         "result for these inputs", where="--only",
                         remedy=f"Write --only {','.join([*lacking, *only])}, or leave --only out.")
    key = job.key(context, versions()["robthermal"])
    kept = None if lacking or wanted and forced else _kept(job, context, key)
    if kept is not None:
        context.finished[job.name] = kept
        return Stage(job.name, "cached", kept.seconds, key)
    if not wanted:
        return Stage(job.name, "skipped", text=f"It was left out by --only {','.join(only)}, and there is no earlier "
                     "result for these inputs.")
    context.finished[job.name] = found = _computed(job, context, key)
    return Stage(job.name, "done", found.seconds, key)


def _asked(name: str, before: Sequence[Stage]) -> bool:
    """Whether a stage without result lacks only because it was left out."""
    return any(stage.name == name and "--only" in stage.text for stage in before)


def _kept(job: StageJob, context: Context, key: str) -> Finished | None:
    """The earlier result, every certificate of it verified again; None where it is not that of this key."""
    found = read_cached(context.out, job.name)
    if found is None or found.key != key or not still_there(context.out, found):
        return None
    if not found.report.evidence:
        return found
    context.progress(f"verifying the certificates of {job.name} again")
    again = checked_again(found.report, context.out)
    claims = [old if old.good and new.good else new for old, new in zip(found.report.claims, again.claims, strict=True)]
    return replace(found, report=replace(again, claims=tuple(claims)))


def _computed(job: StageJob, context: Context, key: str) -> Finished:
    begin = time.perf_counter()
    with staging(context.out) as folder:
        report = job.run(context, folder)
        clear_other(context.out)
        return commit(context.out, job.name, folder, report, key, round(time.perf_counter() - begin, 3))


def _write_failed(context: Context, stages: Sequence[Stage], failed: str, error: BaseException) -> None:
    """The report of the stages that have a result, with a stage that failed; nothing if there is none."""
    if not context.finished or "--only" in getattr(error, "where", ""):
        return
    text = "It was interrupted." if isinstance(error, KeyboardInterrupt) else str(error)
    later = NAMES[NAMES.index(failed) + 1:]
    found = [*stages, Stage(failed, "failed", text=text),
             *(Stage(name, "skipped", text=f"It comes after {failed}, which could not be computed.") for name in later)]
    drop_report(context.out)
    write_report(assemble(context, found, context.project.system), context.out)
    error.add_note(f"The stages before it are done: {context.out / 'report.html'}")
