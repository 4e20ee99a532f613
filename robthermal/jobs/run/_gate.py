"""The gates of a job: everything beside the claims that decides its verdict, as reasons with a code."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..._celsius import ZERO_CELSIUS
from ...report import Reason
from ...signals import Record
from ..certify import certification_reasons, remark
from ..claims import GateCode
from ..request import Gate
from ._misfit import Misfit
from ._result import JobResult

_FAR, _SHARE = 10.0, 0.2  # K, and part of a current, that a claim may reach beyond the records
_OF_CLAIMS = (GateCode.NOT_CERTIFIED, GateCode.NOT_VERIFIED, GateCode.NOT_ROBUST)  # the cases of the claims say these
GATES = tuple(code.code for code in GateCode if code not in (*_OF_CLAIMS, GateCode.REPORT_CHANGED))


def gate_reasons(result: JobResult) -> tuple[Reason, ...]:
    """Reasons of the verdict of a job, beside those of its claims.

    Parameters
    ----------
    result : JobResult
        Result of the main job, as `run_job` returns it.
    """
    found = [*_misfits(result.misfits), *_records(result), *_diagnosis(result), *_parameters(result),
             *certification_reasons(result.certification, measured_currents(result)), *_outside(result)]
    return applied(found, result.project.gate)


def applied(reasons: Sequence[Reason], gate: Gate) -> tuple[Reason, ...]:
    """Reasons as the gate counts them."""
    return tuple(replace(one, level="fail") if gate.remarks == "fail" else one for one in reasons)


def measured_currents(result: JobResult) -> dict[str, tuple[float, float]]:
    """Range of every module's current in the records [A]."""
    return {name: _range([c.record for c in result.comparisons], name) for name in result.system.modules
            if result.comparisons}


def _misfits(misfits: Sequence[Misfit]) -> Iterator[Reason]:
    codes = {"validation": GateCode.VALIDATION_MISFIT, "train": GateCode.TRAINING_MISFIT}
    for one in misfits:
        if one.significant:
            code = codes[one.kind]
            yield Reason("fail" if one.beyond else "remark", code.code, "calibrate", f"{one.record}: {one.sensor}",
                         f"In the {'validation' if one.kind == 'validation' else 'training'} record {one.record} "
                         f"{one.sensor} is {one.rms:.3g} K rms off the model at {one.noise:.2g} K of noise: "
                         f"{one.excess:.3g} K more, tolerance {one.tolerance:.3g} K.",
                         code.remedy if one.beyond else "", one.excess, one.tolerance)


def _records(result: JobResult) -> Iterator[Reason]:
    kinds = {one.kind for one in result.comparisons}
    records = [one.record for one in result.comparisons]
    if records and "validation" not in kinds:
        yield remark(GateCode.NO_VALIDATION, "calibrate", "records", GateCode.NO_VALIDATION.meaning)
    if records and result.diagnosis is None:
        yield remark(GateCode.NOT_DIAGNOSED, "diagnose", "records", GateCode.NOT_DIAGNOSED.meaning)
    if records and "simulated" in f"{result.project.label} {result.project.name}".lower():
        yield remark(GateCode.SIMULATED_DATA, "calibrate", "records", GateCode.SIMULATED_DATA.meaning)
    names = dict.fromkeys(name for record in records for name in record.input_names)
    for name in names if records else ():
        low, high = _range(records, name)
        if low == high:
            yield remark(GateCode.CONSTANT_INPUT, "calibrate", name, f"{name} never changes in the records: nothing "
                          "can be learnt about what it does.")
    silent = [name for name in dict.fromkeys(name for record in records for name in record.output_names)
              if name in result.system.sensors and not result.system.sensors[name].noise]
    if silent:
        yield remark(GateCode.NO_NOISE_STATED, "calibrate", ", ".join(silent), f"The noise of {', '.join(silent)} is "
                      "not stated; it was estimated from the readings.")


def _diagnosis(result: JobResult) -> Iterator[Reason]:
    if result.diagnosis is None:
        return
    found = result.diagnosis.diagnosis
    codes = {"unexplained": GateCode.DIAGNOSIS_UNEXPLAINED, "ambiguous": GateCode.DIAGNOSIS_AMBIGUOUS,
             "named": GateCode.DIAGNOSIS_NAMED}
    if found.verdict in codes:
        code = codes[found.verdict]
        names = ", ".join(" or ".join([effect.label, *(f"{name}({', '.join(where)})" for name, where in others
                                                       if (name, where) != (effect.effect, effect.where))])
                          for effect, others in zip(found.effects, found.alternatives, strict=True))
        off = any(one.beyond for one in result.misfits)
        yield Reason("fail" if off else "remark", code.code, "diagnose", names or "model",
                     code.meaning[:-1] + (f": {names}." if names else "."), code.remedy)


def _parameters(result: JobResult) -> Iterator[Reason]:
    codes = {"undetermined": GateCode.UNDETERMINED_PARAMETER, "bound": GateCode.PARAMETER_AT_BOUND}
    for what, name, holds in result.doubted:
        code = codes[what]
        words = {"undetermined": f"The records do not determine {name}",
                 "bound": f"{name} ended at a bound of [fit]"}[what]
        then = "the required claims hold on its whole [fit] range" if holds else (
            "the required claims do not hold on its whole [fit] range")
        yield Reason("remark" if holds else "fail", code.code, "calibrate", name, f"{words}; {then}.", code.remedy)


def _outside(result: JobResult) -> Iterator[Reason]:
    """Boxes of the claims that reach far beyond the records."""
    records = [one.record for one in result.comparisons]
    if not records:
        return
    readings = [values for record in records for values in (
        *(record[name] for name in record.output_names),
        *(record[name] for name in record.input_names if name in result.system.ambients))]
    low, high = (float(end([end(values) for values in readings])) for end in (np.nanmin, np.nanmax))
    boxes = [one.certificate.region.get("temperature") for one in result.certification.checked if one.required]
    ends = np.array([pair for box in boxes if box is not None
                     for pair in (box.values() if isinstance(box, Mapping) else [box])], float)
    if ends.size:
        reach = max(low - float(ends.min()), float(ends.max()) - high)
        if reach > _FAR:
            yield remark(GateCode.OUTSIDE_DATA, "certify", "temperature",
                         f"The claims reach from {ends.min() - ZERO_CELSIUS:.0f} to {ends.max() - ZERO_CELSIUS:.0f} "
                         f"°C; the records hold {low - ZERO_CELSIUS:.0f} to {high - ZERO_CELSIUS:.0f} °C.",
                         reach, _FAR)
    measured = measured_currents(result)
    for name, (least, most) in result.certification.current.items():
        largest = max(abs(end) for end in measured[name])
        if most > max(measured[name][1], 0.0) + _SHARE * largest or least < (
                min(measured[name][0], 0.0) - _SHARE * largest):
            yield remark(GateCode.OUTSIDE_DATA, "certify", name, f"The claims are about {least:g} to {most:g} A of "
                          f"{name}; the records hold {measured[name][0]:.3g} to {measured[name][1]:.3g} A.")


def _range(records: Sequence[Record], name: str) -> tuple[float, float]:
    values = [record[name] for record in records if name in (*record.input_names, *record.output_names)]
    ends = [(float(np.nanmin(v)), float(np.nanmax(v))) for v in values if np.isfinite(v).any()]
    return (min(a for a, _ in ends), max(b for _, b in ends)) if ends else (0.0, 0.0)
