"""Results of stages kept beside the report: .cache/STAGE.json, valid while its key and its files are what they were."""

from __future__ import annotations

import os
import secrets
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from ...errors import InputError
from ...report import Report, file_hash, is_unchanged, read_content, write_content
from ..folder import CACHE
from ._context import Finished

_WRITTEN_ANEW = ("report.html", "report.json", "summary.json", "junit.xml")  # of the whole chain, by every run


def read_cached(out: Path, stage: str) -> Finished | None:
    """Result of a stage in an earlier run; None where there is none, or it was changed.

    Parameters
    ----------
    out : Path
        Results folder of the chain.
    stage : str
        Name of the stage.
    """
    path = out / CACHE / f"{stage}.json"
    try:
        if not path.is_file() or not is_unchanged(path):
            return None
        report = read_content(path)
        kept: Mapping[str, Any] = report.data["cache"]
        files = {str(name): str(value) for name, value in kept["files"].items()}
        data = {key: value for key, value in report.data.items() if key != "cache"}
        return Finished(replace(report, data=data), files, str(kept["key"]), float(kept["seconds"]), cached=True)
    except (InputError, OSError, KeyError, TypeError, ValueError, AttributeError):
        return None  # a cache that cannot be read is none: the stage is computed


def still_there(out: Path, found: Finished) -> bool:
    """Whether every file that the stage wrote is what it was.

    Parameters
    ----------
    out : Path
        Results folder of the chain.
    found : Finished
        Result of an earlier run.
    """
    return all((out / name).is_file() and file_hash(out / name) == value for name, value in found.files.items())


@contextmanager
def staging(out: Path) -> Iterator[Path]:
    """A folder for the files of one stage, in the results folder; nothing of it stays.

    Parameters
    ----------
    out : Path
        Results folder; made if it is not there, and removed again if nothing came into it.
    """
    made = not out.exists()
    folder = out / CACHE / f"part-{secrets.token_hex(4)}"
    try:  # before the folder is there: Ctrl-C may come as soon as it is
        _make(folder, out)
        yield folder
    finally:  # also on Ctrl-C
        try:
            _remove(folder, out, made)
        except KeyboardInterrupt:  # while it was being removed
            _remove(folder, out, made)
            raise


def _make(folder: Path, out: Path) -> None:
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        folder.mkdir(mode=0o700)
    except OSError as error:
        raise InputError(f"cannot be written ({error.strerror})", where=str(out),
                         remedy="Choose another folder with --out.") from None


def _remove(folder: Path, out: Path, made: bool) -> None:
    """Remove the folder of a stage, and a results folder that was made for it and holds nothing."""
    shutil.rmtree(folder, ignore_errors=True)
    if made and folder.parent.is_dir() and not any(folder.parent.iterdir()):
        shutil.rmtree(out, ignore_errors=True)


def commit(out: Path, stage: str, folder: Path, report: Report, key: str, seconds: float) -> Finished:
    """Move the files of a finished stage into the results folder, then keep its result.

    Parameters
    ----------
    out : Path
        Results folder of the chain.
    stage : str
        Name of the stage.
    folder : Path
        Its files, laid out as in the results folder.
    report : Report
        Its part of the report.
    key : str
        Hash of everything it depends on.
    seconds : float
        Time it took [s].
    """
    forget(out, stage)
    files = {path.relative_to(folder).as_posix(): file_hash(path)
             for path in sorted(folder.rglob("*")) if path.is_file()}
    for entry in sorted(folder.iterdir()):
        _move(entry, out / entry.name)
    kept = {**report.data, "cache": {"key": key, "seconds": seconds, "files": files}}
    write_content(replace(report, data=kept), out / CACHE / f"{stage}.json")
    return Finished(report, files, key, seconds)


def _move(entry: Path, target: Path) -> None:
    if entry.is_dir():
        entry.chmod(0o755)
    if target.is_dir() and not target.is_symlink():
        shutil.rmtree(target)
    os.replace(entry, target)


def forget(out: Path, stage: str) -> None:
    """Remove what an earlier run of a stage left.

    Parameters
    ----------
    out : Path
        Results folder of the chain.
    stage : str
        Name of the stage.
    """
    old = read_cached(out, stage)
    (out / CACHE / f"{stage}.json").unlink(missing_ok=True)  # first: without it nobody takes the files for its result
    for name in old.files if old else ():
        place = out / name
        if ".." not in place.relative_to(out).parts and place.is_file():
            place.unlink()
            if place.parent != out and not any(place.parent.iterdir()):
                place.parent.rmdir()


def clear_other(out: Path) -> None:
    """Remove the results that another command left in a folder without a cache.

    Parameters
    ----------
    out : Path
        Results folder that may be overwritten.
    """
    if out.is_dir() and not any((out / CACHE).glob("*.json")):
        for entry in out.iterdir():
            if entry.name != CACHE:
                shutil.rmtree(entry) if entry.is_dir() and not entry.is_symlink() else entry.unlink()


def drop_report(out: Path) -> None:
    """Remove the report of an earlier run.

    Parameters
    ----------
    out : Path
        Results folder of the chain.
    """
    for name in _WRITTEN_ANEW:
        (out / name).unlink(missing_ok=True)
