"""Write a project file for the main job that points at the measured records, wherever they are.

    python examples/tclab/main_job.py [FOLDER] [PROJECT.toml]
    robthermal run PROJECT.toml --out tclab-report

FOLDER holds ``tclab_dowling`` (default: ``../shared/data`` beside the checkout); PROJECT.toml defaults to
``tclab-project.toml`` in the current folder.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
DEFAULT = HERE.parents[2] / "shared" / "data"


def write_project(folder: Path, target: Path) -> Path:
    """Copy project.toml with the paths of the records and of the system file made absolute."""

    def absolute(path: re.Match[str]) -> str:
        name = Path(path[1])
        found = folder / "tclab_dowling" / name.name if name.parts[0] == "data" else HERE / name
        return f'"{found.resolve().as_posix()}"'

    text = (HERE / "project.toml").read_text(encoding="utf-8")
    target.write_text(re.sub(r'"([^"\n]+\.(?:csv|toml))"', absolute, text), encoding="utf-8")
    return target


def main(folder: Path, target: Path) -> None:
    """Write the project file, and say what to do with it."""
    print(f"robthermal run {write_project(folder, target)} --out tclab-report")


if __name__ == "__main__":
    given = [Path(text) for text in sys.argv[1:]]
    main(given[0] if given else DEFAULT, given[1] if len(given) > 1 else Path("tclab-project.toml"))
