"""What a design writes for other programs: compiled C in the loop, MATLAB, JSON, read back and damaged."""

from __future__ import annotations

import ctypes
import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from distant_plate import machine
from scipy.io import loadmat

import robthermal as rt

GCC = shutil.which("gcc") or shutil.which("cc")
needs_compiler = pytest.mark.skipif(GCC is None, reason="no C compiler on this machine")
FLAGS = ["-std=c99", "-O2", "-Wall", "-Werror", "-ffp-contract=off"]
NAMES = ("law", "controller", "observer")
_SAMPLE = """
#include "law.c"
#include "controller.c"
#include "observer.c"
static controller_state c;
static observer_state o;
void start(const double *lumps) { observer_init(&o, lumps); }
void sample(int first, double r, double seen_by_sensor, double other, double room, double *current)
{
    controller_seen seen = {{r}, {seen_by_sensor}};
    double none[1] = {0}, v[1], hot[1] = {o.x[0]}, cold[1] = {o.x[1]}, volt[1], got[1], in[2];
    int limit[1];
    if (first)
        controller_init(&c, &seen, none);
    controller_heat(&c, &seen, v);
    law_step(v, hot, cold, 0, 2.0, current, volt, got, limit);
    controller_advance(&c, &seen, v, got);
    in[0] = current[0];
    in[1] = room;
    observer_step(&o, &other, in);
}
"""


@pytest.fixture(scope="module")
def done():
    request = rt.jobs.DesignRequest(setpoint={"m1": 288.15}, regulate={"m1": "T_plate"}, bandwidth=0.012,
                                    sample_time=2.0, sensors=("T_sink",), export=("c", "mat", "json"))
    return rt.jobs.design_system(machine(), request)


@pytest.fixture(scope="module")
def folder(done, tmp_path_factory):
    out = tmp_path_factory.mktemp("written")
    rt.jobs.design.save_design(done, out)
    return out


def test_all_files_are_written(folder):
    assert {path.name for path in folder.iterdir()} == {"design.json"} | {
        f"{name}.{ending}" for name in NAMES for ending in ("c", "h", "mat", "json")}


@needs_compiler
@pytest.mark.parametrize("name", NAMES)
def test_c_meets_its_test_vector(folder, tmp_path, name):
    for more, what in ((["-c"], "o"), ([f"-D{name.upper()}_TEST"], "out")):
        subprocess.run([str(GCC), *FLAGS, *more, str(folder / f"{name}.c"), "-o", str(tmp_path / f"{name}.{what}"),
                        *(["-lm"] if what == "out" else [])], check=True)
    run = subprocess.run([tmp_path / f"{name}.out"], capture_output=True, text=True, check=False)
    assert (run.stdout.strip(), run.returncode) == ("0", 0)


@needs_compiler
def test_c_in_the_loop_is_the_simulated_loop(done, folder, tmp_path):
    """The lagging, offset sensor goes into the controller, the estimates into the law; 300 samples from rest."""
    (tmp_path / "loop.c").write_text(_SAMPLE)
    library = tmp_path / "loop.so"
    subprocess.run([str(GCC), *FLAGS, "-shared", "-fPIC", f"-I{folder}", str(tmp_path / "loop.c"), "-o", str(library),
                    "-lm"], check=True)
    code = ctypes.CDLL(str(library))
    expected = rt.design.simulate_loop(machine(), done.controller, 288.15, law=done.law, duration=600.0,
                                       observer=done.observer, regulate={"m1": "T_plate"})
    plant = rt.thermal.Stepper(machine(), 2.0)
    code.start((ctypes.c_double * 3)(*plant.lumps))
    code.sample.argtypes = [ctypes.c_int, *[ctypes.c_double] * 4, ctypes.POINTER(ctypes.c_double)]
    current = (ctypes.c_double * 1)()
    found = []
    for k in range(300):
        plate, sink = plant.readings
        code.sample(k == 0, 288.15, plate, sink, 295.15, current)
        found.append(current[0])
        plant.step({"m1": current[0]})
    np.testing.assert_allclose(found, expected.current[:, 0], atol=1e-9)
    assert max(found) > 0.3


@pytest.mark.parametrize("name", NAMES)
def test_matlab_and_json_have_the_test_vector_of_c(folder, name):
    told, kept = json.loads((folder / f"{name}.json").read_text())["test_vector"], loadmat(folder / f"{name}.mat")
    rows = np.array(told["rows"])
    assert rows.shape[1] == len(told["columns"]) > told["inputs"] and len(rows) == 64
    np.testing.assert_array_equal(kept["test_vector"]["rows"][0, 0], rows)
    source = (folder / f"{name}.c").read_text()
    assert all(float(value).hex() in source for value in rows[5][:3])


@pytest.mark.parametrize("file", ["design.json", "controller.json"])
def test_the_controller_is_read_back(done, folder, file):
    loaded = rt.design.load_controller(folder / file)
    runs = [rt.design.simulate_loop(machine(), one, 288.15, law=done.law, duration=400.0, regulate={"m1": "T_plate"})
            for one in (done.controller, loaded)]
    np.testing.assert_allclose(runs[1].current, runs[0].current, atol=1e-12)


def changed(content: dict, *way: str) -> None:
    """Add a hundredth of a number, found by its keys."""
    for key in way[:-1]:
        content = content[key]
    content[way[-1]] = content[way[-1]] * 1.01


DAMAGE = {
    "a gain": ("design.json", lambda c: changed(c, "controller", "modules", "m1", "proportional", "value"),
               "not those that were written"),
    "the sample time": ("design.json", lambda c: changed(c, "sample_time", "value"), "not those that were written"),
    "a negative gain": ("design.json", lambda c: c["controller"]["modules"]["m1"]["integral"].update(value=-1.0), "-1"),
    "a gain of text": ("design.json", lambda c: c["controller"]["modules"]["m1"]["integral"].update(value="x"),
                       "finite numbers"),
    "no modules": ("design.json", lambda c: c["controller"].update(modules={}), "not a complete controller"),
    "no table": ("design.json", lambda c: c.update(controller=3), "not a complete controller"),
    "another format": ("design.json", lambda c: c.update(format="robthermal-design/9"), "is not a controller"),
    "an entry of a matrix": ("controller.json", lambda c: c["heat"][0].__setitem__(1, 0.123),
                             "not those that were written"),
    "a row": ("controller.json", lambda c: c.update(advance=c["advance"][:-1]), "not a complete controller"),
}


@pytest.mark.parametrize("what", DAMAGE)
def test_damaged_files_are_refused(folder, tmp_path, what):
    file, damage, words = DAMAGE[what]
    content = json.loads((folder / file).read_text())
    damage(content)
    (tmp_path / file).write_text(json.dumps(content))
    with pytest.raises(rt.InputError, match=words) as refused:
        rt.design.load_controller(tmp_path / file)
    assert file in str(refused.value)


@pytest.mark.parametrize("file", ["design.json", "controller.json"])
def test_cut_files_are_refused(folder, tmp_path, file):
    text = Path(folder / file).read_text()
    (tmp_path / file).write_text(text[: len(text) // 2])
    with pytest.raises(rt.InputError, match="is not JSON"):
        rt.design.load_controller(tmp_path / file)
