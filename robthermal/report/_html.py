"""Reports for people: one self-contained page."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cache
from itertools import chain, count
from pathlib import Path
from typing import TYPE_CHECKING

from .._first_use import OnFirstUse
from ._appendix import margins, numbered_assumptions, resting
from ._content import Claim, Report, Section
from ._figure import Figure, inline
from ._save import printable, save_text
from ._table import printed
from ._usable import LIMITED_BY, Bound, rounded_down, shown

if TYPE_CHECKING:
    import jinja2
else:  # a certificate is checked without it
    jinja2 = OnFirstUse("jinja2")


def write_html(report: Report, path: str | Path) -> Path:
    """Write one HTML file that needs nothing else: no network, no script, no neighboring file.

    Parameters
    ----------
    report : Report
        What to show. All its text is escaped.
    path : str or Path
        File to write.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        The file cannot be written.

    Examples
    --------
    >>> import tempfile, robthermal as rt
    >>> claim = rt.report.Claim("Contraction", "Trajectories meet.", True, True, "m1: 0 to 1 A", "0.01 1/s", "energy")
    >>> report = rt.report.Report("Set-up <1>", "", "", (claim,), (), {}, (), "today")
    >>> path = rt.report.write_html(report, tempfile.mkdtemp() + "/report.html")
    >>> "Set-up &lt;1&gt;" in path.read_text(encoding="utf-8")
    True
    """
    counter = count(1)

    def drawing(figure: Figure) -> str:  # not escaped: Figure has refused scripts and outside resources
        return inline(figure, f"f{next(counter)}-")

    files = {claim.file for claim in report.claims}
    parts = _anchored([*report.first, *report.sections])
    first, sections = parts[:len(report.first)], parts[len(report.first):]
    bounds = next((i for i, (_, section) in enumerate(sections) if section.chapter == BOUNDS), 0)
    page = _template("report.html").render(
        report=report, sections=sections, first=first, chapters=_chapters(sections), bounds=bounds,
        drawing=drawing, printed=printed, ranges=_ranges, margins=margins,
        assumptions=numbered_assumptions(report), resting=resting(report), usable=shown(report.usable),
        amps=_amps, least=lambda row: "–" if row.current is None else rounded_down(row.current),
        cards=_cards(report.claims),
        paired=any(claim.parameters == "ranges" for claim in report.claims),
        kind=report.kind or ("Diagnosis report" if report.answer else "Stability certification report"),
        proven=_proven(report.claims),
        about=": about the model, which the data contradict" if report.contradicted else "",
        machine={one.file: one.machine for one in report.evidence},
        twice={one.file for one in report.evidence if one.good and one.second == "valid"},
        claimed=[one for one in report.evidence if one.file in files], identity_names=_IDENTITY, limits=LIMITED_BY,
        style=_template("report.css").render(running_head=css_text(report.label, 90),
                                             running_foot=css_text(_running_foot(report), 110)))
    return save_text(printable(page), path)


def _proven(claims: Sequence[Claim]) -> str:
    """Beside the badge of a report that holds: how much of it is proven; a test on data proves nothing."""
    tests = sum(claim.tested for claim in claims)
    proofs = len(claims) - tests
    if not proofs:
        return "What is claimed below was tested on data; nothing here is proven."
    confirmed = "an independent check confirmed " + ("it" if proofs == 1 else "each")
    if not tests:
        return f"{'The claim below is' if proofs == 1 else f'All {proofs} claims below are'} proven, and {confirmed}."
    return (f"{proofs} of the {len(claims)} claims below {'is' if proofs == 1 else 'are'} proven, and {confirmed}; "
            f"{tests} {'is a test' if tests == 1 else 'are tests'} on data, which prove nothing.")


_IDENTITY = ("serial number", "revision", "operator", "date")  # on the page to sign; the others are filled by hand


def _running_foot(report: Report) -> str:
    """What stands below every printed page: the machine, and which one."""
    stated = (report.identity.get(name, "") for name in ("serial number", "revision"))
    return ", ".join(filter(None, (report.title, *stated)))


def css_text(text: str, most: int) -> str:
    """Text as the inside of a CSS string; what is neither letter, digit nor plain punctuation is written as its number.

    Parameters
    ----------
    text : str
        Text of any kind, cut to `most` characters.
    most : int
        Characters of it that are kept.
    """
    short = text if len(text) <= most else f"{text[:most - 1]}…"
    return re.sub(r"[^A-Za-z0-9 .,:;()_-]", lambda found: f"\\{ord(found.group()):06x}", printable(short))


BOUNDS = "Certify"  # chapter in which the four bounds of the current stand


def _chapters(sections: Sequence[tuple[str, Section]]) -> dict[int, tuple[str, str]]:
    """Address and heading of the chapters, by the section they begin with."""
    found, last = {}, ""
    for i, (_, section) in enumerate(sections):
        if section.chapter and section.chapter != last:
            found[i] = (f"stage-{section.chapter.lower()}", section.chapter)
        last = section.chapter
    return found


_MOST_CARDS = 8  # a page of sixty cards is read by nobody


def _cards(claims: Sequence[Claim]) -> list[Claim]:
    """Claims that get a card: all of a few; of many the first, and every one that does not hold."""
    if len(claims) <= _MOST_CARDS:
        return list(claims)
    first = {id(claim) for claim in claims[:_MOST_CARDS // 2]}
    return [claim for claim in claims if id(claim) in first or not claim.good]


_OWN = ("top", "numbers", "usable", "usable-title", "claims", "claims-title", "bounds",
        "contents", "contents-title", "appendix", "assumptions", "resting", "exact",
        "provenance", "check", "sign")


@cache
def _template(name: str) -> jinja2.Template:
    environment = jinja2.Environment(loader=jinja2.PackageLoader(__package__, "template"), autoescape=True,
                                     undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True,
                                     keep_trailing_newline=True)
    environment.filters["units"] = _together
    environment.filters["answer_and_rest"] = _answer_and_rest
    return environment.get_template(name)


def _amps(bound: Bound | None) -> str:
    return "–" if bound is None or bound.current is None else rounded_down(bound.current)


def _ranges(claim: Claim) -> list[str]:
    return [part.strip() for part in claim.box.split(";") if part.strip()]


def _answer_and_rest(headline: str) -> tuple[str, str]:
    """The first two sentences, what is missing and what the error becomes with it, and what is held against them."""
    sentences = re.split(r"(?<=\.) (?=[A-Z])", headline)
    return " ".join(sentences[:2]), " ".join(sentences[2:])


def _together(text: str) -> str:
    """A number and its unit stay on one line."""
    return re.sub(r"(?<=\d) (?=(?:°C|mK|K|mA|A|mW|W|V|s|min|h|1/s|W/K|J/K|%)(?![\w/]))", "\u00a0", text)


def _anchored(sections: Sequence[Section]) -> list[tuple[str, Section]]:
    """Sections with addresses that are valid, and unique in the page."""
    taken = set(_OWN)
    pairs = []
    for section in sections:
        plain = re.sub(r"[^a-z0-9]+", "-", (section.anchor or section.title).lower()).strip("-")
        # No address of ours may begin like the ids of a drawing, f1-…, or of an assumption, assumption-1
        base = plain if plain and not re.match(r"(f|assumption-)\d|stage-", plain) else f"section-{plain}".strip("-")
        names = chain([base], (f"{base}-{i}" for i in count(2)))
        anchor = next(name for name in names if name not in taken)
        taken.add(anchor)
        pairs.append((anchor, section))
    return pairs
