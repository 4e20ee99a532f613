"""Command line: argument parsing only."""

from __future__ import annotations

import gc
import json
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer

import robthermal as rt  # the whole package, so that every command loads only the parts it needs

from ..errors import Diverged, InputError
from . import diagnosing, frequency, learn, results
from .terminal import (
    AmbientRange,
    Box,
    ColumnMap,
    Json,
    OperatingPoint,
    Out,
    ReadOption,
    SeveralFiles,
    SystemFile,
    answer,
    calibrations,
    exit_unless,
    free,
    place,
    progress,
    progress_bar,
    reading,
    say,
    show_report,
    system_place,
    there,
)

app = typer.Typer(name="robthermal", no_args_is_help=True, add_completion=True, pretty_exceptions_enable=False,
                  context_settings={"help_option_names": ["-h", "--help"]},
                  rich_markup_mode=None)  # markup would swallow units in brackets

# A wrong command line. It has no public name that all versions share: newer ones of typer bring their own click.
_UsageError: type[Exception] = typer.BadParameter.__mro__[1]
_INTERRUPTED = 130
_UNFITTED = "no [fit] table: calibrate has nothing to fit, and diagnose takes every number as right"  # seldom meant
_OBJECTS = 5_000  # made between two searches for cycles: a command keeps most, and 700 cost it a tenth of its time

MedianFilter = Annotated[float | None, typer.Option("--median-filter", help="Length of a median filter [s].")]


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"robthermal {rt.__version__}")
        raise typer.Exit


@app.callback()
def robthermal(show_version: Annotated[bool, typer.Option(
        "--version", callback=_print_version, is_eager=True, help="Print the version and exit.")] = False) -> None:
    """From measured data to verified certificates for thermal systems with thermoelectric modules."""


@app.command()
def demo(out: Out = Path("robthermal-demo"), as_json: Json = False) -> None:
    """Run the main job on the embedded two-module system (simulated records).

    Example: robthermal demo --out demo
    """
    _run(rt.jobs.read_project(rt.jobs.demo_project()), out, as_json)


@app.command()
def run(project: Annotated[Path, typer.Argument(help="Project file.", metavar="PROJECT.toml")],
        out: Out = Path("robthermal-out"),
        confidence: Annotated[float | None, typer.Option(
            help="Of the parameter ranges, above 0.5; default that of the file.")] = None,
        tolerance: Annotated[list[str] | None, typer.Option(
            help="How far a prediction may be off beyond the noise [K], may repeat.",
            metavar="SENSOR=VALUE|default=VALUE")] = None,
        only: Annotated[str, typer.Option(
            help="Compute these stages alone; what they need must be there from an earlier run.",
            metavar="STAGE,STAGE")] = "",
        start: Annotated[str, typer.Option(
            "--from", help="Compute this stage and all after it again, even if nothing has changed.",
            metavar="STAGE")] = "",
        force: Annotated[bool, typer.Option("--force", help="Compute all stages again.")] = False,
        as_json: Json = False) -> None:
    """Run a project: identify, calibrate, diagnose, certify, design, couple, as far as its file asks for them.

    What has not changed since the last run is taken from the results folder; its certificates are verified again.

    Example: robthermal run project.toml --out results
    """
    there(project)
    job = rt.jobs.read_project(project)
    job = rt.jobs.request.gate_from_text(job, confidence=confidence, tolerance=tolerance or [])
    _run(job, out, as_json, [name.strip() for name in only.split(",") if name.strip()], start, force)


def _run(job: rt.jobs.request.Project, out: Path, as_json: bool, only: Sequence[str] = (), start: str = "",
         force: bool = False) -> None:
    try:
        with progress() as stage:
            report = rt.jobs.run_project(job, out, only=only, start=start, force=force, progress=stage)
    except KeyboardInterrupt:
        kept = f"finished stages are kept in {out}: the same command goes on from there"
        _stop(f"interrupted; {kept if out.exists() else 'nothing was written'}", _INTERRUPTED)
    show_report(report, out, as_json, stages={one.name: one.status for one in report.stages})


