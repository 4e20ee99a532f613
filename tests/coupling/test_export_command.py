"""The key `export` of a coupling file: the same filters for other programs, beside coupling.json."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

import robthermal as rt

LOOP = "plant = { num = [0.01], den = [1.0, -0.99] }\ncontroller = 20.0\n"


def written(folder: Path, head: str, dt: str = "0.01") -> Path:
    """A coupling file."""
    path = folder / "SPEC.toml"
    path.write_text(f'[coupling]\nname = "pair"\nsample_time = {dt}\n{head}[subsystems.1]\n{LOOP}[subsystems.2]\n{LOOP}'
                    "[design]\nX_hat = -0.9\n")
    return path


def test_files_hold_the_filters(tmp_path: Path) -> None:
    done = rt.jobs.couple_subsystems(rt.jobs.read_coupling(written(tmp_path, 'export = ["mat", "c", "mat"]\n')))
    rt.jobs.write_coupling(done, tmp_path / "out")
    assert {path.name for path in (tmp_path / "out").glob("coupling.*")} == {"coupling.json", "coupling.mat",
                                                                             "coupling.c"}
    done.filters.export(tmp_path / "own.c", "pair")
    assert (tmp_path / "out" / "coupling.c").read_text() == (tmp_path / "own.c").read_text()
    text = json.loads((tmp_path / "out" / "coupling.json").read_text())
    mat = loadmat(tmp_path / "out" / "coupling.mat", simplify_cells=True)
    assert mat["X"]["D"] == np.squeeze(text["filters"]["X"]["D"])


def test_nothing_more_is_written_unless_asked(tmp_path: Path) -> None:
    done = rt.jobs.couple_subsystems(rt.jobs.read_coupling(written(tmp_path, "")))
    rt.jobs.write_coupling(done, tmp_path / "out")
    assert [path.name for path in (tmp_path / "out").glob("coupling.*")] == ["coupling.json"]


@pytest.mark.parametrize(("head", "dt", "message"), [
    ('export = ["pdf"]\n', "0.01", "export"), ('export = "c"\n', "0.01", "export"),
    ('export = ["c"]\n', "0", r"\[coupling\] export.*no C source")])
def test_refused_before_the_design(head: str, dt: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(rt.InputError, match=message):
        rt.jobs.read_coupling(written(tmp_path, head, dt).rename(tmp_path / "S.toml"))
