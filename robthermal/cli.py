"""Command line: argument parsing only."""

from __future__ import annotations

import json
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

import robthermal as rt  # the front door, so that every command loads only the rooms it needs

from .errors import Diverged, InputError

app = typer.Typer(name="robthermal", no_args_is_help=True, add_completion=True, pretty_exceptions_enable=False,
                  context_settings={"help_option_names": ["-h", "--help"]},
                  rich_markup_mode=None)  # markup would swallow units in brackets

# A wrong command line. It has no public name that all versions share: newer ones of typer bring their own click.
_UsageError: type[Exception] = typer.BadParameter.__mro__[1]
_INTERRUPTED = 130

Out = Annotated[Path, typer.Option("--out", help="Output folder; appears only when complete.")]
Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]
SystemFile = Annotated[Path, typer.Argument(help="System file (TOML).", metavar="SYSTEM.toml")]
MedianFilter = Annotated[float | None, typer.Option("--median-filter", help="Length of a median filter [s].")]


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"robthermal {rt.__version__}")
        raise typer.Exit


def _place(file: Path | None) -> Path | None:
    if file is not None and not file.parent.is_dir():  # said before the work, not after it
        raise typer.BadParameter(f"the folder {str(file.parent)!r} does not exist")
    return file


def _drawing(file: Path | None) -> Path | None:
    if file is not None and file.suffix.lower() not in (".svg", ".png", ".pdf"):
        raise typer.BadParameter(f"the file name ends in {file.suffix!r}, not in .svg, .png or .pdf")
    return _place(file)


@app.callback()
def robthermal(show_version: Annotated[bool, typer.Option(
        "--version", callback=_print_version, is_eager=True, help="Print the version and exit.")] = False) -> None:
    """From measured data to verified certificates for thermal systems with thermoelectric modules."""


@app.command()
def demo(out: Out = Path("robthermal-demo"), as_json: Json = False) -> None:
    """Run the main job on the embedded two-module system (simulated records).

    Example: robthermal demo --out demo
    """
    _run(rt.project.demo_project(), out, as_json)


@app.command()
def run(project: Annotated[Path, typer.Argument(help="Project file.", metavar="PROJECT.toml")],
        out: Out = Path("robthermal-out"), as_json: Json = False) -> None:
    """Run the main job on your system and records: data, calibrated model, certificates, report.

    Example: robthermal run project.toml --out results
    """
    _run(project, out, as_json)


def _run(project: Path, out: Path, as_json: bool) -> None:
    job = rt.project.read_project(project)
    rt.project.check_free(out)
    with _progress() as say:
        result = rt.project.run_job(job, say)
        say("writing the report")
        report = rt.project.write_job(result, out)
    _show_report(report, out, as_json)


@app.command()
def check(system: SystemFile, records: Annotated[list[Path] | None, typer.Argument(metavar="[RECORD]...")] = None,
          as_json: Json = False) -> None:
    """Say whether a system file and its records are sound.

    Example: robthermal check setup.toml run1.csv run2.csv
    """
    found = rt.read_system(system)
    read = [rt.read_record(path, found) for path in records or []]
    constants = rt.thermal.time_constants(found)["time constant [s]"] if len(found.lumps) <= 2000 else None
    summary = {"system": found.name, "lumps": len(found.lumps), "links": len(found.links),
               "modules": list(found.modules), "heaters": list(found.inputs), "sensors": list(found.sensors),
               "time_constants_s": None if constants is None else [float(constants.min()), float(constants.max())],
               "records": [{"name": r.name, "samples": len(r), "sample_time_s": r.sample_time, "notes": list(r.notes)}
                           for r in read]}
    _print(summary, as_json, lambda: _text(f"{found.name}: sound.", *map(str, read)))


