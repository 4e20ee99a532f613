"""Exports: C against Python to the last bit, the C code in the loop, files that hold the same numbers, refusals."""

from __future__ import annotations

import ctypes
import json
import re
import shutil
import subprocess
from pathlib import Path

import control
import numpy as np
import pytest
from scipy.io import loadmat

import robthermal as rt
from robthermal.design._observer_recursion import ObserverRecursion

GCC = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
needs_compiler = pytest.mark.skipif(GCC is None, reason="no C compiler on this machine")
FLAGS = ["-std=c99", "-O2", "-Wall", "-Wextra", "-pedantic", "-Werror", "-ffp-contract=off"]
EFFECTS = [("lead_heating", ["x6", "m1"], {"resistance": 0.05}), ("thomson", ["m1"], {"coefficient": 1e-3}),
           ("condensation", ["x11"], {"conductance": 0.1, "dew_point": 296.0}), ("joule_split", ["m2"], {"split": 0.1}),
           ("hysteresis", ["m1"], {"heat": 0.1}), ("conductance_slope", ["m2"], {"slope": 1e-3}),
           ("input_saturation", ["m1"], {"cubic": 1e-3, "clip": 2.5}), ("input_gain", ["m2"], {"gain": 0.05}),
           ("ambient_gradient", ["x1"], {"difference": 0.5}), ("heat_source", ["x2"], {"heat": 0.2}),
           ("natural_convection", ["x3", "room"], {"gain": 0.02}), ("sensor_gain", ["T7"], {"gain": 1.02}),
           ("radiation", ["x4", "room"], {"coefficient": 1e-10}), ("sensor_offset", ["T6"], {"offset": 0.3}),
           ("heater_power_slope", ["heater"], {"slope": 1e-3}), ("input_feedthrough", ["heater", "x5"], {"share": 0.1}),
           ("periodic_load", ["x2"], {"heat": 0.3}), ("conductance_step", ["x1-x3"], {"relative": 0.3, "time": 9.0}),
           ("driven_conductance", ["x2-x4", "m1"], {"relative": 0.2}),
           ("conductance_exponent", ["x1-room"], {"exponent": 1.2}),
           ("input_gain_slope", ["heater"], {"slope": 0.01})]


def build(path, *more):
    """Compile a C file; returns the program."""
    program = path.with_suffix(".out")
    subprocess.run([str(GCC), *FLAGS, *more, str(path), "-o", str(program), "-lm"], check=True)
    return program


def difference(path, flag):
    """What the test vector of a C file says."""
    run = subprocess.run([build(path, f"-D{flag}")], capture_output=True, text=True, check=False)
    return run.stdout.strip(), run.returncode


@pytest.fixture(scope="module")
def everything(system):
    """The two-module setup with a heater, and with every effect that an observer's model can hold."""
    system = rt.thermal.parse_system(rt.thermal.format_system(system) + '[inputs.heater]\nlump = "x6"\n')
    for effect, where, values in EFFECTS:
        system = rt.thermal.add_effect(system, effect, where, values).system
    return system


@pytest.fixture(scope="module")
def exports(system, law, plant, pi, everything):
    """Everything that can be exported, with the flag of its test program."""
    s = control.tf("s")
    one = control.ss(0.3 * (1 + 0.01 / s))
    feedback = rt.design.state_feedback(plant, bandwidth=0.05, sample_time=1.0)
    controllers = {
        "pi": pi, "p": rt.design.pid(plant, proportional=0.2, sample_time=1.0), "state feedback": feedback,
        "pid": rt.design.pid(plant, proportional=0.2, integral=0.01, derivative=0.5, sample_time=1.0),
        "linear": rt.design.linear_controller(plant, control.append(one, one), sample_time=1.0),
        "feed-forward": rt.design.feed_forward(plant, pi),
        "disturbance observer": rt.design.disturbance_observer(plant, feedback, time_constant=20.0)}
    limited = rt.design.feedback_linearization(system, slew=0.5, voltage_limits={"m1": (-6.0, 8.0)})
    box = {"current": {"m1": (0.0, 1.5), "m2": (0.0, 1.5)}, "temperature": (278.15, 358.15)}
    observers = {"kalman": rt.design.observer(system, ["T6", "T7"]),
                 "positive": rt.design.observer(system, ["T6", "T7"], method="positive", **box),
                 "effects": rt.design.observer(everything, ["T6", "T7"])}
    return {**{key: (value, "CONTROLLER_TEST") for key, value in controllers.items()},
            **{key: (value, "OBSERVER_TEST") for key, value in observers.items()},
            "law": (law, "LAW_TEST"), "limited law": (limited, "LAW_TEST")}


