"""Commands about frequency responses: estimate one from records, design the inputs of an experiment."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import robthermal as rt

from .terminal import ColumnMap, Json, ReadOption, answer, drawing, place, progress, reading, say, there


def frf(records: Annotated[list[Path], typer.Argument(help="Records of one machine.", metavar="RECORD.csv")],
        system: Annotated[Path | None, typer.Option("--system", help="System file: columns and poles.",
                                                     metavar="SYSTEM.toml")] = None,
        inputs: Annotated[list[str] | None, typer.Option("--input", help="Input column, may repeat.",
                                                         metavar="COLUMN")] = None,
        outputs: Annotated[list[str] | None, typer.Option("--output", help="Output column, may repeat.",
                                                          metavar="COLUMN")] = None,
        method: Annotated[str, typer.Option(help="etfe, spectral, lpm, lrm or lrmp.")] = "lpm",
        half_width: Annotated[int, typer.Option(help="Bins on each side of a local window.")] = 8,
        degree: Annotated[int, typer.Option(help="Degree of the local polynomials.")] = 2,
        poles: Annotated[list[float] | None, typer.Option("--pole", help="Prescribed pole [rad/s], negative, may "
                                                           "repeat.", metavar="VALUE")] = None,
        pole_deviation: Annotated[float | None, typer.Option(
            "--pole-deviation", help="Of lrmp: how uncertain its poles are, relative to their size; widens the bands.",
            metavar="SHARE")] = None,
        basis: Annotated[list[str] | None, typer.Option(
            "--basis", help="Of lrmp, instead of poles: diffusion, diffusion:held:TAU or diffusion:insulated:TAU [s], "
            "fractional:CORNER:ORDER [rad/s], may repeat.", metavar="FUNCTION")] = None,
        band: Annotated[tuple[float, float] | None, typer.Option(help="Frequencies to keep [Hz].",
                                                                     metavar="LO HI")] = None,
        reference: Annotated[list[str] | None, typer.Option(
            "--reference", help="Of a closed loop: column of a set-point or added excitation, one per input, may "
            "repeat.", metavar="COLUMN")] = None,
        instrument: Annotated[list[str] | None, typer.Option(
            "--instrument", help="Of a noisy input, as a measured room: column of a second sensor of it, may repeat.",
            metavar="INPUT=COLUMN")] = None,
        input_noise: Annotated[list[str] | None, typer.Option(
            "--input-noise", help="Standard deviation of the noise of an input [its unit], may repeat.",
            metavar="INPUT=VALUE")] = None,
        out: Annotated[Path, typer.Option("--out", help="Result (.json, .mat, .npz).", callback=place)] = Path(
            "frf.json"),
        plot: Annotated[Path | None, typer.Option("--plot", help="Bode plot with 95 % bands (.svg, .png, .pdf).",
                                                  callback=drawing)] = None,
        column: ColumnMap = None, record: ReadOption = None, as_json: Json = False) -> None:
    """Estimate a frequency response with its covariance, from records that need not be in steady state.

    Example: robthermal frf run1.csv run2.csv --system setup.toml --method lrmp --out frf.json --plot frf.svg
    """
    there(*records, *([system] if system else []))
    model = rt.read_system(system) if system else None
    with progress() as stage:
        stage("estimating the frequency response")
        G = rt.jobs.measured.estimate_response(records, system=model, inputs=inputs or [], outputs=outputs or [],
                                               method=method, half_width=half_width, degree=degree, poles=poles or [],
                                               band=band, tables=reading(record, column), reference=reference or [],
                                               instruments=rt.jobs.measured.instruments_from_text(instrument or []),
                                               input_noise=rt.jobs.measured.noise_from_text(input_noise or []),
                                               pole_deviation=pole_deviation, basis=basis or [])
    G.save(out)
    if plot:
        G.plot().flat[0].figure.savefig(plot)
    summary = {"out": str(out), "method": G.method, "bins": len(G), "inputs": list(G.input_names),
               "outputs": list(G.output_names), "suspect_bins": int(G.suspect.sum()), "notes": list(G.notes)}
    answer(summary, as_json, lambda: say(str(G), *G.notes, f"frequency response: {out}"))


def excitation(names: Annotated[list[str], typer.Argument(help="Input columns.", metavar="NAME")],
               period: Annotated[int, typer.Option(help="Samples in a period.")],
               sample_time: Annotated[float, typer.Option(help="Time between two samples [s].")],
               band: Annotated[tuple[float, float], typer.Option(help="Excited frequencies [Hz].", metavar="LO HI")],
               amplitude: Annotated[float, typer.Option(help="Largest deviation from the mean [unit of the inputs].")],
               periods: Annotated[int, typer.Option(help="How many periods.")] = 1,
               nonnegative: Annotated[bool, typer.Option(
                   "--nonnegative", help="Shift the mean so that no value is negative: heaters.")] = False,
               arrangement: Annotated[str, typer.Option(
                   help="Of several inputs: orthogonal, zippered or independent.")] = "orthogonal",
               seed: Annotated[int, typer.Option(help="Of the random phases.")] = 0,
               system: Annotated[Path | None, typer.Option("--system", help="System file, for the design check.",
                                                            metavar="SYSTEM.toml")] = None,
               out: Annotated[Path, typer.Option("--out", help="Record to write.", callback=place)] = Path(
                   "excitation.csv"),
               as_json: Json = False) -> None:
    """Design multisine inputs, and say before the experiment what they will leave unresolved.

    Example: robthermal excitation m1 m2 --period 7200 --sample-time 1 --band 0.0005 0.1 --amplitude 0.5
    """
    there(*([system] if system else []))
    model = rt.read_system(system) if system else None
    u = rt.jobs.measured.design_excitation(names, period=period, sample_time=sample_time, band=band,
                                           amplitude=amplitude, periods=periods, nonnegative=nonnegative,
                                           arrangement=arrangement, seed=seed)
    design = rt.signals.design_check(u, sample_time=sample_time, poles=model.poles()) if model else None
    files = rt.jobs.measured.write_excitation(u, names, out)
    summary = {"out": [str(file) for file in files], "crest_factors": u.crest_factors.max(axis=(0, 1)).tolist(),
               "design_check": design.outcome.text if design else "not made: give --system"}
    answer(summary, as_json, lambda: say(str(design) if design else "No design check without --system.",
                                         *(f"experiment: {file}" for file in files)))
