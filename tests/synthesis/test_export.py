"""What a design writes: C that compiles and repeats the loop, files that are read back."""

from __future__ import annotations

import json
import subprocess

import numpy as np
import pytest
from plants import scherer

import robthermal as rt
from robthermal.errors import InputError


def test_folder_of_a_sampled_design(tmp_path):
    d = rt.design.hinf(scherer(), 1, 1, sample_time=0.02)
    d.export(tmp_path / "out", name="stage")
    document = json.loads((tmp_path / "out" / "design.json").read_text())
    assert document["format"] == "robthermal-design/1" and document["value"] == d.value
    assert np.array_equal(document["controller"]["A"], d.controller.A)
    saved = rt.Certificate.load(tmp_path / "out" / "certificates" / "1_hinf.json")
    assert rt.verify(saved).valid and saved.region["bound"] == d.value
    command = ["gcc", "-std=c99", "-Wall", "-Werror", "-ffp-contract=off", "-DCONTROLLER_TEST", "-x", "c",
               str(tmp_path / "out" / "controller.c"), "-lm", "-o", str(tmp_path / "run")]
    subprocess.run(command, check=True)
    done = subprocess.run([tmp_path / "run"], capture_output=True, text=True, check=True)
    assert float(done.stdout) == 0.0


def test_continuous_controllers_have_no_c_source(tmp_path):
    d = rt.design.hinf(scherer(), 1, 1)
    with pytest.raises(InputError, match="sample_time"):
        d.export(tmp_path / "controller.c")
    d.export(tmp_path / "design.json")
    assert json.loads((tmp_path / "design.json").read_text())["controller"]["sample_time"] == 0.0
    d.export(tmp_path / "out")
    assert not (tmp_path / "out" / "controller.c").exists()
