"""Files of frequency responses that somebody or something has damaged: rejected with a message, nothing else."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import io

import robthermal as rt


@pytest.fixture(scope="module")
def content(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    rng = np.random.default_rng(0)
    record = rt.Record(sample_time=1.0, inputs=rng.normal(size=200), outputs=rng.normal(size=200), input_names=["u"],
                       output_names=["y"])
    path = tmp_path_factory.mktemp("response") / "G.json"
    rt.identify.lpm(record).save(path)
    return json.loads(path.read_text(encoding="utf-8"))


def refused(text: str, path: Path) -> None:
    path.write_text(text, encoding="utf-8")
    with pytest.raises(rt.InputError, match=path.name):
        rt.identify.FrequencyResponse.load(path)


NONE = ["x", None, [], {}, -3, True, "1" * 5000, float("nan"), float("inf"), 10**400]


@pytest.mark.parametrize(("key", "value"), [
    *((key, value) for key in ("sample_time", "n_samples", "half_width") for value in NONE),
    ("sample_time", 0), ("n_samples", 0), ("n_samples", 1.5), ("half_width", 1.5)])
def test_numbers_that_are_none(content: dict[str, Any], key: str, value: Any, tmp_path: Path) -> None:
    refused(json.dumps({**content, key: value}), tmp_path / "G.json")


@pytest.mark.parametrize("value", ["y", None, 7, {}, [1], [[]], ["y", "z"]])
@pytest.mark.parametrize("key", ["input_names", "output_names"])
def test_names_that_are_none(content: dict[str, Any], key: str, value: Any, tmp_path: Path) -> None:
    refused(json.dumps({**content, key: value}), tmp_path / "G.json")


NOTHING = [1, "x", [], {}, [None], ["a"], [10**400], [2**70], [[1, 2], [3]]]


@pytest.mark.parametrize(("part", "value"), [
    *(("shape", value) for value in NOTHING), *(("values", value) for value in [*NOTHING, None, [-1]])])
def test_arrays_that_are_none(content: dict[str, Any], part: str, value: Any, tmp_path: Path) -> None:
    refused(json.dumps({**content, "frequencies": {**content["frequencies"], part: value}}), tmp_path / "G.json")
    if part == "values":
        refused(json.dumps({**content, "response": {**content["response"], "imag": value}}), tmp_path / "G.json")


@pytest.mark.parametrize("text", ["[1]", "null", "{", "[" * 100_000, '{"a":' * 100_000])
def test_other_documents(text: str, tmp_path: Path) -> None:
    refused(text, tmp_path / "G.json")


def test_what_is_not_damaged_still_loads(content: dict[str, Any], tmp_path: Path) -> None:
    path = tmp_path / "G.json"
    path.write_text(json.dumps(content), encoding="utf-8")
    for suffix in (".json", ".npz", ".mat"):
        G = rt.identify.FrequencyResponse.load(path)
        G.save(tmp_path / f"again{suffix}")
        again = rt.identify.FrequencyResponse.load(tmp_path / f"again{suffix}")
        np.testing.assert_array_equal(again.response, G.response)
        assert (again.sample_time, again.half_width, again.input_names) == (G.sample_time, G.half_width, G.input_names)


def test_large_files_are_refused_also_when_they_are_large_only_unpacked(
        content: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    zeros = tmp_path / "zeros.npz"
    np.savez_compressed(zeros, response=np.zeros(100_000))
    assert zeros.stat().st_size < 10_000
    text = tmp_path / "G.json"
    text.write_text(json.dumps(content), encoding="utf-8")
    monkeypatch.setattr("robthermal.identify._response_files._LARGEST", 10_000)
    for path in (zeros, text):
        with pytest.raises(rt.InputError, match="MB large"):
            rt.identify.FrequencyResponse.load(path)


def test_a_damaged_index_of_an_archive(content: dict[str, Any], tmp_path: Path) -> None:
    path, archive = tmp_path / "G.json", tmp_path / "G.npz"
    path.write_text(json.dumps(content), encoding="utf-8")
    rt.identify.FrequencyResponse.load(path).save(archive)
    stored = bytearray(archive.read_bytes())
    place = stored.rindex(b"PK\x01\x02")  # head of the last entry of the central directory
    stored[place:place + 4] = b"XXXX"
    archive.write_bytes(stored)
    with pytest.raises(rt.InputError, match=r"G\.npz.*cannot be read"):
        rt.identify.FrequencyResponse.load(archive)


@pytest.mark.exhaustive
def test_ten_thousand_damaged_matlab_files_never_crash(content: dict[str, Any], tmp_path: Path) -> None:
    """Bytes overwritten, cut off or doubled: loaded if it still can be, rejected with a message otherwise."""
    path, mat = tmp_path / "G.json", tmp_path / "G.mat"
    path.write_text(json.dumps(content), encoding="utf-8")
    rt.identify.FrequencyResponse.load(path).save(mat)
    stored = mat.read_bytes()
    rng = np.random.default_rng(4)
    refusals = 0
    for _ in range(10_000):
        damaged = bytearray(stored)
        for _ in range(rng.integers(1, 5)):
            place = int(rng.integers(len(damaged)))
            damaged[place] = int(rng.integers(256))
        cut = int(rng.integers(len(damaged)))
        kind = rng.integers(10)
        damaged = damaged[:cut] if kind == 0 else damaged[:cut] + damaged[cut // 2:] if kind == 1 else damaged
        mat.write_bytes(damaged)
        try:
            rt.identify.FrequencyResponse.load(mat)
        except rt.InputError as error:
            refusals += 1
            assert "G.mat" in str(error) or "argument" in str(error)
    assert refusals > 1000


def test_matlab_files_of_another_kind(tmp_path: Path) -> None:
    path = tmp_path / "G.mat"
    path.write_bytes(b"MATLAB 7.3 MAT-file" + bytes(600))
    with pytest.raises(rt.InputError, match="-v7"):
        rt.identify.FrequencyResponse.load(path)
    io.savemat(path, {"format": "robthermal frequency response 1", "response": "text"})
    with pytest.raises(rt.InputError, match="response is a char"):
        rt.identify.FrequencyResponse.load(path)


def test_names_of_any_letters_survive_matlab(content: dict[str, Any], tmp_path: Path) -> None:
    path = tmp_path / "G.json"
    path.write_text(json.dumps({**content, "output_names": ["Tµ_größe"], "notes": ["", "α → β"]}), encoding="utf-8")
    G = rt.identify.FrequencyResponse.load(path)
    G.save(tmp_path / "G.mat")
    again = rt.identify.FrequencyResponse.load(tmp_path / "G.mat")
    assert (again.output_names, again.notes) == (G.output_names, G.notes)
