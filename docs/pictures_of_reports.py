"""Draw docs/images/reports_*.webp and pages*.webp, screens of reports and of this site.

    python docs/pictures_of_reports.py [SITE]

Needs Chromium. SITE is the folder of the built site, build/docs; without it the pages of the site are left out.
"""

from __future__ import annotations

import io
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from PIL import Image

import robthermal as rt

ROOT = Path(__file__).resolve().parents[1]
IMAGES = ROOT / "docs" / "images"
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "tests" / "benchmarks")]

from browser import Page, browser  # noqa: E402
from commands import command  # noqa: E402
from foreign.cases import Case, made  # noqa: E402

TWO = ROOT / "robthermal" / "systems" / "two_module.toml"
WIDE, PHONE, PAPER = 1280, 390, 680  # px; A4 without its margins
LARGEST = 120_000  # bytes of a picture
THUMB, SMALL, GAP = 430, 240, 10  # px of a screen in a sheet: wide ones, and those of a phone
BLOCK = """
[system]
name = "block on a plate (simulated)"
temperature_unit = "degC"
[ambients.room]
temperature = 25.0
[lumps.plate]
capacity = 120.0
[lumps.block]
capacity = 40.0
[[links]]
between = ["plate", "room"]
conductance = 0.6
[[links]]
between = ["plate", "block"]
conductance = 1.5
[inputs.heater]
lump = "block"
limits = [0.0, 12.0]
[sensors.Tp]
lump = "plate"
noise = 0.01
[sensors.Tb]
lump = "block"
noise = 0.01
[fit]
"lumps.plate.capacity" = { lower = 30.0, upper = 480.0, sigma = 12.0 }
"links.plate-room.conductance" = { lower = 0.15, upper = 2.4, sigma = 0.06 }
"""
HIDDEN = {  # what the machine has and the file does not, in the training and in the validation record
    "consistent": ((), ()),
    "named": 2 * ((("missing_ambient_link", ("block", "room"), {"conductance": 0.12}),),),
    "ambiguous": 2 * ((("heat_source", ("plate",), {"heat": 0.4}),),),
    "unexplained": ((), (("missing_ambient_link", ("block", "room"), {"conductance": 0.12}),)),
}
PLANT = """
[plant]
A = [[0.0, 10.0, 2.0], [-1.0, 1.0, 0.0], [0.0, 2.0, -5.0]]
B = [[1.0, 0.0], [0.0, 1.0], [1.0, 0.0]]
C = [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
D = [[0.0, 0.0], [0.0, 1.0], [2.0, 0.0]]
n_meas = 1
n_ctrl = 1
"""
VERTEX = "{{ A = [[{}]], B = [[1, 0, 1]], C = [[1], [0], [1]], D = [[0, 0, 0], [0, 0, 1], [0, 1, 0]] }}"
SYNTHESES = {
    "hinf": PLANT,
    "mixed": PLANT + "[design]\nhinf_limit = 12.0\n",
    "lpv": f"[plant]\nn_meas = 1\nn_ctrl = 1\nvertices = [{VERTEX.format(-1.0)}, {VERTEX.format(1.0)}]\n"
           "[design]\nscheduling = { a = [-1.0, 1.0] }\n",
    "tem": f'[system]\nfile = "{ROOT / "examples" / "one_peltier" / "setup.toml"}"\n'
           "box = { temperature = [270.0, 320.0], current = [0.5, 1.5] }\n[design]\noperating = 1.0\nrate = 0.001\n",
    "mpc": "[plant]\nA = [[0.0, 1.0], [0.0, 0.0]]\nB = [[0.0], [1.0]]\nn_ctrl = 1\n[design]\nhorizon = 15\n"
           "Q = [1.0, 0.1]\nR = 0.1\nsample_time = 0.2\n"
           "limits = { control = [-1.0, 1.0], state = [[-5.0, -1.2], [5.0, 1.2]] }\n",
    "frf-pid": '[frf]\nfile = "frf.csv"\n[design]\nmodulus_margin = 0.6\n',
}
COUPLING = """
[coupling]
name = "pair"
sample_time = 0.01
[subsystems.1]
name = "left"
plant = { num = [0.01], den = [1.0, -0.99] }
controller = 20.0
disturbance = 1e-9
[subsystems.2]
name = "right"
plant = { num = [0.02], den = [1.0, -0.98] }
controller = 15.0
disturbance = 1e-9
[design]
window = 0.1
order = 4
"""