@app.command()
def check(files: Annotated[list[Path], typer.Argument(help="A system file (.toml) and measured files, or these alone.",
                                                      metavar="SYSTEM.toml|FILE")],
          column: ColumnMap = None, record: ReadOption = None, as_json: Json = False) -> None:
    """Say whether a system file and its records are sound, and how each measured file is understood.

    Example: robthermal check setup.toml run1.csv run2.csv
    """
    system = files[0] if files[0].suffix.lower() == ".toml" else None
    there(*files)
    found = rt.read_system(system) if system else None
    tables = reading(record, column)
    measured = files[1:] if system else files
    with progress() as stage:
        stage("reading measured files")
        reports = rt.jobs.measured.import_reports(measured, found, tables=tables)
    summary: dict[str, Any] = {"records": [{"file": str(file), "import": report.to_dict()}
                           for file, report in zip(measured, reports, strict=True)]}
    if found is not None:
        constants = -1.0 / found.poles() if len(found.lumps) <= 2000 else None
        summary = {"system": found.name, "lumps": len(found.lumps), "links": len(found.links),
                   "modules": list(found.modules), "heaters": list(found.inputs), "sensors": list(found.sensors),
                   "time_constants_s": None if constants is None else [float(constants.min()), float(constants.max())],
                   **summary}
    sound = [] if found is None else [f"{found.name}: sound.", *([] if found.fit else [_UNFITTED])]
    answer(summary, as_json, lambda: say(*sound, *map(str, reports)))


@app.command()
def simulate(system: SystemFile, record: Annotated[Path, typer.Argument(help="Record with the inputs.",
                                                                           metavar="RECORD.csv")],
             out: Annotated[Path, typer.Option("--out", callback=place,
                                               help="Record to write (.csv, .parquet, .mat).")],
             column: ColumnMap = None, read: ReadOption = None, as_json: Json = False) -> None:
    """Simulate a system with the inputs of a record.

    Example: robthermal simulate setup.toml inputs.csv --out simulated.csv
    """
    there(system, record)
    found = rt.read_system(system)
    with progress() as stage:
        stage("reading the record")
        parts = rt.jobs.measured.read_files([record], found, tables=reading(read, column))
        stage("simulating")
        results = [rt.thermal.simulate(found, part) for part in parts]
    temperatures = [*results[0].output_names, *(n for n in results[0].input_names if n in found.ambients)]
    rt.signals.save_records(results, out, temperature_unit=found.temperature_unit, temperatures=temperatures)
    n, outputs = sum(map(len, results)), list(results[0].output_names)
    summary = {"out": str(out), "samples": n, "parts": len(results), "outputs": outputs}
    answer(summary, as_json, lambda: say(f"{n} samples of {len(outputs)} outputs: {out}"))


@app.command()
def calibrate(system: SystemFile,
              records: Annotated[list[Path], typer.Argument(
                  help="Training records, frequency responses from `robthermal frf`, or both.", metavar="TRAIN.csv")],
              validation: Annotated[list[Path] | None, typer.Option(
                  "--validation", help="Held-out record or response, may repeat.", metavar="FILE")] = None,
              out: Annotated[Path, typer.Option("--out", help="Calibrated system file.", callback=system_place)] = Path(
                  "calibrated.toml"),
              max_iterations: Annotated[int, typer.Option(help="A fit that needs more has not converged.")] = 200,
              median_filter: MedianFilter = None,
              operating_point: OperatingPoint = None, column: ColumnMap = None, record: ReadOption = None,
              as_json: Json = False) -> None:
    """Fit the parameters in the [fit] table of a system to records, frequency responses or both.

    Example: robthermal calibrate setup.toml train.csv --validation held_out.csv --out calibrated.toml
    """
    there(system, *records, *(validation or []))
    found = rt.read_system(system)
    point = rt.jobs.request.point_from_text(found, operating_point or [])
    with progress() as stage:
        stage("calibrating")
        fit = rt.jobs.measured.calibrate_files(found, records, validation or [], median_filter=median_filter,
                                               operating_point=point, tables=reading(record, column),
                                               max_iterations=max_iterations)
    rt.thermal.write_system(fit.system, out)
    rt.jobs.request.write_calibrated(fit, (system, *records), out.with_suffix(".json"))
    answer(fit.to_dict(), as_json, lambda: say(str(fit), f"calibrated system: {out}",
                                               f"its parameters with covariance: {out.with_suffix('.json')}"))
    exit_unless(bool(fit.outcome))


app.command(cls=SeveralFiles)(diagnosing.diagnose)
app.command()(frequency.frf)
app.command()(frequency.excitation)


