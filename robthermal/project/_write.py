"""Write the results of a job: report, certificates, JUnit, calibrated system."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import log
from pathlib import Path

from ..report import Claim, Report, file_hash, versions
from ..thermal import System, write_system
from ._assumptions import machine_assumptions
from ._claims import Certification, Checked
from ._evidence import write_certification
from ._folder import output_folder
from ._job import JobResult
from ._now import now
from ._sections import certification_sections, comparison_section, parameter_section

_ZERO = 273.15


def write_job(result: JobResult, out: str | Path) -> Report:
    """Write everything the main job found into a folder, which appears only when complete.

    Parameters
    ----------
    result : JobResult
        From `run_job`.
    out : str or Path
        Output folder.

    Returns
    -------
    Report
        What report.html shows.

    Raises
    ------
    InputError
        If the folder cannot be written, or holds something else.

    Examples
    --------
    >>> from dataclasses import replace
    >>> from pathlib import Path
    >>> import robthermal as rt
    >>> demo = rt.project.read_project(rt.project.demo_project())
    >>> bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 50.0}},
    ...                 links=[{"between": ("bar", "room"), "conductance": 0.5}])
    >>> result = rt.project.run_job(replace(demo, system=bar, train=(), validation=(), boxes=rt.project.Boxes()))
    >>> report = rt.project.write_job(result, "results")
    >>> sorted(path.name for path in Path("results").iterdir())
    ['calibrated.toml', 'certificates', 'junit.xml', 'report.html', 'report.json', 'summary.json']
    """
    project = result.project
    sections = [comparison_section(result.comparisons, result.fit)] if result.comparisons else []
    if result.fit is not None:
        sections.append(parameter_section(result.fit))
    sections.extend(certification_sections(result.certification))
    report = Report(title=project.name, subtitle=subtitle(result.system), label=project.label,
                    claims=claims(result.system, result.certification.checked), sections=tuple(sections),
                    provenance=provenance(project.files), assumptions=machine_assumptions(result.system),
                    generated=now())
    with output_folder(out) as folder:
        report = write_certification(result.certification.checked, report, folder)
        write_system(result.system, folder / "calibrated.toml")
        if result.fit is not None:
            result.fit.table().to_csv(folder / "parameters.csv", index_label="parameter")
    return report


def write_certify(result: Certification, files: tuple[Path, ...], out: str | Path) -> Report:
    """Write a certification without data; as `write_job`.

    Parameters
    ----------
    result : Certification
        From `certify_system`.
    files : tuple of Path
        Input files, for their hashes.
    out : str or Path
        Output folder.

    Returns
    -------
    Report

    Examples
    --------
    >>> import robthermal as rt
    >>> done = rt.project.certify_system(rt.systems.tclab(), rt.project.Boxes())
    >>> rt.project.write_certify(done, (), "certified").holds
    True
    """
    report = Report(title=result.system.name, subtitle=subtitle(result.system), label="",
                    claims=claims(result.system, result.checked), sections=tuple(certification_sections(result)),
                    provenance=provenance(files), assumptions=machine_assumptions(result.system), generated=now())
    with output_folder(out) as folder:
        report = write_certification(result.checked, report, folder)
    return report


def claims(system: System, checked: Sequence[Checked]) -> tuple[Claim, ...]:
    """Required claims, for the first screen; the others are in the table of certificates."""
    return tuple(_claim(one, system) for one in checked if one.required)


def provenance(files: tuple[Path, ...]) -> Mapping[str, str]:
    """Versions, and the SHA-256 of every input file by its name."""
    return {**versions(), **{f"SHA-256 of {file.name}": file_hash(file) for file in files}}


def _claim(checked: Checked, system: System) -> Claim:
    cert, verdict = checked.certificate, checked.verdict
    margins = verdict.margins if verdict else {}
    reason = cert.reason if not cert.holds else ("" if checked.good else verdict.reason if verdict else "not verified")
    sentences = _SENTENCES if system.modules else _SENTENCES | _WITHOUT_MODULES
    return Claim(title=checked.title, sentence=sentences[checked.key], holds=cert.holds, verified=checked.good,
                 box=_box(checked), margin=_margin(checked, margins),
                 how=_HOW.get(cert.kind, cert.kind), reason=reason,
                 file=f"certificates/{checked.key}.json", kind=cert.kind, seconds=verdict.seconds if verdict else 0.0)


_SENTENCES = {  # the exact sentences, with all numbers, are in the appendix, "Exact claims"
    "contraction": "For every lump temperature and module current in the box, however the currents change, any two "
                   "temperature histories approach each other: no thermal runaway inside this box.",
    "box": "A machine that starts inside the ranges of its lumps stays inside them, whatever the currents, heats and "
           "ambients do within theirs.",
    "box_contraction": "Inside those ranges any two temperature histories approach each other too: together with the "
                       "claim before, the machine cannot run away thermally from there.",
    "observer": "For every temperature, estimate and current in the box the error of the observer shrinks from sample "
                "to sample, however the currents change.",
    "map": "For every lump temperature in the box and every current up to the largest of the map, any two temperature "
           "histories approach each other: no thermal runaway inside this box.",
}
_WITHOUT_MODULES = {
    "contraction": "For every lump temperature in the box any two temperature histories under the same heats approach "
                   "each other: no thermal runaway inside this box.",
    "box": "A machine that starts inside the ranges of its lumps stays inside them, whatever the heats and ambients do "
           "within theirs.",
}
_HOW = {
    "contraction": "One norm in which the Jacobian contracts everywhere in the box; re-derived in ball arithmetic.",
    "invariance": "On every face of the box the heat flows inwards (Nagumo); re-derived in ball arithmetic.",
    "observer": "One norm in which the sampled error shrinks everywhere in the box; re-derived in ball arithmetic.",
}


def _box(checked: Checked) -> str:
    currents = checked.certificate.region.get("current", {})
    parts = [f"{name}: {float(low):g} to {float(high):g} A" for name, (low, high) in currents.items()]
    box = checked.certificate.region.get("temperature")
    if isinstance(box, Mapping):
        ends = [float(value) for pair in box.values() for value in pair]
        parts.append(f"every lump in its own range, overall {min(ends) - _ZERO:.1f} to {max(ends) - _ZERO:.1f} °C")
    elif box is not None:
        parts.append(f"all lumps {float(box[0]) - _ZERO:.6g} to {float(box[1]) - _ZERO:.6g} °C")
    ambient = checked.certificate.region.get("ambient", {})
    parts += [f"{name}: {float(lo) - _ZERO:.6g} to {float(hi) - _ZERO:.6g} °C" for name, (lo, hi) in ambient.items()]
    heat = checked.certificate.region.get("heat", {})
    parts += [f"heat into {name}: {float(lo):g} to {float(hi):g} W" for name, (lo, hi) in heat.items()]
    return "; ".join(parts)


def _margin(checked: Checked, margins: Mapping[str, float]) -> str:
    if not checked.good:
        return "none"
    if checked.certificate.kind == "observer":
        factor = float(checked.certificate.evidence["contraction"])
        tau = -float(checked.certificate.region["sample_time"]) / log(factor)
        return f"errors die out with a time constant of at most {tau:.4g} s (factor {factor:.6g} per sample)"
    if checked.certificate.kind == "contraction":
        rate = float(checked.certificate.evidence["rate"])
        return f"differences die out with a time constant of at most {1 / rate:.4g} s (rate {rate:.4g} 1/s)"
    return ", ".join(f"at least {value:.3g} W flow inwards on every face" if key == "heat" else f"{key} {value:.3g}"
                     for key, value in margins.items())


def subtitle(system: System) -> str:
    """What a machine consists of."""
    counts = {"lump": len(system.lumps), "module": len(system.modules), "heater": len(system.inputs),
              "sensor": len(system.sensors)}
    return f"{system.name}: " + ", ".join(f"{n} {what}{'s' * (n > 1)}" for what, n in counts.items() if n)
