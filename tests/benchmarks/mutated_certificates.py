"""Ten thousand mutated certificates: how many are rejected, and that none is accepted which a sample shows false.

Run: python tests/benchmarks/mutated_certificates.py [count]
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np
from _timing import header

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "verification"))
import certificate_truth as truth  # noqa: E402 - beside the tests, not on the path before

from robthermal.errors import InputError  # noqa: E402
from robthermal.verification import establish  # noqa: E402

METHODS = ("sum", "max", "energy", "lyapunov")


def valid_document(rng: np.random.Generator, method: str) -> dict:
    """Return a certificate that holds with little to spare, so that many mutations break it."""
    while True:
        bent, wild = bool(rng.random() < 0.3), bool(rng.random() < 0.3)
        system = truth.random_system(rng, modules=int(rng.integers(1, 3)), bent=bent, wild=wild)
        region = truth.box(system, float(rng.uniform(0.2, 2.0)))
        evidence = truth.evidence_for(method, system, region, 1e-4, rng)
        good = establish("contraction", system=system, region=region, evidence=evidence, made_by={})
        if good.holds:
            rate = 1e-4 + 0.99 * good.margin["rate"]
            return {"system": system, "region": region, "evidence": {**good.evidence, "rate": rate}}


def judge(document: dict, rng: np.random.Generator) -> str:
    """Return what the checker says and what the samples say."""
    try:
        made = establish("contraction", system=document["system"], region=document["region"],
                         evidence=document["evidence"], made_by={}, margin={})
    except InputError:
        return "refused as malformed"
    value = truth.violation(document, rng, 40)
    if made.holds:
        return "ACCEPTED THOUGH FALSE" if value > 1e-9 else "accepted, no sample violates it"
    return "rejected, a sample violates it" if value > 0 else "rejected, no sample violates it"


def main(count: int) -> int:
    """Run and print the table; the exit status says whether a false certificate was accepted."""
    header(f"{count} mutated certificates")
    rng, start = np.random.default_rng(0), time.perf_counter()
    table: Counter[str] = Counter()
    for k in range(count):
        if k % 25 == 0:
            document = valid_document(rng, METHODS[k // 25 % 4])
        table[judge(truth.mutate(document, rng), rng)] += 1
    for what, number in sorted(table.items()):
        print(f"{number:>7}  {what}")
    print(f"{time.perf_counter() - start:.0f} s")
    return 1 if table["ACCEPTED THOUGH FALSE"] else 0


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 10_000))
