"""One effect is one object in one file: what every file must say, and that one file is enough for a new effect."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

import numpy as np
import pytest

import robthermal as rt

ORDER = """seebeck_slope resistance_slope conductance_slope thomson joule_split hysteresis lead_heating missing_link
    missing_ambient_link coolant_warming natural_convection radiation conductance_step driven_conductance
    conductance_exponent heat_source ambient_gradient hidden_mass path_mass periodic_load condensation input_gain
    input_offset input_saturation input_gain_slope input_delay input_lag heater_power_slope input_feedthrough
    driven_heat sensor_lag sensor_offset sensor_gain sensor_self_heating""".split()
KINDS = {"module", "lump", "ambient", "link", "sensor", "input", "input or module", "lump or ambient"}
TOY = '''"""A fan that blows on a lump while its heater is on."""

from robthermal.thermal.effects import Effect, Quantity
from robthermal.thermal.effects._builders import numbers

EFFECT = Effect(
    name="toy_draught", rank=5, meaning="A draught cools a lump by a constant heat.", where=("lump",),
    places=lambda system: [(name,) for name in system.lumps],
    quantities=(Quantity("heat", "W", -5.0, 5.0),), add=numbers("lumps", heat="heat"),
    confused_with=("heat_source",), separated_by="a screen around the lump", measure="the air speed at {0}")
'''


def bar() -> rt.System:
    return rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 100.0}},
                     links=[{"between": ("bar", "room"), "conductance": 0.5}], inputs={"heater": {"lump": "bar"}},
                     sensors={"T": {"lump": "bar", "noise": 0.02}})


def test_the_catalog_stands_in_the_order_of_its_ranks() -> None:
    known = rt.thermal.effects()
    assert list(known) == ORDER == list(rt.diagnosis.effects())
    ranks = [effect.rank for effect in known.values()]
    assert ranks == sorted(set(ranks))
    home = Path(sys.modules["robthermal.thermal.effects"].__file__ or "").parent
    assert {path.stem for path in home.glob("[a-z]*.py")} == set(ORDER)  # one file each, under its name


@pytest.mark.parametrize("name", ORDER)
def test_every_effect_says_all_that_is_known_about_it(name: str) -> None:
    effect = rt.thermal.effects()[name]
    assert effect.name == name and set(effect.where) <= KINDS and effect.where
    assert len(effect.meaning.split()) >= 5 and effect.meaning.endswith(".")
    assert effect.separated_by and set(effect.confused_with) <= set(ORDER) and effect.confused_with
    assert effect.signature is not None and set(effect.nonnegative) <= set(effect.parameters)
    for form in effect.all_forms:
        assert form.name == name and form.size.lower <= 0.0 <= form.size.upper
        assert all(q.unit and (q.grid or q is form.size) for q in form.quantities)
    assert effect.measure.format("a", "b") or not effect.measure


def test_one_file_is_a_new_effect(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "toy_draught.py").write_text(TOY)
    package = importlib.import_module("robthermal.thermal.effects")
    monkeypatch.setattr(package, "__path__", [*package.__path__, str(tmp_path)])
    monkeypatch.setattr(sys.modules["robthermal.thermal.effects._catalog"], "_BUILT_IN", {})
    try:
        assert list(rt.thermal.effects())[0] == "toy_draught" and len(rt.diagnosis.effects()) == len(ORDER) + 1
        added = rt.thermal.add_effect(bar(), "toy_draught", ["bar"], {"heat": -1.0})
        assert added.parameters == {"heat": "lumps.bar.heat"} and added.system.parameter("lumps.bar.heat") == -1.0
        with pytest.raises(rt.InputError, match="already"):
            rt.thermal.add_effect(added.system, "toy_draught", ["bar"])
        (explained,) = rt.jobs.explain("toy_draught")
        assert explained.meaning == ("A draught cools a lump by a constant heat.",)
        assert [c.label for c in rt.diagnosis.candidates(bar(), ["toy_draught"])] == ["toy_draught(bar)"]
        assert rt.diagnose(bar(), record(), effects=["toy_draught", "sensor_lag"]).effects[0].label == (
            "toy_draught(bar)")
    finally:
        sys.modules.pop("robthermal.thermal.effects.toy_draught", None)


def record() -> rt.Record:
    """Closed form: the bar loses one watt more than its model knows; the heater is held over each sample."""
    heater, h = np.repeat([4.0, 0.0, 6.0, 2.0], 50), 10.0
    T, decay = np.full(heater.size + 1, 293.0), np.exp(-0.5 / 100.0 * h)
    for k, q in enumerate(heater):
        end = 295.0 + (q - 1.0) / 0.5
        T[k + 1] = end + (T[k] - end) * decay
    noisy = T[:-1, None] + 0.02 * np.random.default_rng(1).standard_normal((heater.size, 1))
    return rt.Record(sample_time=h, inputs=np.column_stack([heater, np.full(heater.size, 295.0)]), outputs=noisy,
                     input_names=["heater", "room"], output_names=["T"])


def test_an_effect_of_a_user_is_added_without_knowing_its_numbers() -> None:
    rt.diagnosis.register_effect(rt.diagnosis.Effect(
        name="glued", places=lambda system: [(name,) for name in system.sensors],
        quantities=(rt.diagnosis.Quantity("offset", "K", -5.0, 5.0),),
        add=lambda system, where, q: system.with_parameters({f"sensors.{where[0]}.offset": q["offset"]})))
    try:
        added = rt.thermal.add_effect(bar(), "glued", ["T"], {"offset": 0.5})
        assert added.system.parameter("sensors.T.offset") == 0.5 and added.parameters == {}
        assert rt.jobs.explain("glued")[0].meaning == ("An effect of your own.",)
    finally:
        rt.diagnosis.forget_effect("glued")
    assert list(rt.thermal.effects()) == ORDER