@app.command()
def simulate(system: SystemFile, record: Annotated[Path, typer.Argument(help="Record with the inputs.")],
             out: Annotated[Path, typer.Option("--out", callback=_place,
                                               help="Record to write (.csv, .parquet, .mat).")],
             as_json: Json = False) -> None:
    """Simulate a system with the inputs of a record.

    Example: robthermal simulate setup.toml inputs.csv --out simulated.csv
    """
    found = rt.read_system(system)
    given = rt.read_record(record, found)
    with _progress() as say:
        say("simulating")
        result = rt.thermal.simulate(found, given)
    temperatures = [*result.output_names, *(n for n in result.input_names if n in found.ambients)]
    result.save(out, temperature_unit=found.temperature_unit, temperatures=temperatures)
    summary = {"out": str(out), "samples": len(result), "outputs": list(result.output_names)}
    _print(summary, as_json, lambda: _text(f"{len(result)} samples of {len(result.output_names)} outputs: {out}"))


@app.command()
def calibrate(system: SystemFile, records: Annotated[list[Path], typer.Argument(help="Training records.")],
              validation: Annotated[list[Path] | None, typer.Option("--validation", help="Held-out record.")] = None,
              out: Annotated[Path, typer.Option("--out", help="Calibrated system file.", callback=_place)] = Path(
                  "calibrated.toml"),
              median_filter: MedianFilter = None, as_json: Json = False) -> None:
    """Fit the parameters in the [fit] table of a system to records.

    Example: robthermal calibrate setup.toml train.csv --validation held_out.csv --out calibrated.toml
    """
    found = rt.read_system(system)
    train, held_out = ([rt.read_record(path, found, median_filter=median_filter) for path in paths]
                       for paths in (records, validation or []))
    with _progress() as say:
        say("calibrating")
        fit = rt.calibrate(found, train, validation=held_out or None)
    rt.thermal.write_system(fit.system, out)
    _print(fit.to_dict(), as_json, lambda: _text(str(fit), f"calibrated system: {out}"))
    _exit_unless(bool(fit.outcome))


@app.command()
def frf(records: Annotated[list[Path], typer.Argument(help="Records of one machine.")],
        system: Annotated[Path | None, typer.Option("--system", help="System file: columns and poles.")] = None,
        inputs: Annotated[list[str] | None, typer.Option("--input", help="Input column, may repeat.")] = None,
        outputs: Annotated[list[str] | None, typer.Option("--output", help="Output column, may repeat.")] = None,
        method: Annotated[str, typer.Option(help="etfe, spectral, lpm, lrm or lrmp.")] = "lpm",
        half_width: Annotated[int, typer.Option(help="Bins on each side of a local window.")] = 8,
        degree: Annotated[int, typer.Option(help="Degree of the local polynomials.")] = 2,
        poles: Annotated[list[float] | None, typer.Option("--pole", help="Prescribed pole [rad/s], negative.")] = None,
        band: Annotated[tuple[float, float] | None, typer.Option(help="Frequencies to keep [Hz].")] = None,
        out: Annotated[Path, typer.Option("--out", help="Result (.json, .mat, .npz).", callback=_place)] = Path(
            "frf.json"),
        plot: Annotated[Path | None, typer.Option("--plot", help="Bode plot with 95 % bands (.svg, .png, .pdf).",
                                                  callback=_drawing)] = None,
        as_json: Json = False) -> None:
    """Estimate a frequency response with its covariance, from records that need not be in steady state.

    Example: robthermal frf run1.csv run2.csv --system setup.toml --method lrmp --out frf.json --plot frf.svg
    """
    model = rt.read_system(system) if system else None
    with _progress() as say:
        say("estimating the frequency response")
        G = rt.project.estimate_response(records, system=model, inputs=inputs or [], outputs=outputs or [],
                                         method=method, half_width=half_width, degree=degree, poles=poles or [],
                                         band=band)
    G.save(out)
    if plot:
        G.plot().flat[0].figure.savefig(plot)
    summary = {"out": str(out), "method": G.method, "bins": len(G), "inputs": list(G.input_names),
               "outputs": list(G.output_names), "suspect_bins": int(G.suspect.sum()), "notes": list(G.notes)}
    _print(summary, as_json, lambda: _text(str(G), *G.notes, f"frequency response: {out}"))


