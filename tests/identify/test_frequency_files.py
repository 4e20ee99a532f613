"""One reader of frequency-response files: told by content, with covariance; a wrong file is one short line."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from scipy import io

import robthermal as rt
from robthermal.identify import FrequencyResponse, is_response, read_response

LONGEST = 600  # characters of a message
QUOTED = 120  # characters of the user's file in it


@pytest.fixture(scope="module")
def estimate() -> FrequencyResponse:
    rng = np.random.default_rng(0)
    u = rng.normal(size=(300, 2))
    y = u @ [[1.0, 0.2], [0.1, 2.0]] + 0.1 * rng.normal(size=(300, 2))
    record = rt.Record(sample_time=0.5, inputs=u, outputs=y,
                       input_names=["q1", "q2"], output_names=["T1", "T2"])
    return rt.identify.lpm(record)


@pytest.mark.parametrize("kind", ["json", "npz", "mat"])
@pytest.mark.parametrize("suffix", ["json", "npz", "mat", "dat", "csv"])
def test_the_content_tells_the_format_not_the_ending(estimate: FrequencyResponse, kind: str, suffix: str,
                                                     tmp_path: Path) -> None:
    estimate.save(tmp_path / f"G.{kind}")
    path = shutil.copy(tmp_path / f"G.{kind}", tmp_path / f"copied.{suffix}")
    assert is_response(path)
    found = read_response(path)
    for name in ("frequencies", "response", "covariance", "noise_covariance", "degrees_of_freedom"):
        np.testing.assert_array_equal(getattr(found, name), getattr(estimate, name), err_msg=name)
    assert found.has_covariance and found.sample_time == 0.5 and found.input_names == ("q1", "q2")
    assert found.operating_point == estimate.operating_point and set(found.operating_point) == {"q1", "q2"}


@pytest.mark.parametrize("kind", ["json", "npz", "mat"])
@pytest.mark.parametrize("means", [{}, {"q1": 5.0}, {"q1": 5.0, "room °C": 295.5, "m2": -0.25}])
def test_notes_and_operating_point_come_back(estimate: FrequencyResponse, kind: str, means: dict[str, float],
                                             tmp_path: Path) -> None:
    notes = ("One.", "Left out because they never change: room (constant_input).")[:len(means)]
    estimate.replace(operating_point=means, notes=notes).save(tmp_path / f"G.{kind}")
    found = read_response(tmp_path / f"G.{kind}")
    assert found.operating_point == means and found.notes == notes
    assert [one.code for one in found.remarks] == ["constant_input"][:max(len(means) - 1, 0)]


def test_a_file_of_an_earlier_version_has_no_operating_point(estimate: FrequencyResponse, tmp_path: Path) -> None:
    estimate.save(tmp_path / "G.json")
    content = json.loads((tmp_path / "G.json").read_text(encoding="utf-8"))
    damaged = {**content, "operating_point_names": ["q1"]}
    for name in ("operating_point_names", "operating_point_values"):
        del content[name]
    (tmp_path / "old.json").write_text(json.dumps(content), encoding="utf-8")
    (tmp_path / "damaged.json").write_text(json.dumps(damaged), encoding="utf-8")
    assert read_response(tmp_path / "old.json").operating_point == {}
    with pytest.raises(rt.InputError, match="operating point has 1 names"):
        read_response(tmp_path / "damaged.json")


def test_the_operating_point_is_the_mean_over_all_records(estimate: FrequencyResponse) -> None:
    def run(n: int, seed: int) -> rt.Record:
        u = 3.0 + np.random.default_rng(seed).normal(size=n)
        return rt.Record(sample_time=1.0, inputs=u, outputs=2 * u, input_names=["q"], output_names=["T"])

    records = [run(200, 0), run(400, 1)]
    mean = float(np.concatenate([r["q"] for r in records]).mean())
    G = rt.identify.lpm(records)
    assert G.operating_point == {"q": pytest.approx(mean)} == G.between(0.01, 0.1).operating_point


def table(size: int) -> str:
    numbers = "real,imag" if size == 1 else "re11,im11,re12,im12,re21,im21,re22,im22"
    rows = [",".join(str(value) for value in [f, *np.arange(2 * size**2) + 10 * f]) for f in (2.0, 1.0)]
    return "\n".join(["# measured at night", f"frequency [Hz],{numbers}", *rows])


@pytest.mark.parametrize("size", [1, 2])
def test_csv_has_no_covariance_and_says_so(size: int, tmp_path: Path) -> None:
    (tmp_path / "G.csv").write_text(table(size), encoding="utf-8")
    assert is_response(tmp_path / "G.csv")
    G = read_response(tmp_path / "G.csv", sample_time=0.1)
    assert G.response.shape == (size, size, 2) and not G.has_covariance and G.sample_time == 0.1
    np.testing.assert_array_equal(G.frequencies, [1.0, 2.0])  # sorted
    first = 10.0 + 2 * np.arange(size**2)
    np.testing.assert_array_equal(G.response[..., 0].ravel(), first + 1j * (first + 1))
    assert G.outcome.code == "frf_without_covariance" and "covariance" in G.outcome.text and not G.outcome.ok
    assert np.isinf(G.confidence_radius()).all()
    with pytest.raises(rt.InputError, match="no covariance"):
        G.save(tmp_path / "G.json")


def test_records_are_no_responses(tmp_path: Path) -> None:
    record = rt.Record(sample_time=1.0, inputs=np.ones((20, 1)), outputs=np.full((20, 1), 300.0), input_names=["q"],
                       output_names=["T"])
    for ending in ("csv", "mat", "parquet"):
        record.save(tmp_path / f"run.{ending}")
        assert not is_response(tmp_path / f"run.{ending}")
    assert not is_response(tmp_path / "absent.csv")
    with pytest.raises(rt.InputError, match=r"run\.csv.*frequency"):
        read_response(tmp_path / "run.csv")


HUGE = "x" * 3_000_000
WRONG = {
    "one line of JSON": json.dumps({"format": "robthermal-certificate/1", "data": [0.5] * 500_000}),
    "a long format": json.dumps({"format": HUGE}),
    "a long name": json.dumps({HUGE: 1}),
    "a long text": json.dumps(HUGE),
    "a number that is none": json.dumps({"format": "robthermal frequency response 1", "frequencies":
                                         {"shape": [1], "values": [HUGE]}}),
    "a shape that is none": json.dumps({"format": "robthermal frequency response 1", "frequencies":
                                        {"shape": HUGE, "values": [1.0]}}),
    "names that are none": json.dumps({"format": "robthermal frequency response 1", "frequencies": {}, HUGE: 1}),
    "damaged JSON": '{"a": [' + "1, " * 1_000_000,
    "one long line": HUGE,
    "many columns": ",".join(["column"] * 300_000),
    "a long cell": f"frequency,real,imag\n1,2,{HUGE}\n2,1,1\n",
    "many cells": "frequency,real,imag\n" + "1," * 500_000,
    "a long unit": f"frequency [{HUGE}],real,imag\n1,2,3\n",
    "lines in cells": "frequency,real,imag\r\n1,2,'a\x85\u2028b\x0b'\n",
    "nothing": "",
    "blank": "\n \n",
}


@pytest.mark.parametrize("kind", WRONG)
@pytest.mark.parametrize("ending", ["json", "csv"])
def test_a_wrong_file_is_one_short_line(kind: str, ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"wrong.{ending}"
    path.write_text(WRONG[kind], encoding="utf-8")
    with pytest.raises(rt.InputError) as caught:
        read_response(path)
    message = str(caught.value)
    assert f"wrong.{ending}" in message
    assert len(message.splitlines()) == 1
    assert len(message) - len(str(path)) <= LONGEST - 100  # whatever folder it is in, up to 100 characters
    assert "x" * (QUOTED + 1) not in message and "column, " * 20 not in message


def test_binary_files_are_one_short_line(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    archive = tmp_path / "archive.npz"
    np.savez(archive, **{HUGE[:30_000]: np.zeros(3)})
    io.savemat(tmp_path / "other.mat", {"format": HUGE[:100_000], "a": 1.0})
    (tmp_path / "noise.dat").write_bytes(rng.bytes(1_000_000))
    for path in (archive, tmp_path / "other.mat", tmp_path / "noise.dat"):
        with pytest.raises(rt.InputError) as caught:
            read_response(path)
        assert len(str(caught.value)) - len(str(path)) <= LONGEST - 100 and len(str(caught.value).splitlines()) == 1
