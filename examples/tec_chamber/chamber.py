"""From the raw logs of a thermoelectric chamber to the report of the main job.

    python examples/tec_chamber/chamber.py FOLDER [OUT]

FOLDER holds run01.csv, run02.csv, run04.csv and run06.csv (README.md says where they come from); OUT is the folder of
results, default ``chamber-report``.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

import robthermal as rt

HERE = Path(__file__).resolve().parent


def write_project(folder: Path, target: Path) -> Path:
    """Copy project.toml with the paths of the records and of the system file made absolute."""
    text = (HERE / "project.toml").read_text(encoding="utf-8")
    text = re.sub(r'"data/([^"\n]+)"', lambda path: f'"{(folder / path[1]).resolve().as_posix()}"', text)
    text = text.replace('"setup.toml"', f'"{(HERE / "setup.toml").as_posix()}"')
    target.write_text(text, encoding="utf-8")
    return target


def main(folder: Path, out: Path) -> None:
    """How every log is understood, then the whole job."""
    system = rt.read_system(HERE / "setup.toml")
    for name in ("run01", "run04", "run06", "run02"):
        print(rt.read_record(folder / f"{name}.csv", system).imported)
    project = write_project(folder, out.with_suffix(".toml"))
    report = rt.jobs.run_project(rt.jobs.read_project(project), out)
    print(report.verdict, *report.reasons, sep="\n  ")
    print(f"report: {out / 'report.html'}; the same by: robthermal run {project} --out {out}")


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    main(Path(sys.argv[1]), Path(sys.argv[2] if len(sys.argv) > 2 else "chamber-report"))
