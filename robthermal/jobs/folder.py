"""Output folders that appear only when complete."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ..errors import InputError

MARKER = "summary.json"  # every finished output folder has one
CACHE = ".cache"  # of a chain: also one that was interrupted before its first summary has it


@contextmanager
def output_folder(path: str | Path) -> Iterator[Path]:
    """Write into a temporary folder beside `path`, which takes its place when the block ends well.

    Parameters
    ----------
    path : str or Path
        Where the results go. An earlier result there is replaced; anything else is refused.

    Yields
    ------
    Path
        Folder to write into.

    Raises
    ------
    InputError
        Something else is in the way, or the place cannot be written.

    Examples
    --------
    >>> with output_folder("results") as folder:
    ...     _ = (folder / "summary.json").write_text("{}")
    >>> sorted(p.name for p in Path("results").iterdir())
    ['summary.json']
    """
    target = Path(path)
    check_free(target)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        partial = Path(tempfile.mkdtemp(prefix=f".{target.name}.", dir=target.parent))
    except OSError as error:
        raise InputError(f"cannot be written ({error.strerror})", where=str(target),
                         remedy="Choose another folder with --out.") from None
    try:
        yield partial
        partial.chmod(0o755)
        if target.exists():
            old = Path(tempfile.mkdtemp(prefix=f".{target.name}.old.", dir=target.parent))
            target.rename(old / "result")
            partial.rename(target)
            shutil.rmtree(old)
        else:
            partial.rename(target)
    finally:  # also on Ctrl-C: nothing half-written stays
        shutil.rmtree(partial, ignore_errors=True)


def check_results(folder: Path) -> None:
    """Refuse a folder that no command has finished.

    Parameters
    ----------
    folder : Path
        Results folder about to be read.

    Raises
    ------
    InputError
        No report.json in it.

    Examples
    --------
    >>> check_results(Path("nowhere"))
    Traceback (most recent call last):
    ...
    robthermal.errors.InputError: nowhere: holds no report.json. Expected a folder that run, ... or diagnose wrote.
    """
    if not (folder / "report.json").is_file():
        raise InputError("holds no report.json", where=str(folder),
                         expected="a folder that run, demo, certify, design, map, couple or diagnose wrote")


def check_free(target: Path) -> None:
    """Refuse to overwrite what is not an earlier result.

    Parameters
    ----------
    target : Path
        Output folder about to be written.

    Raises
    ------
    InputError
        A file, or a folder with other things in it.

    Examples
    --------
    >>> check_free(Path("results"))  # nothing there: free
    >>> _ = Path("results").write_text("mine")
    >>> check_free(Path("results"))
    Traceback (most recent call last):
    ...
    robthermal.errors.InputError: results: is a file. Choose another folder with --out.
    """
    ours = (target / MARKER).is_file() or any((target / CACHE).glob("*.json"))
    if target.is_dir() and not ours and any(target.iterdir()):
        raise InputError("is a folder with other things in it", where=str(target), remedy="Choose another with --out.")
    if target.exists() and not target.is_dir():
        raise InputError("is a file", where=str(target), remedy="Choose another folder with --out.")
    above = next(folder for folder in target.absolute().parents if folder.exists())
    if not above.is_dir() or not os.access(above, os.W_OK):
        raise InputError(f"cannot be written: {str(above)!r} is not a folder that may be written", where=str(target),
                         remedy="Choose another folder with --out.")
