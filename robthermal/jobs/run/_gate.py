"""The gates of a job: everything beside the claims that decides its verdict, as reasons with a code."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..._celsius import ZERO_CELSIUS
from ...report import Reason
from ..certify import certification_reasons, remark
from ..claims import Certification, GateCode
from ..request import Gate
from ._facts import DataFacts, DiagnosisFacts, data_facts, diagnosis_facts
from ._label import project_label
from ._misfit import Misfit
from ._result import Doubted, JobResult

_FAR, _SHARE = 10.0, 0.2  # K, and part of a current, that a claim may reach beyond the records
_WARMER, _MORE = 0.5, 0.02  # K, and part of a heat, that the records may be outside of a claim
_LOOK = "Find what the model lacks with `robthermal diagnose`;"  # of the remedy for a misfit
_OF_CLAIMS = (GateCode.NOT_CERTIFIED, GateCode.NOT_VERIFIED, GateCode.NOT_ROBUST)  # the cases of the claims say these
_ELSEWHERE = (GateCode.HEATERS_OFF, GateCode.REPORT_CHANGED)  # said by other commands
GATES = tuple(code.code for code in GateCode if code not in (*_OF_CLAIMS, *_ELSEWHERE))


def gate_reasons(result: JobResult) -> tuple[Reason, ...]:
    """Reasons of the verdict of a job, beside those of its claims.

    Parameters
    ----------
    result : JobResult
        Result of the main job, as `run_job` returns it.
    """
    facts = data_facts(result.system, result.comparisons, result.misfits, fit=result.fit)
    diagnosed = diagnosis_facts(result.diagnosis.diagnosis) if result.diagnosis else None
    label = f"{project_label(result.project)} {result.project.name}"
    found = [*data_reasons(facts, diagnosed, label), *claim_reasons(result.certification, result.doubted, facts)]
    return applied(found, result.project.gate)


def applied(reasons: Sequence[Reason], gate: Gate) -> tuple[Reason, ...]:
    """Reasons as the gate counts them.

    Parameters
    ----------
    reasons : sequence of Reason
        Reasons as the stages give them.
    gate : Gate
        Whether remarks are failures.
    """
    return tuple(replace(one, level="fail") if gate.remarks == "fail" else one for one in reasons)


def data_reasons(facts: DataFacts, diagnosed: DiagnosisFacts | None, label: str) -> Iterator[Reason]:
    """Reasons that the measured data and the diagnosis give.

    Parameters
    ----------
    facts : DataFacts
        Model beside the data.
    diagnosed : DiagnosisFacts or None
        Result of the diagnosis; None if nobody asked for one.
    label : str
        Label and name of the project.
    """
    if facts.stopped:
        code = GateCode.NOT_CONVERGED
        yield Reason("fail", code.code, "calibrate", "parameters", f"{facts.stopped} {code.meaning}", code.remedy)
    yield from _misfits(facts.misfits, diagnosed is not None)
    yield from _records(facts, diagnosed is not None, "simulated" in label.lower())
    if diagnosed is not None:
        yield from _diagnosis(diagnosed, any(one.beyond for one in facts.misfits))


def claim_reasons(certification: Certification, doubted: Sequence[Doubted], facts: DataFacts) -> Iterator[Reason]:
    """Reasons that a certification gives beside its claims.

    Parameters
    ----------
    certification : Certification
        Claims with their checks.
    doubted : sequence of tuple
        As in `JobResult`.
    facts : DataFacts
        What the records hold.
    """
    yield from _parameters(doubted)
    yield from certification_reasons(certification, facts.currents(certification.system))
    yield from _outside(certification, facts)
    yield from _beyond_claims(certification, facts)


def _misfits(misfits: Sequence[Misfit], diagnosed: bool) -> Iterator[Reason]:
    codes = {"validation": GateCode.VALIDATION_MISFIT, "train": GateCode.TRAINING_MISFIT}
    for one in misfits:
        if one.significant:
            code = codes[one.kind]
            remedy = code.remedy.replace(_LOOK, "See what the diagnosis says of it;") if diagnosed else code.remedy
            yield Reason("fail" if one.beyond else "remark", code.code, "calibrate", f"{one.record}: {one.sensor}",
                         f"In the {'validation' if one.kind == 'validation' else 'training'} record {one.record} "
                         f"{one.sensor} is {one.rms:.3g} {one.unit} rms off the model at {one.noise:.2g} {one.unit} of "
                         f"noise: {one.excess:.3g} {one.unit} more, tolerance {one.tolerance:.3g} {one.unit}.",
                         remedy if one.beyond else "", one.excess, one.tolerance)


def _records(facts: DataFacts, diagnosed: bool, simulated: bool) -> Iterator[Reason]:
    if facts.kinds and "validation" not in facts.kinds:
        yield remark(GateCode.NO_VALIDATION, "calibrate", "records", GateCode.NO_VALIDATION.meaning)
    if facts.kinds and not diagnosed:
        yield remark(GateCode.NOT_DIAGNOSED, "diagnose", "records", GateCode.NOT_DIAGNOSED.meaning)
    if facts.kinds and simulated:
        yield remark(GateCode.SIMULATED_DATA, "calibrate", "records", GateCode.SIMULATED_DATA.meaning)
    for name in facts.constant:
        yield remark(GateCode.CONSTANT_INPUT, "calibrate", name, f"{name} never changes in the records that were "
                     "fitted: nothing can be learnt about what it does.")
    for said in facts.unrecorded:
        yield remark(GateCode.AMBIENT_NOT_RECORDED, "calibrate", said.partition(",")[0], "A record does not hold the "
                     f"temperature of {said} all the time.")
    for file in facts.resampled:
        yield remark(GateCode.RESAMPLED, "calibrate", file, f"The samples of {file} were not on a uniform grid.")
    if facts.silent:
        names = ", ".join(facts.silent)
        yield remark(GateCode.NO_NOISE_STATED, "calibrate", names, f"The noise of {names} is not stated; it was "
                     "estimated from the readings.")


def _diagnosis(found: DiagnosisFacts, off: bool) -> Iterator[Reason]:
    codes = {"unexplained": GateCode.DIAGNOSIS_UNEXPLAINED, "ambiguous": GateCode.DIAGNOSIS_AMBIGUOUS,
             "named": GateCode.DIAGNOSIS_NAMED, "named_with_remainder": GateCode.DIAGNOSIS_NAMED}
    if found.verdict not in codes:
        return
    code = codes[found.verdict]
    if found.adopted:
        yield Reason("remark", code.code, "diagnose", found.names, "The diagnosis names an effect that the system file "
                     f"does not have; the certified model has it: {found.names}.", "Put it into the system file.")
        return
    beside = " augmented.toml has it; `adopt` takes over only what leaves no remainder." * (
        found.verdict == "named_with_remainder")
    yield Reason("fail" if off else "remark", code.code, "diagnose", found.names or "model",
                 code.meaning[:-1] + (f": {found.names}." if found.names else "."), code.remedy + beside)


def _parameters(doubted: Sequence[Doubted]) -> Iterator[Reason]:
    codes = {"undetermined": GateCode.UNDETERMINED_PARAMETER, "bound": GateCode.PARAMETER_AT_BOUND}
    for what, name, holds in doubted:
        code = codes[what]
        words = {"undetermined": f"The records do not determine {name}",
                 "bound": f"{name} ended at a bound of [fit]"}[what]
        then = (f"the required claims {'hold' if holds else 'do not hold'} on its whole [fit] range, with the other "
                "parameters as they stand")
        yield Reason("remark" if holds else "fail", code.code, "calibrate", name, f"{words}; {then}.", code.remedy)


def _outside(certification: Certification, facts: DataFacts) -> Iterator[Reason]:
    """Boxes of the claims that reach far beyond the records."""
    if facts.readings is None:
        return
    low, high = facts.readings
    boxes = [one.certificate.region.get("temperature") for one in certification.checked if one.required]
    ends = np.array([pair for box in boxes if box is not None
                     for pair in (box.values() if isinstance(box, Mapping) else [box])], float)
    if ends.size:
        reach = max(low - float(ends.min()), float(ends.max()) - high)
        if reach > _FAR:
            yield remark(GateCode.OUTSIDE_DATA, "certify", "temperature",
                         f"The claims reach from {ends.min() - ZERO_CELSIUS:.0f} to {ends.max() - ZERO_CELSIUS:.0f} "
                         f"°C; the records hold {low - ZERO_CELSIUS:.0f} to {high - ZERO_CELSIUS:.0f} °C.",
                         reach, _FAR)
    measured = facts.currents(certification.system)
    for name, (least, most) in certification.current.items():
        low, high = measured[name]
        share = _SHARE * max(abs(low), abs(high))
        if most > max(high, 0.0) + share or least < min(low, 0.0) - share:
            yield remark(GateCode.OUTSIDE_DATA, "certify", name, f"The claims are about {least:g} to {most:g} A of "
                         f"{name}; the records hold {low:.3g} to {high:.3g} A.")


def _beyond_claims(certification: Certification, facts: DataFacts) -> Iterator[Reason]:
    """Ambients and heaters that were outside of what the claims allow for while the records were taken."""
    system, boxes, measured = certification.system, certification.boxes, facts.inputs or {}
    for name, one in system.ambients.items():
        least, most = (boxes.ambient or {}).get(name, (one.temperature, one.temperature))
        low, high = measured.get(name, (least, most))
        if max(least - low, high - most) > _WARMER:
            claimed = (f"exactly {most - ZERO_CELSIUS:.4g} °C" if least == most else
                       f"{least - ZERO_CELSIUS:.4g} to {most - ZERO_CELSIUS:.4g} °C")
            yield remark(GateCode.RECORDS_BEYOND_CLAIM, "certify", name, f"The claims are about {name} at {claimed}; "
                         f"the records hold {low - ZERO_CELSIUS:.4g} to {high - ZERO_CELSIUS:.4g} °C.")
    for name, heater in system.inputs.items():
        least, most = (boxes.heat or {}).get(heater.lump, (-np.inf, np.inf))
        heats = [heater.gain * end for end in measured.get(name, (0.0, 0.0))]
        slack = _MORE * max(abs(least), abs(most))
        if max(heats) > most + slack or min(heats) < min(least, 0.0) - slack:
            yield remark(GateCode.RECORDS_BEYOND_CLAIM, "certify", name, f"The claims are about {least:g} to {most:g} "
                         f"W into {heater.lump}; in the records {name} gives {min(heats):.4g} to {max(heats):.4g} W.")
