"""Draw docs/images/effects/<effect>.svg, a reading without and with each effect: python docs/pictures_of_effects.py"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from numpy.typing import NDArray

import robthermal as rt

FOLDER = Path(__file__).resolve().parent / "images" / "effects"
SAMPLE_TIME = 10.0  # s
ROOM = 298.15  # K
# Text stays text, and the same picture is the same file.
STYLE = {"svg.fonttype": "none", "svg.hashsalt": "robthermal", "font.size": 9, "axes.spines.top": False,
         "axes.spines.right": False, "axes.linewidth": 0.6, "path.simplify_threshold": 0.3}


@dataclass(frozen=True)
class Picture:
    """What is drawn: an effect of a size that the eye sees, and the sensor that shows it best."""

    where: tuple[str, ...]
    values: dict[str, float]
    sensor: str = "plate"


PICTURES = {
    "seebeck_slope": Picture(("m1",), {"slope": 4e-4}),
    "resistance_slope": Picture(("m1",), {"slope": 0.04}),
    "conductance_slope": Picture(("m1",), {"slope": 0.01}),
    "thomson": Picture(("m1",), {"coefficient": 0.01}),
    "joule_split": Picture(("m1",), {"split": 0.3}),
    "hysteresis": Picture(("m1",), {"heat": 0.8, "time_constant": 120.0}),
    "lead_heating": Picture(("plate", "m1"), {"resistance": 0.4}),
    "missing_link": Picture(("sample", "sink"), {"conductance": 0.15}, "sample"),
    "missing_ambient_link": Picture(("plate", "room"), {"conductance": 0.15}),
    "coolant_warming": Picture(("room",), {"warming": 0.4}, "sink"),
    "natural_convection": Picture(("sink", "room"), {"gain": 0.4, "exponent": 0.25}, "sink"),
    "radiation": Picture(("sample", "room"), {"coefficient": 1.5e-9}, "sample"),
    "ambient_gradient": Picture(("sink",), {"difference": 1.5}, "sink"),
    "conductance_step": Picture(("sample-plate",), {"relative": -0.4, "time": 1500.0}, "sample"),
    "driven_conductance": Picture(("sample-plate", "m1"), {"relative": 0.8}, "sample"),
    "conductance_exponent": Picture(("sample-plate",), {"exponent": -2.0}, "sample"),
    "condensation": Picture(("plate",), {"conductance": 0.6, "dew_point": 293.15}),
    "heat_source": Picture(("plate",), {"heat": 1.0}),
    "hidden_mass": Picture(("plate",), {"capacity": 60.0, "time_constant": 200.0}),
    "path_mass": Picture(("sink-room",), {"capacity": 800.0, "ratio": 0.5}, "sink"),
    "periodic_load": Picture(("plate",), {"heat": 1.0, "period": 400.0, "phase": 0.0}),
    "input_gain": Picture(("heater",), {"gain": 0.2}, "sample"),
    "input_offset": Picture(("m1",), {"offset": 0.15}),
    "input_saturation": Picture(("m1",), {"cubic": 0.05}),
    "input_gain_slope": Picture(("heater",), {"slope": 0.06}, "sample"),
    "input_delay": Picture(("heater",), {"delay": 60.0}, "sample"),
    "input_lag": Picture(("heater",), {"time_constant": 60.0}, "sample"),
    "heater_power_slope": Picture(("heater",), {"slope": 0.02}, "sample"),
    "driven_heat": Picture(("speed", "plate"), {"gain": 0.002}),
    "input_feedthrough": Picture(("heater", "sink"), {"share": 0.3}, "sample"),
    "sensor_lag": Picture(("T_plate",), {"time_constant": 60.0}),
    "sensor_offset": Picture(("T_plate",), {"offset": 1.0}),
    "sensor_gain": Picture(("T_plate",), {"gain": 0.15}),
    "sensor_self_heating": Picture(("T_plate",), {"heat": 1.0}),
}


def plant() -> rt.System:
    """A sample on a plate that one module heats or cools against a sink."""
    return rt.System(
        ambients={"room": {"temperature": ROOM}},
        lumps={"sample": {"capacity": 30.0, "initial": ROOM}, "plate": {"capacity": 60.0, "initial": ROOM},
               "sink": {"capacity": 200.0, "initial": ROOM}},
        links=[{"between": ("sample", "plate"), "conductance": 0.5}, {"between": ("sink", "room"), "conductance": 2.0}],
        inputs={"heater": {"lump": "sample"}, "speed": {"lump": "sample", "gain": 0.0, "unit": "rpm"}},
        modules={"m1": {"hot": "sink", "cold": "plate", "reference_temperature": ROOM, "seebeck": 0.05,
                        "resistance": 2.0, "conductance": 0.5}},
        sensors={f"T_{name}": {"lump": name} for name in ("sample", "plate", "sink")})


def piped(system: rt.System) -> rt.System:
    """The same with the sample in the stream that cools the sink, before it."""
    sample = rt.thermal.Link(between=("sample", "room"), conductance=1.0)
    room = rt.thermal.Ambient(temperature=ROOM, coolant=("sample", "sink"))
    return rt.System(**{**dict(system), "ambients": {"room": room}, "links": (*system.links, sample)})


def excitation() -> rt.Record:
    """Heater alone, current of both signs, both together, then a warmer room; a rotor that turns now and then."""
    heater = np.repeat([0.0, 4.0, 0.0, 0.0, 0.0, 4.0, 0.0, 0.0], 30)
    current = np.repeat([0.0, 0.0, 1.5, -0.8, 0.0, 1.5, 1.0, 0.0], 30)
    room = np.repeat([ROOM, ROOM, ROOM, ROOM, ROOM, ROOM, ROOM, ROOM + 4.0], 30)
    speed = np.repeat([0.0, 1000.0, 0.0, 500.0, 1000.0, 0.0, 0.0, 1000.0], 30)
    return rt.Record(sample_time=SAMPLE_TIME, inputs=np.column_stack([heater, current, room, speed]),
                     outputs=np.zeros((240, 0)), input_names=["heater", "m1", "room", "speed"], output_names=[])


def readings(name: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Reading of the picture's sensor without and with the effect [K]."""
    picture, drive = PICTURES[name], excitation()
    column, usual = f"T_{picture.sensor}", piped(plant()) if name == "coolant_warming" else plant()
    changed = rt.thermal.add_effect(usual, name, picture.where, picture.values).system
    return rt.thermal.simulate(usual, drive)[column], rt.thermal.simulate(changed, drive)[column]