@app.command()
def certify(system: SystemFile, out: Out = Path("robthermal-certified"),
            temperature: Box = None,
            current: Annotated[list[str] | None, typer.Option(
                help="Range of one module [A]; default its declared limits.", metavar="NAME=LO:HI")] = None,
            ambient: AmbientRange = None,
            setpoint: Annotated[list[str] | None, typer.Option(
                help="Temperature of a cold face that is regulated, in the unit of the file.",
                metavar="NAME=VALUE")] = None,
            parameters: Annotated[list[str] | None, typer.Option(
                help="Ranges of uncertain parameters: calibrated.json, or one range [its unit]; may repeat.",
                metavar="FILE.json|NAME=LO:HI")] = None,
            confidence: Annotated[float, typer.Option(help="Of ranges from a calibration, above 0.5.")] = 0.95,
            method: Annotated[str, typer.Option(
                help="Norm of the contraction: energy, sum, max or lyapunov.")] = "energy",
            structure: Annotated[str, typer.Option(help="With lyapunov: full or block P.")] = "full",
            large: Annotated[bool, typer.Option(
                "--large", help="With lyapunov: more than 40 lumps too, slowly.")] = False,
            as_json: Json = False) -> None:
    """Certify a system: contraction in a box, a box that is never left, current limits, runaway limit.

    Example: robthermal certify setup.toml --current m1=0:1.5 --current m2=0:1.5 --out certified
    """
    given = calibrations(parameters)
    there(system, *given)
    found = rt.read_system(system)
    boxes = rt.jobs.request.boxes_from_text(found, temperature=temperature, current=current or [],
                                            ambient=ambient or [], setpoint=setpoint or [], method=method,
                                            structure=structure, large=large, parameters=parameters or [],
                                            confidence=confidence)
    ranges = rt.jobs.request.ranges_from_text(found, parameters or [], confidence)
    free(out)
    with progress() as stage:
        result = rt.jobs.certify_system(found, boxes, stage, parameters=ranges or None)
        stage("writing the report")
        report = rt.jobs.write_certify(result, (system, *given), out)
    show_report(report, out, as_json)


@app.command()
def design(system: SystemFile, out: Out = Path("robthermal-design"),
           setpoint: Annotated[list[str] | None, typer.Option(
               help="Temperature to hold, in the unit of the file; default the lower end of --temperature.",
               metavar="NAME=VALUE")] = None,
           regulate: Annotated[list[str] | None, typer.Option(
               help="Sensor or lump that a module regulates, may repeat; default its cold face.",
               metavar="MODULE=NAME")] = None,
           setpoint_ramp: Annotated[list[str] | None, typer.Option(
               help="Largest rate of a set-point [K/s], one per module, may repeat; default a step.",
               metavar="MODULE=RATE")] = None,
           current: Annotated[list[str] | None, typer.Option(
               help="Limits of one module [A]; default the largest that are certified.", metavar="NAME=LO:HI")] = None,
           ambient: AmbientRange = None, temperature: Box = None,
           bandwidth: Annotated[float | None, typer.Option(
               help="Crossover of the loops [rad/s]; default the largest that keeps the margins, else 0.02.")] = None,
           margin: Annotated[list[str] | None, typer.Option(
               help="Least gain [-], phase [deg], modulus [-] or delay [s] margin of every loop, may repeat.",
               metavar="NAME=VALUE")] = None,
           sample_time: Annotated[float, typer.Option(help="Of controller and observer [s].")] = 1.0,
           sensors: Annotated[str | None, typer.Option(
               help="What the observer reads; default every sensor that does not lag. \"\" for no observer.",
               metavar="NAME,NAME")] = None,
           method: Annotated[str, typer.Option(
               help="Of the certificates: energy, sum, max or lyapunov. Or hinf, h2, mixed, mu, output-feedback, "
               "frf-pid, polytope, lpv, tem, anti-windup, mpc: a synthesis for PLANT.toml (docs/command_line.md); of "
               "the other options only --out and --json count.")
           ] = "energy",
           parameters: Annotated[list[str] | None, typer.Option(
               help="Ranges of uncertain parameters: calibrated.json, or one range [its unit]; may repeat.",
               metavar="FILE.json|NAME=LO:HI")] = None,
           confidence: Annotated[float, typer.Option(help="Of ranges from a calibration, above 0.5.")] = 0.95,
           export: Annotated[str | None, typer.Option(
               help="Law, controller and observer for other programs too: c, mat, json, with commas.")] = None,
           as_json: Json = False) -> None:
    """Design a controller: certified current limits, linearizing feedback law, PI, observer, certificates, report.

    Example: robthermal design setup.toml --setpoint m1=5 --setpoint m2=5 --bandwidth 0.02 --out design
    """
    there(system)
    if method in rt.jobs.synthesize.METHODS:
        job = rt.jobs.read_plant_file(system)
        free(out)
        with progress() as stage:
            stage(f"designing by {method}")
            synthesis = rt.jobs.synthesize_plant(job, method)
            stage("writing the report")
            report = rt.jobs.write_synthesis(synthesis, out)
        show_report(report, out, as_json, controller=str(out / "design.json"))
        return
    given = calibrations(parameters)
    there(*given)
    found = rt.read_system(system)
    wanted = rt.jobs.design.design_from_text(
        found, setpoint=setpoint or [], current=current or [], ambient=ambient or [], temperature=temperature,
        bandwidth=bandwidth, sample_time=sample_time, sensors=sensors, method=method, regulate=regulate or [],
        margins=margin or [], export=export, ramp=setpoint_ramp or [],
        parameters=rt.jobs.request.ranges_from_text(found, parameters or [], confidence))
    free(out)
    with progress() as stage:
        result = rt.jobs.design_system(found, wanted, stage)
        stage("writing the report")
        report = rt.jobs.write_design(result, (system, *given), out)
    show_report(report, out, as_json, controller=str(out / "design.json"))


