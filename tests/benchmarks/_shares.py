"""Where the processor time of a command goes, by looking at its stack every few milliseconds of it.

Run as ``python _shares.py FILE COMMAND …``: the command runs in this process, and FILE gets the seconds of each share.
A look counts all processor time since the last one, so that nothing is lost in compiled code, which is interrupted at
its end. Children (workers of a map) are not looked at: their time counts as mathematics, though it holds their imports.
"""

from __future__ import annotations

import json
import resource
import signal
import sys
import time
from pathlib import Path
from types import FrameType

EVERY = 0.002  # s of processor time between two looks
IMPORTS, FILES, MATHEMATICS = "imports", "figures and files", "mathematics"
# Figures, tables, pages, certificates as text, records and systems as files; what computes is everything else.
_WRITES = ("matplotlib", "mpl_toolkits", "PIL", "pyparsing", "jinja2", "markupsafe", "rich", "typer", "json", "tomllib",
           "pandas", "pyarrow", "xml", "robthermal.report", "robthermal.cli", "robthermal.jobs",
           "robthermal.signals.importing", "robthermal._write", "robthermal.export")


def share_of(frame: FrameType | None) -> str:
    """Share that a stack belongs to: imports if any frame imports, else that of the innermost frame that says."""
    found = ""
    while frame is not None:
        name = frame.f_globals.get("__name__", "")
        if frame.f_code.co_filename.startswith("<frozen importlib"):
            return IMPORTS
        if not found:
            wrote = any(f"{name}.".startswith(f"{one}.") for one in _WRITES)
            found = FILES if wrote else MATHEMATICS * (name.partition(".")[0] in ("robthermal", "recheck"))
        frame = frame.f_back
    return found or IMPORTS  # the interpreter itself


def main(target: Path, command: list[str]) -> None:
    """Run a command, and write what its time went into."""
    spent = {IMPORTS: time.process_time(), FILES: 0.0, MATHEMATICS: 0.0}  # so far: the interpreter and this file
    last = time.process_time()

    def look(_number: int, frame: FrameType | None) -> None:
        nonlocal last
        now = time.process_time()
        spent[share_of(frame)] += now - last
        last = now

    signal.signal(signal.SIGPROF, look)
    signal.setitimer(signal.ITIMER_PROF, EVERY, EVERY)
    sys.argv = ["robthermal", *command]
    try:
        from robthermal import cli  # the import is what is measured

        cli.main()
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        children = resource.getrusage(resource.RUSAGE_CHILDREN)
        spent[MATHEMATICS] += children.ru_utime + children.ru_stime
        target.write_text(json.dumps(spent), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
