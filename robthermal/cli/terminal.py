"""What the command line says, and where: tables and JSON; options that several commands share."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text
from typer.core import TyperCommand

import robthermal as rt

from ..errors import InputError, Outcome
from ._progress import Told as Told
from ._progress import duration as duration
from ._progress import progress as progress
from ._progress import progress_bar as progress_bar

_PIPE_WIDTH = 120  # columns of a table in a pipe: a log is wider than a terminal of the last century
_WIDE = 100  # columns from which a table of claims has room for their boxes
Out = Annotated[Path, typer.Option("--out", help="Output folder; appears only when complete.")]
Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]
ColumnMap = Annotated[list[str] | None, typer.Option(
    "--column", help="Which column of the file a name is, for example 'T1=NTC 1'; may repeat.", metavar="NAME=HEADER")]
ReadOption = Annotated[list[str] | None, typer.Option(
    "--record", help="How files are read: a key of [record], for example gaps=fill; may repeat.", metavar="KEY=VALUE")]
SystemFile = Annotated[Path, typer.Argument(help="System file (TOML).", metavar="SYSTEM.toml")]
Box = Annotated[tuple[float, float] | None, typer.Option(
    "--temperature", help="Box of all lumps, in the unit of the file; default 5 to 85 °C.", metavar="LO HI")]
AmbientRange = Annotated[list[str] | None, typer.Option(
    "--ambient", help="Range of one ambient, in the unit of the file.", metavar="NAME=LO:HI")]

OperatingPoint = Annotated[list[str] | None, typer.Option(
    help="Of frequency responses: mean of an input [unit, A] or ambient [unit of the file], may repeat.",
    metavar="NAME=VALUE")]


class SeveralFiles(TyperCommand):
    """A command whose option --reference takes all that follows it up to the next option, and may be repeated."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Arguments with the option before each of its files.

        Parameters
        ----------
        ctx : click.Context
            Of the command line.
        args : list of str
            As they were typed.
        """
        out: list[str] = []
        taking = False
        for arg in args:
            if taking and not arg.startswith("-"):
                out += ["--reference", arg]
                continue
            taking = arg == "--reference"
            out += [] if taking else [arg]
        if args and args[-1] == "--reference":
            out.append("--reference")  # nothing follows: say so
        return list(super().parse_args(ctx, out))


def reading(record: list[str] | None, column: list[str] | None) -> tuple[Any, ...]:
    """How measured files are read, from the options --record and --column."""
    return rt.jobs.measured.reading_from_text(record or [], column or [])


def there(*files: Path) -> None:
    """Refuse input files that do not exist: said before the work, not after a part of it."""
    for file in files:
        if not file.exists():
            raise InputError("there is no such file", where=str(file), remedy="Check the path.")


def calibrations(parameters: list[str] | None) -> list[Path]:
    """The files among the values of --parameters."""
    return [Path(text) for text in parameters or [] if text.endswith(".json")]


def place(file: Path | None) -> Path | None:
    """An output file whose folder exists: said before the work, not after it, as is a file that is replaced."""
    if file is not None and not file.parent.is_dir():
        raise typer.BadParameter(f"the folder {str(file.parent)!r} does not exist")
    if file is not None and file.is_file():
        typer.echo(f"note: {file} exists, and is replaced", err=True)
    return file


def system_place(file: Path) -> Path:
    """As `place`, for a system file: commands take a file for a record or a system by its name."""
    if file.suffix.lower() != ".toml":
        raise typer.BadParameter(f"{file.name!r} is to be a system file: give it a name that ends in .toml, as "
                                 f"{file.with_suffix('.toml').name}")
    place(file)
    return file


def free(out: Path) -> None:
    """Refuse a folder with other things in it before the work; an earlier result there is replaced, and said."""
    rt.jobs.folder.check_free(out)
    if (out / rt.jobs.folder.MARKER).is_file():
        typer.echo(f"note: {out} holds an earlier result, which is replaced", err=True)


def drawing(file: Path | None) -> Path | None:
    """An output file that matplotlib can write."""
    if file is not None and file.suffix.lower() not in (".svg", ".png", ".pdf"):
        raise typer.BadParameter(f"the file name ends in {file.suffix!r}, not in .svg, .png or .pdf")
    return place(file)


def show_report(report: Any, out: Path, as_json: bool, remarks: Sequence[Outcome] = (), **more: Any) -> None:
    """Verdict, reasons and claims of a report, for people or as JSON; exit status 1 where the verdict is FAIL."""
    def show() -> None:
        console = Console()
        if not console.is_terminal:
            console.width = max(console.width, _PIPE_WIDTH)
        wide = console.width >= _WIDE  # else the boxes are in the report alone
        table = Table("claim", "answer", *["box"] * wide, "margin")
        for claim in report.claims:
            said = Text(_word(claim), style="green" if claim.good else "bold red")
            table.add_row(Text(claim.name), said, *[Text(claim.box)] * wide, Text(claim.margin))  # [1/s]: no markup
        console.print(table)
        say(f"verdict: {report.verdict}", *(f"  {one.level}: {one}" for one in report.told))
        say(*(f"usable current, {row.direction}{' (parameter ranges)' * (row.parameters == 'ranges')}: {row.range}"
              for row in report.usable))
        say(*(f"{name}: {_listed(value)}" for name, value in more.items()))
        say(*(f"remark: {remark.text}" for remark in remarks), f"report: {out / 'report.html'}")

    summary = {"verdict": report.verdict, "holds": report.holds,
               "reasons": [one.to_dict() for one in report.reasons], "out": str(out),
               "report": str(out / "report.html"), **more,
               "claims": [{"title": c.name, "holds": c.holds, "verified": c.verified, "reason": c.reason}
                          for c in report.claims],
               "remarks": [{"code": remark.code, "text": remark.text} for remark in remarks]}
    answer(summary, as_json, show)
    exit_unless(report.holds)


def _listed(value: Any) -> str:
    """A mapping by its values: "done: calibrate, certify; skipped: couple"; a list with commas; else as it is."""
    if isinstance(value, dict):
        kinds = dict.fromkeys(value.values())
        return "; ".join(f"{kind}: {', '.join(name for name, one in value.items() if one == kind)}" for kind in kinds)
    return ", ".join(map(str, value)) if isinstance(value, (list, tuple)) else str(value)


def _word(claim: Any) -> str:
    if claim.tested:
        return "passed" if claim.good else f"NOT PASSED: {claim.why}"
    return "certified, verified" if claim.good else f"NOT CERTIFIED: {claim.why}"


def answer(summary: Any, as_json: bool, show: Callable[[], None]) -> None:
    """Print a result for scripts or for people."""
    if as_json:
        typer.echo(json.dumps(summary, indent=1, allow_nan=False, default=str))
    else:
        show()


def say(*lines: str) -> None:
    """Print lines."""
    for line in lines:
        typer.echo(line)


def exit_unless(good: bool) -> None:
    """Exit status 1 where the honest answer is no."""
    if not good:
        raise typer.Exit(1)