@app.command("map")
def limit_map(system: SystemFile, out: Out = Path("robthermal-map"),
              ambient: Annotated[str | None, typer.Option(
                  help="Of all ambients, in the unit of the file; default 10 K around nominal, 5 values.",
                  metavar="LO,HI,N")] = None,
              load: Annotated[str | None, typer.Option(
                  help="Heat into every cold face [W]; default up to the runaway load, 6 values.",
                  metavar="LO,HI,N")] = None,
              setpoint: Annotated[str | None, typer.Option(
                  help="Of all cold faces, in the unit of the file; default the lower end of --temperature to nominal "
                  "ambient, 3 values.", metavar="LO,HI,N")] = None,
              temperature: Box = None,
              method: Annotated[str, typer.Option(
                  help="Norm of the contraction: energy, sum, max or lyapunov.")] = "energy",
              as_json: Json = False) -> None:
    """Map the allowed current over ambient temperature, heat load and set-point.

    Example: robthermal map setup.toml --ambient 15,35,5 --load 0,5,6 --setpoint 5,15,3 --out map
    """
    there(system)
    found = rt.read_system(system)
    wanted = rt.jobs.map.map_from_text(found, ambient=ambient, load=load, setpoint=setpoint, temperature=temperature,
                                       method=method)
    free(out)
    with progress_bar("conditions") as done:
        result = rt.jobs.map_system(found, wanted, done)
    report = rt.jobs.write_map(result, found, (system,), out)
    show_report(report, out, as_json, data=str(out / "map.csv"))


@app.command()
def couple(spec: Annotated[Path, typer.Argument(help="Two subsystems and their design.", metavar="SPEC.toml")],
           out: Out = Path("robthermal-coupling"), as_json: Json = False) -> None:
    """Couple two controlled subsystems: filters, robust stability against measured plants, certificates, report.

    Example: robthermal couple SPEC.toml --out coupled
    """
    there(spec)
    job = rt.jobs.read_coupling(spec)
    free(out)
    with progress() as stage:
        result = rt.jobs.couple_subsystems(job, stage)
        stage("writing the report")
        report = rt.jobs.write_coupling(result, out)
    show_report(report, out, as_json, result.remarks, verdict=result.filters.verdict,
                filters=str(out / "coupling.json"))


for _command in (results.report, results.verify, learn.new, learn.explain, learn.datasheet):
    app.command()(_command)
for _known in app.registered_commands:  # whole sentences in the list of commands; they would be cut to one line
    _known.short_help = (_known.callback.__doc__ or "").partition("\n")[0]


def main() -> None:
    """Entry point: one clear message on standard error and exit status 2 for bad input; with --json also as JSON."""
    gc.set_threshold(_OBJECTS)
    warnings.simplefilter("always", UserWarning)
    warnings.showwarning = lambda message, *rest, **kwargs: typer.echo(f"note: {message}", err=True)
    try:
        status = app(prog_name="robthermal", standalone_mode=False)  # the exit status, or None where all went well
    except _UsageError as error:
        _stop(_usage(error), 2)
    except InputError as error:
        message = "\n".join([str(error), *getattr(error, "__notes__", [])])
        _stop(message, 2, what=error.what, where=error.where, expected=error.expected, remedy=error.remedy)
    except Diverged as error:
        _stop(str(error), 1, time=error.time)
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
    end = "" if said.endswith("?") else "."
    return f"{said}{end} See {command} --help." if said and "\n" not in said else f"no command\n{said}"


def _stop(message: str, status: int, **details: object) -> NoReturn:
    typer.echo(f"robthermal: {message}", err=True)
    if "--json" in sys.argv:  # a script that asked for JSON gets it, whatever happened
        error = {"message": message, "status": status, **details}
        typer.echo(json.dumps({"error": error}, indent=1, default=str))
    sys.exit(status)