@app.command()
def excitation(names: Annotated[list[str], typer.Argument(help="Input columns.", metavar="NAME...")],
               period: Annotated[int, typer.Option(help="Samples in a period.")],
               sample_time: Annotated[float, typer.Option(help="[s].")],
               band: Annotated[tuple[float, float], typer.Option(help="Excited frequencies [Hz].", metavar="LO HI")],
               amplitude: Annotated[float, typer.Option(help="Largest deviation from the mean [unit of the inputs].")],
               periods: Annotated[int, typer.Option(help="How many periods.")] = 1,
               nonnegative: Annotated[bool, typer.Option("--nonnegative", help="No value below 0.")] = False,
               arrangement: Annotated[str, typer.Option(help="orthogonal, zippered, independent.")] = "orthogonal",
               seed: Annotated[int, typer.Option(help="Of the random phases.")] = 0,
               system: Annotated[Path | None, typer.Option("--system", help="For the design check.")] = None,
               out: Annotated[Path, typer.Option("--out", help="Record to write.", callback=_place)] = Path(
                   "excitation.csv"),
               as_json: Json = False) -> None:
    """Design multisine inputs, and say before the experiment what they will leave unresolved.

    Example: robthermal excitation m1 m2 --period 7200 --sample-time 1 --band 0.0005 0.1 --amplitude 0.5
    """
    model = rt.read_system(system) if system else None
    u = rt.project.design_excitation(names, period=period, sample_time=sample_time, band=band, amplitude=amplitude,
                                     periods=periods, nonnegative=nonnegative, arrangement=arrangement, seed=seed)
    design = rt.signals.design_check(u, sample_time=sample_time, poles=model.poles()) if model else None
    files = rt.project.write_excitation(u, names, out)
    summary = {"out": [str(file) for file in files], "crest_factors": u.crest_factors.max(axis=(0, 1)).tolist(),
               "design_check": design.outcome.text if design else "not made: give --system"}
    _print(summary, as_json, lambda: _text(str(design) if design else "No design check without --system.",
                                           *(f"experiment: {file}" for file in files)))


@app.command()
def certify(system: SystemFile, out: Out = Path("robthermal-certified"),
            temperature: Annotated[tuple[float, float] | None, typer.Option(
                help="Box of all lumps, in the unit of the file; default 5 to 85 °C.", metavar="LO HI")] = None,
            current: Annotated[list[str] | None, typer.Option(
                help="Range of one module [A]; default its declared limits.", metavar="NAME=LO:HI")] = None,
            ambient: Annotated[list[str] | None, typer.Option(
                help="Range of one ambient, in the unit of the file.", metavar="NAME=LO:HI")] = None,
            setpoint: Annotated[list[str] | None, typer.Option(
                help="Regulated cold face, in the unit of the file.", metavar="NAME=VALUE")] = None,
            method: Annotated[str, typer.Option(help="energy, sum or max.")] = "energy", as_json: Json = False) -> None:
    """Certify a system: contraction in a box, a box that is never left, current limits, runaway limit.

    Example: robthermal certify setup.toml --current m1=0:1.5 --current m2=0:1.5 --out certified
    """
    found = rt.read_system(system)
    boxes = rt.project.boxes_from_text(found, temperature=temperature, current=current or [], ambient=ambient or [],
                                       setpoint=setpoint or [], method=method)
    rt.project.check_free(out)
    with _progress() as say:
        result = rt.project.certify_system(found, boxes, say)
        say("writing the report")
        report = rt.project.write_certify(result, (system,), out)
    _show_report(report, out, as_json)


