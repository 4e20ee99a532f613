"""Accessibility of a page, asked of axe-core in a browser."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from browser import CHROMIUM, Page

AXE = Path(__file__).resolve().parents[1] / "build" / "axe" / "package" / "axe.min.js"  # .ci/run fetches it
needs_chromium = pytest.mark.skipif(CHROMIUM is None,
                                    reason="no Chromium on this machine (Debian: apt install chromium)")
needs_axe = pytest.mark.skipif(CHROMIUM is None or not AXE.is_file(),
                               reason="no Chromium, or no axe-core in build/axe (.ci/run fetches it with npm)")
_RULES = ("axe.run(document, {resultTypes: ['violations']})"
          ".then(found => JSON.stringify(found.violations.map(one => [one.id, one.nodes[0].html])))")


def violations(page: Page) -> list[list[str]]:
    """Rules that the page breaks, each with the first element that does."""
    page.evaluate(f"{AXE.read_text(encoding='utf-8')};0")
    found: list[list[str]] = json.loads(page.evaluate(_RULES))
    return found
