"""Write docs/explanations/outcomes.md from the enums of the packages, and the file that `robthermal explain` reads.

    python docs/table_of_outcomes.py
"""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

from robthermal.errors import OutcomeCode
from robthermal.jobs.explanations import KNOWN, collected, outcome_codes, package_of

PAGE = Path(__file__).resolve().parent / "explanations" / "outcomes.md"
ANSWER = {True: "yes", False: "no", None: "depends"}
HEAD = """# Codes of outcomes

A result has an `outcome`: whether it is what was asked for (`.ok`), a code for scripts (`.code`), and what happened
with what to do about it (`.text`, with the numbers of this result). Each package has one closed enum of codes, for
example `rt.certify.CertifyCode`; `robthermal explain CODE` says the same as this page, which
`docs/table_of_outcomes.py` writes. The second column says whether the result is what was asked for.
The text of a result may say more precisely what to do than the last column.
"""


def page() -> str:
    """The page as it has to be."""
    packages: dict[str, list[OutcomeCode]] = {}
    for code in (code for codes in outcome_codes().values() for code in codes):
        packages.setdefault(package_of(code), []).append(code)
    lines = [HEAD]
    for name in sorted(packages):
        lines += [f"## `{name}`", "", "| code | asked for | meaning | what to do |", "|---|---|---|---|"]
        lines += [f"| `{code.code}` | {ANSWER[code.ok]} | {code.meaning} | {code.remedy} |" for code in packages[name]]
        lines.append("")
    return "\n".join(lines)


def known() -> str:
    """The file of explanations as it has to be, one to a line."""
    return "[\n" + ",\n".join(json.dumps(asdict(one), ensure_ascii=False) for one in collected()) + "\n]\n"


if __name__ == "__main__":
    KNOWN.write_text(known(), encoding="utf-8")
    PAGE.write_text(page(), encoding="utf-8")
