"""Commands of robthermal, called in this process, and what they said."""

from __future__ import annotations

import contextlib
import io
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest

from robthermal import cli


class Said(NamedTuple):
    """Exit status, standard output and standard error."""

    status: int
    out: str
    err: str


Run = Callable[..., Said]


def command(*words: object, folder: Path | None = None) -> Said:
    """The command line in this process, in a folder: an exception that would be a traceback is raised here."""
    out, err = io.StringIO(), io.StringIO()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("robthermal.cli._progress.EVERY", 3600.0)  # s: on a slow machine too, nothing but what was said
        patch.setattr(sys, "argv", ["robthermal", *map(str, words)])
        if folder is not None:
            patch.chdir(folder)
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), \
                warnings.catch_warnings(), pytest.raises(SystemExit) as stop:  # main() shows warnings its own way
            cli.main()
    code = stop.value.code
    return Said(code if isinstance(code, int) else int(code is not None), out.getvalue(), err.getvalue())


def without_progress(err: str) -> str:
    """Standard error without the plain lines that a slow machine sees every ten seconds."""
    return "".join(line for line in err.splitlines(keepends=True) if not line.endswith(" s so far\n"))
