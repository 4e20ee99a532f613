"""One data set through the workflow: it gets the system and the records; what it says is set beside the truth after."""

from __future__ import annotations

import hashlib
import json
import time
import warnings
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from joblib import Parallel, delayed

import robthermal as rt

from .cases import Case, Given, Truth, made
from .peers import peers

Row = dict[str, Any]
_SOURCES = ("diagnosis", "calibration", "fitting", "thermal")
_GENERATOR = ("cases.py", "hidden.py", "integrate.py", "outside.py", "plants.py", "sizes.py")


def version() -> str:
    """Digest of the code that decides and of the code that makes the data: rows of another one do not count."""
    home = Path(rt.__file__).parent
    files = sorted(file for room in _SOURCES for file in (home / room).rglob("*.py"))
    files += [Path(__file__).parent / name for name in _GENERATOR]
    return hashlib.sha1(b"".join(file.read_bytes() for file in files)).hexdigest()[:10]


def judged(case: Case, version: str, compare: bool, most: int | None = None) -> Row:
    """Make the data, diagnose, follow an ambiguous answer up with the recommended experiment, compare with peers.

    With `most`, only so many candidates are tried, those of the true effects among them, and nothing is followed up.
    """
    row: Row = {"key": case.key, "version": version, "topology": case.topology, "group": case.group,
                "effect": case.effect, "seed": case.seed}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        given, truth = made(case)
        row["truth"] = [[name, list(where), values] for name, where, values in truth.effects]
        short = {} if most is None else {"effects": short_catalog(given.system, truth, most, case.seed)}
        start = time.process_time()
        try:
            found = rt.diagnose(given.system, given.train, validation=given.validation, **short)
        except Exception as error:  # a crash is a result of the suite, with its message
            return row | {"verdict": "crashed", "error": f"{type(error).__name__}: {error}",
                          "seconds": time.process_time() - start}
        row |= {"seconds": time.process_time() - start, **_said(found, truth)}
        if most is not None:
            return row
        if case.group == "hidden" and found.verdict == "ambiguous" and found.next_experiment is not None:
            row["follow"] = _followed(given, truth, found)
        if compare and case.group in ("hidden", "nothing"):
            row["peers"] = peers(found, truth.effects)
    return row


def short_catalog(system: rt.System, truth: Truth, most: int, seed: int) -> list[str]:
    """Names of the true effects and, in random order, of others, as many as fit."""
    names = list(dict.fromkeys(name for name, _, _ in truth.effects if name in rt.diagnosis.effects()))
    others = [name for name in rt.diagnosis.effects() if name not in names]
    for name in np.random.default_rng(seed).permutation(others):
        if len(rt.diagnosis.candidates(system, [*names, str(name)])) <= most:
            names.append(str(name))
    return names


def _said(found: rt.diagnosis.Diagnosis, truth: Truth) -> Row:
    out: Row = {"verdict": found.verdict, "text": found.outcome.text,
                "names": [[f.effect, list(f.where)] for f in found.effects],
                "others": [[[name, list(where)] for name, where in other] for other in found.alternatives],
                "provisional": [[f.effect, list(f.where)] for f in found.provisional],
                "delta_bic": [f.delta_bic for f in (*found.effects, *found.provisional)],
                "sizes": [list(next(iter(f.values.values()))[:2]) for f in found.effects],
                "gap": {name: [gap.before, gap.after, gap.noise] for name, gap in found.gap.items()},
                "limits": [_limit(found, name, where) for name, where, _ in truth.effects],
                "candidates": len(found.scores.candidates), "trials": found.scores.n_trials}
    if found.hold_out is not None:
        out["validation"] = [found.hold_out.variance_before, found.hold_out.variance_after]
    return out


def _limit(found: rt.diagnosis.Diagnosis, name: str, where: tuple[str, ...]) -> float | None:
    """Declared detection limit of the true effect: the scores of the nominal fit."""
    scores = found.scores
    for i, candidate in enumerate(scores.candidates):
        if candidate.effect.name == name and set(candidate.where) == set(where):
            return float(scores.limit[i]) if np.isfinite(scores.limit[i]) else None
    return None


def _followed(given: Given, truth: Truth, found: rt.diagnosis.Diagnosis) -> Row:
    """The recommended inputs on the true plant, and the parameter to measure if any; then both records together."""
    assert found.next_experiment is not None
    plan, system = found.next_experiment, given.system
    record, asked = truth.experiment(plan.record), plan.measurement
    if asked is not None:
        value = truth.measured(asked)
        known = {"sigma": asked.accuracy * value}
        fit = {**system.fit, asked.parameter: system.fit[asked.parameter].model_copy(update=known)}
        system = system.with_parameters({asked.parameter: value}).model_copy(update={"fit": fit})
    start = time.process_time()
    try:
        again = rt.diagnose(system, [given.train, record], validation=given.validation)
    except Exception as error:
        return {"verdict": "crashed", "error": f"{type(error).__name__}: {error}"}
    return {"seconds": time.process_time() - start, "expected": plan.expected, "present": plan.present,
            "sample_time": record.sample_time,
            "measured": asked and asked.parameter, **_said(again, truth)}


def run(cases: Iterable[Case], out: Path, jobs: int, every: int, most: int | None = None) -> list[Row]:
    """Rows of all cases: those in the file already, and the others, appended as they come; peers on every nth seed."""
    now, wanted = version() + (f" of {most}" if most else ""), {case.key: case for case in cases}
    rows = {row["key"]: row for row in rows_in(out) if row["version"] == now and row["key"] in wanted}
    left = [case for key, case in wanted.items() if key not in rows]
    print(f"{len(wanted)} data sets, {len(rows)} of them done before, version {now}", flush=True)
    start = time.time()
    results = Parallel(n_jobs=jobs, return_as="generator_unordered", batch_size=1)(
        delayed(judged)(case, now, case.seed % every == 0, most) for case in left)
    with out.open("a", encoding="utf-8") as file:
        for number, row in enumerate(results, start=1):
            rows[row["key"]] = row
            file.write(json.dumps(row) + "\n")
            file.flush()
            if number % 20 == 0 or number == len(left):
                print(f"{number} of {len(left)}, {(time.time() - start) / 60:.1f} min", flush=True)
    return list(rows.values())


def rows_in(out: Path) -> list[Row]:
    """Rows of a results file; a line cut off by an interruption is left out."""
    rows = []
    for line in out.read_text(encoding="utf-8").splitlines() if out.exists() else ():
        try:
            rows.append(json.loads(line))
        except json.JSONDecodeError:
            continue
    return rows
