"""The catalog page shows every effect, and the documented examples run."""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import robthermal as rt

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE = DOCS / "explanations" / "effects.md"
LARGEST = 25_000  # bytes


@pytest.fixture(scope="module")
def script() -> ModuleType:
    spec = importlib.util.spec_from_file_location("pictures_of_effects", DOCS / "pictures_of_effects.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


def pictures() -> dict[str, str]:
    """Effect to alternative text, as on the page."""
    found = re.findall(r"!\[([^\]]*)\]\(\.\./images/effects/(\w+)\.svg\)", PAGE.read_text(encoding="utf-8"))
    assert len(found) == len({name for _, name in found}), "a picture twice"
    return {name: text for text, name in found}


def code(page: Path, number: int = 0) -> str:
    return re.findall(r"^```python\n(.*?)^```", page.read_text(encoding="utf-8"), re.M | re.S)[number]


def test_every_effect_has_a_picture_with_words(script: ModuleType) -> None:
    shown = pictures()
    assert set(shown) == set(rt.thermal.effects()) == set(script.PICTURES)
    for name, text in shown.items():
        assert name in text and len(text) > 40, f"{name}: say what the picture shows"
        drawn = (DOCS / "images" / "effects" / f"{name}.svg").read_text(encoding="utf-8")
        assert len(drawn.encode()) <= LARGEST
        assert script.title(name) in drawn, f"{name}: run docs/pictures_of_effects.py again"
    assert {path.stem for path in (DOCS / "images" / "effects").iterdir()} == set(shown)


@pytest.mark.parametrize("name", sorted(rt.thermal.effects()))
def test_picture_shows_a_change(script: ModuleType, name: str) -> None:
    without, with_it = script.readings(name)
    assert 0.2 < np.abs(with_it - without).max() < 12.0


def test_example_of_the_effects_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    exec(code(PAGE), {})
    assert rt.read_system("setup.toml").parameter("leads.m1-x6.resistance") == 0.02


def test_a_supply_that_sags_is_no_finding_once_the_power_is_the_column(tmp_path: Path, monkeypatch: pytest.MonkeyPatch
                                                                       ) -> None:
    """Lines of the page; a lump heated by 14 Ω on 12 V that sag by 2 V and come back, and a room that is recorded."""
    monkeypatch.chdir(tmp_path)
    rng, h, n = np.random.default_rng(1), 5.0, 500
    duty = np.repeat(rng.choice([0.0, 30.0, 60.0, 90.0], n // 20), 20)
    voltage = 12.0 - 2.0 * np.sin(np.arange(n) * h / 250.0) ** 2
    T, rows, decay = 22.0, [], np.exp(-h * 0.5 / 100.0)
    for power in duty / 100.0 * voltage**2 / 14.0:
        rows.append(T)
        T = 22.0 + power / 0.5 + (T - 22.0 - power / 0.5) * decay
    table = np.column_stack([h * np.arange(n), duty, voltage, np.full(n, 22.0), rows + 0.05 * rng.standard_normal(n)])
    np.savetxt("raw.csv", table, delimiter=",", header="time,duty,voltage,room,T", comments="", fmt="%.9g")
    exec(code(PAGE, 1), {})

    def found(column: str, file: str, gain: float) -> rt.diagnosis.Diagnosis:
        system = rt.System(ambients={"room": {"temperature": 295.15}}, lumps={"block": {"capacity": 100.0}},
                           links=[{"between": ("block", "room"), "conductance": 0.5}], temperature_unit="degC",
                           inputs={column: {"lump": "block", "gain": gain}},
                           sensors={"T": {"lump": "block", "noise": 0.05}},
                           fit={f"inputs.{column}.gain": {"lower": 0.2 * gain, "upper": 5.0 * gain},
                                "lumps.block.capacity": {"lower": 50.0, "upper": 200.0}})
        return rt.diagnose(system, rt.read_record(tmp_path / file, system),
                           effects=["input_saturation", "input_gain_slope", "sensor_lag"])

    computed = found("power", "log.csv", 1.0)
    assert computed.verdict == "consistent"
    gain = computed.system.inputs["power"].gain
    assert gain == pytest.approx(15.0 / 14.0, rel=0.01)  # the page divides by 15 Ω
    with pytest.warns(UserWarning, match="unknown columns, not read: 'voltage'"):
        assert found("duty", "raw.csv", 0.1).verdict == "unexplained"


def test_own_effect_of_ten_lines_is_named() -> None:
    # The example of the page, as it stands; the record is a closed form: a lump that warms and cools, read late.
    block = code(DOCS / "explanations" / "diagnosis.md")
    assert len([line for line in block.splitlines() if line.strip() and not line.startswith("import")]) <= 10
    bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 100.0}},
                    links=[{"between": ("bar", "room"), "conductance": 0.5}], inputs={"heater": {"lump": "bar"}},
                    sensors={"T": {"lump": "bar", "noise": 0.02}})
    heater, late = np.repeat([4.0, 0.0, 6.0, 2.0, 5.0, 1.0], 40), 20.0
    T, h = np.empty(heater.size), 10.0
    state, decay = 295.0, np.exp(-0.5 / 100.0 * h)
    for k, q in enumerate(heater):  # exact: the input is held over each sample
        T[k] = state
        state = 295.0 + q / 0.5 + (state - 295.0 - q / 0.5) * decay
    read = np.concatenate([np.full(2, 295.0), T[:-2]])  # two samples are the 20 s
    record = rt.Record(sample_time=h, inputs=heater, outputs=read[:, None] + 0.02 * np.random.default_rng(1)
                       .standard_normal((heater.size, 1)), input_names=["heater"], output_names=["T"])
    exec(block, {})
    try:
        found = rt.diagnose(bar, record, effects=["sensor_delay", "sensor_lag", "sensor_offset", "hidden_mass"])
    finally:
        rt.diagnosis.forget_effect("sensor_delay")
    assert found.verdict == "named" and found.effects[0].label == "sensor_delay(T)"
    assert found.effects[0].values["delay"][0] == pytest.approx(late, abs=1.0)