def title(name: str) -> str:
    """Place and size in words."""
    drive = "A" if "m1" in PICTURES[name].where else "W"
    known = {"-": "", "unit": drive, "W/unit": "W/rpm",
             "1/unit": f"1/{drive}", "1/unit²": f"1/{drive}²", "W/K^(1+exponent)": "W/K^1.25"}
    sizes = []
    for key, value in PICTURES[name].values.items():
        unit = rt.thermal.effects()[name].parameters[key]
        sizes.append(f"{key.replace('_', ' ')} {value:g} {known.get(unit, unit)}".rstrip())
    return f"{name}({', '.join(PICTURES[name].where)}): {', '.join(sizes)}"


def draw(name: str, folder: Path) -> Path:
    """Write one picture."""
    without, with_it = readings(name)
    minutes = np.arange(without.size) * SAMPLE_TIME / 60.0
    with rc_context(STYLE):
        figure = Figure(figsize=(6.0, 3.1), layout="constrained")
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
        above.plot(minutes, without - 273.15, color="0.45", linewidth=1.0, linestyle="--", label="without")
        above.plot(minutes, with_it - 273.15, color="C3", linewidth=1.2, label="with the effect")
        above.set_title(title(name), fontsize=9, loc="left")
        above.set_ylabel(f"T_{PICTURES[name].sensor} [°C]")
        above.legend(fontsize=8, frameon=False, loc="best", ncols=2)
        below.plot(minutes, with_it - without, color="C3", linewidth=1.0)
        below.axhline(0.0, color="0.45", linewidth=0.6)
        below.set(xlabel="time [min]", ylabel="change [K]")
        path = folder / f"{name}.svg"
        figure.savefig(path, metadata={"Date": None})
    return path


def main(names: Sequence[str] = tuple(PICTURES)) -> None:
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name in names:
        path = draw(name, FOLDER)
        print(f"{path.name} {path.stat().st_size / 1000:.1f} kB")


if __name__ == "__main__":
    main()
