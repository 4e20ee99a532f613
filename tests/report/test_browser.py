"""The page in headless Chromium: no console message, no sideways scrolling at phone width, prints on A4."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from robthermal.report import Report, write_html

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine (Debian: apt install chromium)")

# A frame of a phone's width; its script, outside the report, measures the report in it.
PROBE = """<!DOCTYPE html><meta charset="utf-8"><iframe id="frame" src="report.html" width="390" height="800"></iframe>
<p id="result">waiting</p><script>
document.getElementById("frame").onload = event => {
  const page = event.target.contentDocument, root = page.documentElement;
  const beyond = [...page.querySelectorAll(".scroll")].map(box => box.scrollWidth - box.clientWidth);
  const letters = [...page.querySelectorAll("figure svg")].map(svg =>
    8.5 * svg.getBoundingClientRect().width / svg.viewBox.baseVal.width);  // smallest, 8.5 units of the drawing
  document.getElementById("result").textContent =
    `width ${root.scrollWidth} of ${root.clientWidth}; boxes ${beyond.length}, beyond ${Math.max(...beyond)}; ` +
    `letters ${letters.length}, ${Math.round(10 * Math.min(...letters))}; ` +
    `badge ${Math.round(page.querySelector(".badge").getBoundingClientRect().bottom)}`;
};</script>"""


@pytest.fixture(scope="module")
def folder(report: Report, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("browser")
    write_html(report, folder / "report.html")
    (folder / "phone.html").write_text(PROBE, encoding="utf-8")
    return folder


def chromium(folder: Path, page: str, *options: str) -> subprocess.CompletedProcess[str]:
    assert CHROMIUM is not None
    # No sandbox: test machines are often containers, and the page is our own. No network: the page must not want any.
    fixed = ("--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--enable-logging=stderr",
             "--v=0", "--proxy-server=127.0.0.1:9", f"--user-data-dir={folder / 'profile'}")
    return subprocess.run([CHROMIUM, *fixed, *options, (folder / page).as_uri()], capture_output=True, text=True,
                          timeout=60, check=True)


def console(run: subprocess.CompletedProcess[str]) -> list[str]:
    return [line for line in run.stderr.splitlines() if ":CONSOLE" in line or "Refused to" in line]


@pytest.mark.parametrize("scheme", ["0", "1"], ids=["dark", "light"])
def test_page_renders_without_a_console_message(folder: Path, scheme: str) -> None:
    picture = folder / f"screen{scheme}.png"
    run = chromium(folder, "report.html", f"--blink-settings=preferredColorScheme={scheme}", f"--screenshot={picture}",
                   "--window-size=1280,900")
    assert console(run) == []
    assert picture.stat().st_size > 20_000


def test_the_console_is_really_read(folder: Path) -> None:
    (folder / "broken.html").write_text("<!DOCTYPE html><script>nonsense()</script>", encoding="utf-8")
    assert console(chromium(folder, "broken.html", "--dump-dom"))


def test_page_does_not_scroll_sideways_on_a_phone(folder: Path) -> None:
    run = chromium(folder, "phone.html", "--allow-file-access-from-files", "--virtual-time-budget=5000", "--dump-dom")
    found = re.search(r"width (\d+) of (\d+); boxes (\d+), beyond (-?\d+); letters (\d+), (\d+); badge (\d+)",
                      run.stdout)
    assert found, run.stdout[-500:]
    width, room, boxes, beyond, drawings, letters, badge = map(int, found.groups())
    assert width <= room <= 390
    assert boxes > 4 and beyond <= 0, "tables become lists, and no drawing has to be moved sideways"
    assert drawings >= 4 and letters >= 70, "letters of drawings are at least 7 px high"
    assert badge < 800, "the verdict is on the first screen"


def test_page_prints_on_a4(folder: Path) -> None:
    pdf = folder / "report.pdf"
    assert console(chromium(folder, "report.html", "--no-pdf-header-footer", f"--print-to-pdf={pdf}")) == []
    sizes = re.findall(rb"/MediaBox\s*\[\s*0 0 ([\d.]+) ([\d.]+)\s*\]", pdf.read_bytes())
    assert 2 <= len(sizes) <= 6
    assert {(round(float(w)), round(float(h))) for w, h in sizes} <= {(595, 842), (596, 842), (594, 841)}