def main() -> None:
    site = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "build" / "docs"
    with TemporaryDirectory() as name, browser() as page:
        folder = Path(name)
        screens = {one: folder / one / "report.html" for one in reports(folder)}
        sheet("reports_certify", [wide(page, screens[one]) for one in ("pass", "remarks", "fail")])
        sheet("reports_diagnosis", [wide(page, screens[one]) for one in ("consistent", "named", "ambiguous",
                                                                         "remainder", "unexplained", "changed")])
        sheet("reports_design", [wide(page, screens[one]) for one in ("design", "coupling", "map")])
        sheet("reports_synthesis", [wide(page, screens[one]) for one in SYNTHESES])
        kinds = ("pass", "remarks", "fail", "consistent", "named", "ambiguous", "unexplained", "remainder", "design",
                 "coupling")
        sheet("reports_dark", [wide(page, screens[one], dark=True) for one in kinds], columns=5)
        sheet("reports_printed", [paper(page, screens[one]) for one in kinds], columns=5)
        sheet("reports_phone", [phone(page, screens[one], dark=k % 2 > 0) for k, one in enumerate(kinds)], columns=5)
        if (site / "index.html").is_file():
            names = ("index", "tutorials/gallery", "tutorials/quick_start", "tutorials/bar", "tutorials/two_hours")
            pages = [site / f"{one}.html" for one in names]
            sheet("pages", [wide(page, one) for one in pages], columns=5)
            sheet("pages_dark_print", [*(wide(page, one, dark=True) for one in pages),
                                       *(paper(page, one, THUMB) for one in pages)], columns=5)
            sheet("pages_phone", [phone(page, one) for one in pages], columns=5)


def reports(folder: Path) -> Iterator[str]:
    """Results of every kind in the folder, by name."""
    cold = ["--setpoint", "m1=5", "--setpoint", "m2=5"]
    both = ["--current", "m1=0:{0}", "--current", "m2=0:{0}"]
    jobs: dict[str, list[object]] = {
        "pass": ["certify", TWO, *(one.format(1) for one in both), *cold, "--parameters",
                 "links.x1-room.conductance=0.6:0.7"],
        "fail": ["certify", TWO, *(one.format(1.5) for one in both), *cold],
        "remarks": ["run", ROOT / "examples" / "one_peltier" / "project.toml"],
        "design": ["design", TWO, *cold, "--bandwidth", "0.02"],
        "map": ["map", TWO, "--ambient", "20,30,3", "--load", "0,5,4", "--setpoint", "5,15,2"]}
    written = folder / "given"
    written.mkdir()
    jobs["coupling"] = ["couple", text(written / "pair.toml", COUPLING)]
    jobs |= diagnoses(written) | syntheses(written)
    for name, words in jobs.items():
        said = command(*words, "--out", folder / name, folder=written)
        assert said.status in (0, 1), said.err
        yield name


def diagnoses(written: Path) -> dict[str, list[object]]:
    """A diagnosis with every verdict, on simulated records."""
    system = rt.read_system(text(written / "block.toml", BLOCK))
    for name, hidden in HIDDEN.items():
        for k, effects in enumerate(hidden):
            machine = system
            for effect, where, values in effects:
                machine = rt.thermal.add_effect(machine, effect, where, values).system
            measured(machine, k, written / f"{name}_{k}.csv")
    bar = made(Case("bar", "hidden", "heater_power_slope", 0))  # 240 cells, against a file of six lumps
    named = bar.system.model_copy(update={"name": "bar of 240 cells (simulated)"})
    rt.thermal.write_system(named, written / "bar.toml")
    bar.train.save(written / "bar_0.csv")
    bar.unseen.save(written / "bar_1.csv")
    changed = system.with_parameters({"links.plate-room.conductance": 0.4})
    measured(changed, 5, written / "changed.csv")
    jobs: dict[str, list[object]] = {name: ["diagnose", "block.toml", f"{name}_0.csv", "--validation",
                                            f"{name}_1.csv"] for name in HIDDEN}
    jobs["remainder"] = ["diagnose", "bar.toml", "bar_0.csv", "--validation", "bar_1.csv"]
    return jobs | {"changed": ["diagnose", "block.toml", "changed.csv", "--reference", "consistent_0.csv",
                               "consistent_1.csv"]}