CONTROLLERS = ["pi", "p", "pid", "state feedback", "linear", "feed-forward", "disturbance observer"]
OBSERVERS = ["kalman", "positive", "effects"]
ALL = [*CONTROLLERS, *OBSERVERS, "law", "limited law"]


@needs_compiler
@pytest.mark.parametrize("which", ALL)
def test_c_gives_python_to_the_last_bit(which, exports, tmp_path):
    what, flag = exports[which]
    what.export(tmp_path / "e.c", f"my {which} */ é??/")
    assert difference(tmp_path / "e.c", flag) == ("0", 0)


@needs_compiler
@pytest.mark.parametrize("which", ["pid", "effects", "law"])
def test_c_with_another_number_fails_its_test(which, exports, tmp_path):
    what, flag = exports[which]
    what.export(tmp_path / "e.c")
    text = (tmp_path / "e.c").read_text()
    code = text[: text.index(f"#ifdef {flag}")]
    numbers = [found for found in re.finditer(r"-?0x1\.[0-9a-f]+p[+-]\d+", code) if found.group() != "0x1.0p+0"
               and abs(float.fromhex(found.group())) > 1e-3]  # a smaller entry may not reach what is printed
    assert len(numbers) > 8
    for found in numbers[:: max(len(numbers) // 3, 1)]:
        changed = float.fromhex(found.group()) * (1 + 1e-3)
        (tmp_path / "m.c").write_text(text[: found.start()] + changed.hex() + text[found.end():])
        printed, status = difference(tmp_path / "m.c", flag)
        assert status == 1 and float(printed) > 1e-9, found.group()


@pytest.mark.parametrize("which", CONTROLLERS)
def test_json_reads_back_as_the_same_controller(which, exports, plant, tmp_path):
    controller, _ = exports[which]
    controller.export(tmp_path / "c.json", which)
    again = rt.design.load_controller(tmp_path / "c.json")
    assert again.name == which and again.sample_time == controller.sample_time
    again.export(tmp_path / "again.json", which)
    first, second = (json.loads((tmp_path / name).read_text()) for name in ("c.json", "again.json"))
    assert {**first, "kind": ""} == {**second, "kind": ""}
    rng, m, n = np.random.default_rng(0), 2, len(plant.law.system.lumps)
    mine = yours = None
    for _ in range(50):
        seen = rt.design.ControllerInput(*(rng.uniform(280, 300, size) for size in (m, m, n, len(plant.around))))
        if mine is None:
            mine, yours = (c.start(seen, np.array([-1.0, 2.0])) for c in (controller, again))
        wanted, heat = controller.heat(mine, seen), again.heat(yours, seen)
        np.testing.assert_allclose(heat, wanted, rtol=0, atol=1e-9)
        achieved = wanted + rng.standard_normal(m)
        mine = controller.advance(mine, seen, wanted, achieved)
        yours = again.advance(yours, seen, wanted, achieved)


@pytest.mark.parametrize("which", OBSERVERS)
def test_recursion_is_the_observer(which, exports):
    """The operations of the C source against the arrays of the observer, along random records."""
    observer, _ = exports[which]
    recursion, rng = ObserverRecursion.of(observer.model, observer.gain), np.random.default_rng(0)
    names = observer.model.system.exogenous_names
    x = y = np.full(len(observer.model.system.lumps), 297.0)
    for _ in range(40):
        u = [*rng.uniform(-3.0, 3.0, len(names) - 1), rng.uniform(290.0, 300.0)]
        readings = rng.uniform(290.0, 300.0, 2)
        x = observer.step(x, readings, dict(zip(names, u, strict=True)))
        y = recursion.step(list(y), readings.tolist(), u)
        np.testing.assert_allclose(y, x, rtol=0, atol=1e-9)


def test_lost_reading_corrects_nothing(exports):
    observer, _ = exports["kalman"]
    recursion, x = ObserverRecursion.of(observer.model, observer.gain), [300.0] * 18
    u = [0.5, 0.7, 298.0]
    predicted = observer.model.predict(np.array(x), np.array(u))
    np.testing.assert_allclose(recursion.step(x, [np.nan, np.inf], u), predicted, rtol=0, atol=1e-10)


def array(values):
    return (ctypes.c_double * len(values))(*map(float, values))


@needs_compiler
def test_c_in_the_loop_is_the_simulated_loop(system, law, plant, tmp_path):
    """PI, law and observer as C on the nonlinear plant, from a cold start with a limit active, against Python."""
    pi = rt.design.pid(plant, bandwidth=0.2, sample_time=1.0)
    observer = rt.design.observer(system, ["T6", "T7"])
    for what, name in ((pi, "pi"), (law, "law"), (observer, "obs")):
        what.export(tmp_path / f"{name}.h", name)
    (tmp_path / "loop.c").write_text("""
#include "pi.h"
#include "law.h"
#include "obs.h"
static pi_state c;
static obs_state o;
void start(const double *lumps) { obs_init(&o, lumps); }
int sample(int first, const double *r, const double *hot_cold, const double *y, double room, double *current)
{
    int limit[2], active = 0;
    pi_seen seen = {{r[0], r[1]}, {hot_cold[2], hot_cold[3]}};
    double none[2] = {0}, v[2], volt[2], got[2], in[3];
    if (first)
        pi_init(&c, &seen, none);
    pi_heat(&c, &seen, v);
    law_step(v, hot_cold, hot_cold + 2, 0, 1.0, current, volt, got, limit);
    pi_advance(&c, &seen, v, got);
    for (int k = 0; k < 2; k++)
        in[k] = current[k], active += limit[k] != 0;
    in[2] = room;
    obs_step(&o, y, in);
    return active;
}
const double *estimate(void) { return o.x; }
""")
    library = ctypes.CDLL(str(build(tmp_path / "loop.c", "-shared", "-fPIC")))
    library.estimate.restype = ctypes.POINTER(ctypes.c_double)
    target = np.where(np.arange(120) < 60, 283.15, 293.15)[:, None] + [0.0, 1.0]
    run = rt.design.simulate_loop(system, pi, target, law=law, duration=120.0, observer=observer)
    stepper = rt.thermal.Stepper(system, 1.0)
    library.start(array(stepper.lumps))
    active = 0
    for k in range(120):
        x = np.ctypeslib.as_array(library.estimate(), (18,)).copy()
        np.testing.assert_allclose(x, run.estimate[k], rtol=0, atol=1e-8)
        faces = [*x[law.modules.hot], *x[law.modules.cold]]
        current = array([0.0, 0.0])
        readings = [stepper.readings[system.sensor_names.index(name)] for name in observer.sensors]
        active += library.sample(k == 0, array(target[k]), array(faces), array(readings), ctypes.c_double(298.15),
                                 current)
        np.testing.assert_allclose(list(current), run.current[k], rtol=0, atol=1e-8)
        stepper.step(dict(zip(law.names, list(current), strict=True)))
    assert active == (run.limit != "").sum() > 5


@needs_compiler
def test_law_in_c_switches_off_on_a_fault(law, tmp_path):
    law.export(tmp_path / "law.h", "law")
    (tmp_path / "law_call.c").write_text('#include "law.h"\nint step(const double *v, const double *h, const double *c,'
                                         " double *i, double *u, double *q, int *l)\n"
                                         "{ return law_step(v, h, c, 0, 1.0, i, u, q, l); }\n")
    library = ctypes.CDLL(str(build(tmp_path / "law_call.c", "-shared", "-fPIC")))
    good = [[-2.0, -2.0], [300.0, 300.0], [285.0, 285.0]]
    for which, bad in ((0, np.nan), (1, np.nan), (1, np.inf), (2, 25.0), (2, -np.inf), (1, -1e9)):
        given = [list(values) for values in good]
        given[which][1] = bad
        current, voltage, heat, limit = array([9, 9]), array([9, 9]), array([9, 9]), (ctypes.c_int * 2)(9, 9)
        faults = library.step(*map(array, given), current, voltage, heat, limit)
        assert faults == 1 and list(limit) == [0, 5], (which, bad)
        assert (current[1], voltage[1], heat[1]) == (0.0, 0.0, 0.0) and current[0] > 0.1


def test_matlab_and_json_hold_the_numbers(exports, law, tmp_path):
    observer, _ = exports["effects"]
    observer.export(tmp_path / "o.mat")
    observer.export(tmp_path / "o.json")
    mat, text = loadmat(tmp_path / "o.mat", simplify_cells=True), json.loads((tmp_path / "o.json").read_text())
    model = observer.model
    for key, value in (("A", model.A_d), ("G", model.Gamma), ("C", model.C), ("L", observer.gain)):
        np.testing.assert_array_equal(mat[key], value)
        np.testing.assert_array_equal(text[key], value)
    assert rt.thermal.parse_system(text["system"]) == model.system and mat["sample_time"] == 1.0
    law.export(tmp_path / "l.mat")
    law.export(tmp_path / "l.json")
    mat, text = loadmat(tmp_path / "l.mat", simplify_cells=True), json.loads((tmp_path / "l.json").read_text())
    assert [row["S"] for row in mat["modules"]] == [row["S"] for row in text["modules"]] == [
        part.seebeck.value for part in law.modules.parts]
    assert mat["modules"][0]["slew"] == np.inf and text["modules"][0]["slew"] is None
    controller, _ = exports["state feedback"]
    controller.export(tmp_path / "c.mat")
    mat = loadmat(tmp_path / "c.mat", simplify_cells=True)
    columns = 2 + 2 + 2 + np.arange(8)  # memory, reference, cold, lumps
    np.testing.assert_array_equal(mat["heat"][:, columns], -controller.K)


class Squared(rt.design.PID):
    """A controller that is not linear."""

    def heat(self, state, seen):
        return super().heat(state, seen) ** 2


def test_refusals(exports, pi, plant, tmp_path):
    for which in ("pi", "kalman", "law"):
        with pytest.raises(rt.InputError, match=r'file type ".xlsx"'):
            exports[which][0].export(tmp_path / "e.xlsx")
        with pytest.raises(rt.InputError, match="cannot be written"):
            exports[which][0].export(tmp_path / "none" / "e.c")
    with pytest.raises(rt.InputError, match="a Squared is not linear"):
        Squared(*vars(pi).values()).export(tmp_path / "e.c")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("change", "message"), [
    ({"format": "robthermal-law/1"}, "not a controller"), ({"heat": [[1.0]]}, "not a complete controller"),
    ({"start": None}, "not a complete controller"), ({"sample_time": -1.0}, "sample_time"),
    ({"advance": [["x"]]}, "advance"), ({"indices": [3, 4]}, "contradict"), ({"modules": 0}, "controller"),
    ({"modules": float("inf")}, "not a complete controller"), ({"heat": [[float("nan")] * 6] * 2}, "heat")])
def test_bad_controller_files_are_refused(change, message, pi, tmp_path):
    path = tmp_path / "c.json"
    pi.export(path)
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(rt.InputError, match=message):
        rt.design.load_controller(path)


def test_files_that_are_no_controller_are_refused(exports, tmp_path):
    with (tmp_path / "c.json").open("wb") as file:
        file.truncate(60_000_000)
    with pytest.raises(rt.InputError, match="larger than 50 MB"):
        rt.design.load_controller(tmp_path / "c.json")
    (tmp_path / "c.json").write_text("[" * 100_000)
    with pytest.raises(rt.InputError, match="is not JSON"):
        rt.design.load_controller(tmp_path / "c.json")
    with pytest.raises(rt.InputError, match="cannot be read"):
        rt.design.load_controller(Path(tmp_path / "none.json"))
    exports["state feedback"][0].export(tmp_path / "s.json")
    small = rt.design.ControllerInput(np.full(2, 290.0), np.full(2, 290.0), np.full(17, 290.0), np.zeros(1))
    with pytest.raises(rt.InputError, match="made for 18 lumps"):
        rt.design.load_controller(tmp_path / "s.json").start(small, np.zeros(2))
