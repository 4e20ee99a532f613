"""Run tests, and let the second checker judge every certificate that the first one judges on the way.

Run: python tests/benchmarks/two_checkers_on_suite.py [test files or folders; default tests/verification tests/certify]
"""

from __future__ import annotations

import json
import sys
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from _timing import header

_ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(_ROOT / "recheck"))
import recheck  # noqa: E402 - beside the package, perhaps not installed
from robthermal.verification import Certificate  # noqa: E402
from robthermal.verification._kinds import KINDS  # noqa: E402

_SECTIONS = ("system", "region", "evidence", "margin", "made_by")
_LARGEST = 200_000  # characters of what is compared
table: Counter[tuple[str, str]] = Counter()
wrong: list[str] = []
slowest = (0.0, "")


def main(arguments: list[str]) -> int:
    """Run the tests with both checkers; the exit status says whether they disagree."""
    header("both checkers on every certificate of the tests")
    current: list[Certificate] = []
    check_form = Certificate.check_form

    def remembered(certificate: Certificate) -> Any:
        problem = check_form(certificate)
        current[:] = [certificate]
        return problem

    Certificate.check_form = remembered  # type: ignore[method-assign]
    for name, kind in list(KINDS.items()):
        KINDS[name] = replace(kind, prove=_both(kind.prove, current))
    chosen = arguments or [str(_ROOT / "tests" / "verification"), str(_ROOT / "tests" / "certify")]
    pytest.main(["-q", "-x", "-p", "no:cacheprovider", "--rootdir", str(_ROOT), *chosen])
    for (kind, what), count in sorted(table.items()):
        print(f"{kind:>12}  {what:<40} {count:>7}")
    print(f"slowest {slowest[0]:.1f} s ({slowest[1]}); {len(wrong)} disagreements", *wrong, sep="\n")
    return 1 if wrong else 0


def _both(prove: Callable[[Any], Any], current: list[Certificate]) -> Callable[[Any], Any]:
    def judged(problem: Any) -> Any:
        proof = prove(problem)
        if current:
            _compare(current.pop(), proof.valid, proof.reason)
        return proof
    return judged


def _compare(certificate: Certificate, first: bool, reason: str) -> None:
    global slowest
    content = {"format": certificate.format, "kind": certificate.kind, "claim": certificate.claim,
               **{key: getattr(certificate, key) for key in _SECTIONS}}
    text = json.dumps(content, default=_plain)
    if len(text) > _LARGEST:
        table[certificate.kind, "too long to compare here"] += 1
        return
    start = time.perf_counter()
    found = recheck.check(json.loads(text))
    slowest = max(slowest, (time.perf_counter() - start, certificate.kind))
    table[certificate.kind, f"{'valid' if first else 'not valid'}, second {found.status}"] += 1
    if found.status == ("not valid" if first else "valid"):
        wrong.append(f"{certificate.kind}: {first} ({reason}), {found}\n{text[:3000]}")


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, (np.ndarray, np.generic)) else dict(value)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