def measured(system: rt.System, seed: int, path: Path) -> None:
    """A simulated record of half an hour."""
    rng = np.random.default_rng(seed)
    heat = np.repeat(rng.choice([1.0, 3.0, 7.0, 11.0], 18), 20)
    inputs = np.column_stack([heat, np.full(heat.size, 298.15)])
    drive = rt.Record(sample_time=5.0, inputs=inputs, outputs=np.zeros((heat.size, 0)), input_names=["heater", "room"],
                      output_names=[])
    run = rt.thermal.simulate(system, drive)
    noisy = run.outputs + 0.01 * rng.standard_normal(run.outputs.shape)
    record = rt.Record(sample_time=5.0, inputs=inputs, outputs=noisy, input_names=["heater", "room"],
                       output_names=run.output_names)
    record.save(path, temperature_unit="degC", temperatures=["room", *run.output_names])


def syntheses(written: Path) -> dict[str, list[object]]:
    """A design by every kind of synthesis."""
    f = np.geomspace(1e-4, 0.1, 120)
    G = 2.0 / ((1 + 120j * np.pi * f) * (1 + 16j * np.pi * f))
    rows = [f"{a},{b.real},{b.imag}" for a, b in zip(f, G, strict=True)]
    text(written / "frf.csv", "\n".join(["frequency [Hz],real,imag", *rows]))
    return {method: ["design", text(written / f"{method}.toml", plant), "--method", method]
            for method, plant in SYNTHESES.items()}


def text(path: Path, content: str) -> Path:
    path.write_text(content, encoding="utf-8")
    return path


def wide(page: Page, file: Path, *, dark: bool = False) -> Image.Image:
    """First screen at 1280 px."""
    page.show(file, width=WIDE, dark=dark)
    return shown(page, 1300, THUMB)


def phone(page: Page, file: Path, *, dark: bool = False) -> Image.Image:
    """First screen at 390 px."""
    page.show(file, width=PHONE, dark=dark)
    return shown(page, 830, SMALL)


def paper(page: Page, file: Path, width: int = SMALL) -> Image.Image:
    """First page as it is printed."""
    page.show(file, width=PAPER, medium="print")
    return shown(page, 960, width)


def shown(page: Page, height: int, width: int) -> Image.Image:
    whole = Image.open(io.BytesIO(page.picture(height=height))).convert("RGB")
    return whole.resize((width, round(whole.height * width / whole.width)), Image.Resampling.LANCZOS)


def sheet(name: str, screens: Sequence[Image.Image], *, columns: int = 3) -> None:
    """Screens side by side in one picture."""
    rows = [screens[k:k + columns] for k in range(0, len(screens), columns)]
    wide_ = columns * (screens[0].width + GAP) - GAP
    heights = [max(one.height for one in row) for row in rows]
    whole = Image.new("RGB", (wide_, sum(heights) + GAP * (len(rows) - 1)), "white")
    top = 0
    for row, height in zip(rows, heights, strict=True):
        for k, one in enumerate(row):
            whole.paste(one, (k * (one.width + GAP), top))
        top += height + GAP
    for quality in (70, 60, 50, 40, 30, 20):
        whole.save(IMAGES / f"{name}.webp", quality=quality, method=6)
        if (IMAGES / f"{name}.webp").stat().st_size < LARGEST:
            break


if __name__ == "__main__":
    main()