@app.command()
def verify(certificates: Annotated[list[Path], typer.Argument(metavar="CERT.json|DIR...")],
           as_json: Json = False) -> None:
    """Re-derive certificates from their files alone, in ball arithmetic. Exit 0 valid, 1 not valid, 2 unreadable.

    Example: robthermal verify certified/certificates/*.json
    """
    rows: list[dict[str, Any]] = []
    status = 0
    for path in rt.project.certificate_files(certificates):
        try:
            verdict = rt.verify(rt.Certificate.load(path))
            rows.append({"file": str(path), "valid": verdict.valid, "reason": verdict.reason,
                         "margins": verdict.margins})
            status = max(status, 0 if verdict.valid else 1)
        except InputError as error:
            rows.append({"file": str(path), "valid": None, "reason": str(error), "margins": {}})
            status = 2
    _print(rows, as_json, lambda: _text(*(f"{_word(r['valid'])}  {r['file']}: {r['reason']}" for r in rows)))
    raise typer.Exit(status)


def _word(valid: bool | None) -> str:
    return {True: "valid     ", False: "NOT VALID ", None: "unreadable"}[valid]


def _show_report(report: Any, out: Path, as_json: bool) -> None:
    def show() -> None:
        table = Table("claim", "answer", "box", "margin")
        for claim in report.claims:
            good = claim.holds and claim.verified
            table.add_row(claim.title, "certified, verified" if good else f"NOT CERTIFIED: {claim.reason}", claim.box,
                          claim.margin)
        Console().print(table)
        _text(f"report: {out / 'report.html'}")

    summary = {"holds": report.holds, "out": str(out), "report": str(out / "report.html"),
               "claims": [{"title": c.title, "holds": c.holds, "verified": c.verified, "reason": c.reason}
                          for c in report.claims]}
    _print(summary, as_json, show)
    _exit_unless(report.holds)


def _print(summary: Any, as_json: bool, show: Callable[[], None]) -> None:
    if as_json:
        typer.echo(json.dumps(summary, indent=1, allow_nan=False, default=str))
    else:
        show()


def _text(*lines: str) -> None:
    for line in lines:
        typer.echo(line)


def _exit_unless(good: bool) -> None:
    if not good:
        raise typer.Exit(1)


@contextmanager
def _progress() -> Iterator[Callable[[str], None]]:
    """A spinner with the stage on a terminal; nothing in a pipe."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda stage: None
        return
    with console.status("starting") as status:
        yield lambda stage: status.update(stage)


def main() -> None:
    """Entry point: one clear message on standard error and exit status 2 for bad input."""
    warnings.simplefilter("always", UserWarning)
    warnings.showwarning = lambda message, *rest, **kwargs: typer.echo(f"note: {message}", err=True)
    try:
        status = app(prog_name="robthermal", standalone_mode=False)  # the exit status, or None where all went well
    except _UsageError as error:
        _stop(_usage(error), 2)
    except InputError as error:
        _stop(str(error), 2)
    except Diverged as error:
        _stop(str(error), 1)
    except OSError as error:  # a full disk, a folder without permission
        _stop(f"{error.filename or 'a file'}: {error.strerror or error}", 2)
    except (KeyboardInterrupt, typer.Abort):
        status = _INTERRUPTED
    if status == _INTERRUPTED:  # typer turns Ctrl-C into an abort or into this status, depending on its version
        _stop("interrupted; nothing was written", _INTERRUPTED)
    sys.exit(status)


def _usage(error: Any) -> str:
    """What is wrong with the command line, and where to look; the help itself where nothing was asked."""
    said = error.format_message().rstrip(".")
    command = error.ctx.command_path if error.ctx else "robthermal"
    return f"{said}. See {command} --help." if said and "\n" not in said else f"no command\n{said}"


def _stop(message: str, status: int) -> None:
    typer.echo(f"robthermal: {message}", err=True)
    sys.exit(status)
