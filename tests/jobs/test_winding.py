"""A winding whose power rises with its temperature: named from its records, adopted, certified with its slope."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from heated_bar import CAPACITY, CONDUCTANCE, NOISE, POWER, PROJECT, ROOM, write_project

import recheck
import robthermal as rt

pytestmark = pytest.mark.usefixtures("sketched")
SLOPE = 0.0039  # 1/K, of copper
ASKED = PROJECT.replace("heat = { bar = [0.0, 8.0] }\n", "") + "[diagnose]\nadopt = true\n"


def write_winding(folder: Path) -> Path:
    """Steps of the heater in closed form: while it gives q the bar loses G - s q per kelvin."""
    rng, records = np.random.default_rng(1), {}
    for name, shares in (("train", (1.0, 0.0, 0.6, 1.0, 0.3)), ("validation", (0.5, 1.0, 0.0, 0.8, 0.4))):
        x, rise = 0.0, []
        for q in POWER * np.array(shares):
            loss = CONDUCTANCE - SLOPE * q
            t = np.arange(1, 401)
            rise.append(x)
            rise += (after := q / loss + (x - q / loss) * np.exp(-loss / CAPACITY * t))[:-1].tolist()
            x = float(after[-1])
        records[name] = 100 * np.repeat(shares, 400), ROOM + np.array(rise) + rng.normal(0, NOISE, len(rise))
    return write_project(folder, records, project=ASKED)


def test_the_slope_of_a_winding_is_certified_with_its_range(tmp_path: Path) -> None:
    out = tmp_path / "out"
    report = rt.jobs.run_project(rt.jobs.read_project(write_winding(tmp_path)), out)
    summary = json.loads((out / "summary.json").read_text())
    assert summary["diagnose"] == {"verdict": "named", "adopted": True, "effects": ["heater_power_slope(Q)"]}
    assert report.verdict == "PASS WITH REMARKS"
    low, high = summary["certify"]["parameters"]["inputs.Q.power_slope"]
    assert low < SLOPE < high < 2 * SLOPE and all(summary["certify"]["robust"].values())
    for name in ("contraction", "contraction_ranges", "box", "box_ranges", "box_contraction_ranges"):
        certificate = rt.Certificate.load(out / "certificates" / f"{name}.json")
        assert rt.verify(certificate).valid and certificate.region["power"] == {"Q": [0, 8]}
        assert recheck.check(out / "certificates" / f"{name}.json").status == "valid"
    box = rt.Certificate.load(out / "certificates" / "box.json")
    assert box.region["temperature"]["bar"][1] > ROOM + 273.15 + POWER / (CONDUCTANCE - SLOPE * POWER)
    assert sum("heater Q: 0 to 8 W at 20 °C, linear in its temperature" in claim.box for claim in report.claims) == 6
    again = rt.jobs.rebuild_report(out)
    assert again.verdict == report.verdict and [one.status for one in again.claims] == [
        one.status for one in report.claims]
