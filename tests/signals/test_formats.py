"""Parquet, MATLAB and TDMS: round trips, and what they refuse. Saving."""

from __future__ import annotations

import struct
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

import robthermal as rt
from robthermal import InputError, Record

N = 12
TIME = 3.0 + 0.5 * np.arange(N)
U = np.linspace(0.0, 1.0, N) ** 2 / 3
T = 300.0 + np.sin(TIME) / 7


def record() -> Record:
    return Record(
        sample_time=0.5, inputs=U, outputs=T, input_names=["u"], output_names=["T"], start_time=3.0, units={"T": "K"}
    )


def read(path: Path, **options: Any) -> Record:
    return rt.read_record(path, inputs=["u"], outputs=["T"], **options)


def check(again: Record) -> None:
    np.testing.assert_array_equal(again["u"], U)
    np.testing.assert_array_equal(again["T"], T)
    assert (again.sample_time, again.start_time) == (0.5, 3.0)


def optional(suffix: str) -> None:
    if suffix == ".parquet":
        pytest.importorskip("pyarrow", reason="optional extra robthermal[parquet]")


@pytest.mark.usefixtures("quiet")
@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".mat", ".CSV"])
def test_save_and_read_back_exactly(tmp_path: Path, suffix: str) -> None:
    optional(suffix)
    path = tmp_path / f"run{suffix}"
    record().save(path)
    check(read(path))
    record().save(path, temperature_unit="degC")
    check(read(path, temperature_unit="degC"))
    assert [item.name for item in tmp_path.iterdir()] == [path.name]


def test_save_names_temperatures(tmp_path: Path) -> None:
    bare = Record(sample_time=1.0, inputs=U, outputs=T, input_names=["u"], output_names=["T"])
    bare.save(tmp_path / "a.csv", temperature_unit="degC", temperatures=["T"])
    text = (tmp_path / "a.csv").read_text().splitlines()
    assert text[0] == "time,u,T"
    assert float(text[1].split(",")[2]) == pytest.approx(T[0] - 273.15, abs=1e-13)


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("a.xlsx", {}, "ends in '.xlsx'.*one of .csv, .parquet, .mat"),
        ("a.csv", {"temperature_unit": "C"}, "temperature_unit is 'C'"),
        ("a.csv", {"temperature_unit": "degC", "temperatures": []}, "no channel is known to be a temperature"),
        ("a.csv", {"temperatures": ["t"]}, "no channel 't'. Did you mean 'T'"),
        ("none/a.csv", {}, "cannot be written"),
    ],
)
def test_save_refuses(tmp_path: Path, name: str, options: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        record().save(tmp_path / name, **options)
    assert not list(tmp_path.iterdir())


def test_save_refuses_names_that_would_not_come_back(tmp_path: Path) -> None:
    for name, file, message in [
        ("a,b", "a.csv", "CSV header"),
        ("a b", "a.mat", "MATLAB"),
        ("time", "a.csv", "'time'"),
    ]:
        strange = Record(sample_time=1.0, inputs=U, outputs=T, input_names=["u"], output_names=[name])
        with pytest.raises(InputError, match=message):
            strange.save(tmp_path / file)
    assert not list(tmp_path.iterdir())


# Parquet


def test_parquet_refuses(tmp_path: Path) -> None:
    pa = pytest.importorskip("pyarrow", reason="optional extra robthermal[parquet]")
    pq = pytest.importorskip("pyarrow.parquet")
    path = tmp_path / "run.parquet"

    def refused(columns: dict[str, Any], message: str, **options: Any) -> None:
        pq.write_table(pa.table(columns), path)
        with pytest.raises(InputError, match=message):
            read(path, **options)

    refused({"time": TIME, "u": U, "T": [None, *T[1:]]}, "row 0, column 'T': nothing was measured", gaps="refuse")
    refused({"time": TIME, "u": U, "T": ["x"] * N}, "'x' is not a number")
    refused({"time": TIME, "u": U > 0.1, "T": T}, "is not a number")
    refused({"time": TIME, "u": U, "T": np.where(TIME == 4.0, np.nan, T)}, "falls into 2 parts")
    refused({"u": U, "T": T}, "no column 'time'")
    refused({"time": [], "u": [], "T": []}, "no rows")
    refused({"time": [0.0] * 10**5, "u": [0.0] * 10**5, "T": [0.0] * 10**5}, "bytes unpacked", max_bytes=10**5)
    path.write_bytes(b"PAR1 junk")
    with pytest.raises(InputError, match="no Parquet file"):
        read(path)


@pytest.mark.parametrize(
    ("suffix", "module", "extra"), [(".parquet", "pyarrow", "parquet"), (".tdms", "nptdms", "tdms")]
)
def test_missing_extras_are_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str, module: str, extra: str
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    path = tmp_path / f"run{suffix}"
    path.write_bytes(b"x")
    with pytest.raises(InputError, match=rf"{module}|npTDMS.*robthermal\[{extra}\]"):
        read(path)


# MATLAB


@pytest.mark.parametrize("version", ["4", "5"])
@pytest.mark.parametrize("oned_as", ["row", "column"])
def test_matlab_vectors(tmp_path: Path, version: str, oned_as: str) -> None:
    path = tmp_path / "run.mat"
    savemat(path, {"Time": TIME, "u": U, "T": T, "remark": "x"}, format=version, oned_as=oned_as)
    check(read(path))


def test_matlab_struct(tmp_path: Path) -> None:
    path = tmp_path / "run.mat"
    savemat(path, {"log": {"time": TIME[:, None], "u": U[:, None], "T": T[:, None]}, "gain": 3.0}, do_compression=True)
    check(read(path))


def test_matlab_refuses(tmp_path: Path) -> None:
    path = tmp_path / "run.mat"

    def refused(content: dict[str, Any], message: str, **options: Any) -> None:
        savemat(path, content)
        with pytest.raises(InputError, match=message):
            read(path, **options)

    refused({"time": TIME, "u": U, "T": "text"}, "'T' is a char")
    refused({"time": TIME, "u": U, "T": np.array([1, "a"], dtype=object)}, "'T' is a cell")
    refused({"time": TIME, "u": U, "T": {"a": 1.0}}, "'T' is a struct")
    refused({"time": TIME, "u": U, "T": T + 1j}, "'T' is a complex matrix")
    refused({"time": TIME, "u": U, "T": np.ones((N, 2))}, r"column 'T' is a matrix")
    refused({"time": TIME, "u": U, "T": T[1:]}, "of length 11, the time of length 12")
    refused({"time": TIME, "u": U, "T": np.append(np.nan, T[1:])}, "row 0, column .T.: nothing was", gaps="refuse")
    refused({"log": {"time": TIME, "u": U, "T": {"deep": T}}}, "'T' is a struct")
    refused({"u": U, "T": T}, "no column 'time'")
    path.write_bytes(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(512) + b"\x89HDF\r\n\x1a\n" + b"\0" * 100)
    with pytest.raises(InputError, match=r"MATLAB format 7.3.*'-v7'"):
        read(path)
    savemat(path, {"time": TIME, "u": U, "T": T}, do_compression=True)
    whole = path.read_bytes()
    for cut in (3, 130, 200, len(whole) - 9):
        path.write_bytes(whole[:cut])
        with pytest.raises(InputError):
            read(path)
    path.write_bytes(b"junk" * 100)
    with pytest.raises(InputError, match="no MATLAB file"):
        read(path)


@pytest.mark.parametrize("kind", ["int8", "uint16", "int32", "uint64", "float32"])
def test_matlab_number_types_against_numpy(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "run.mat"
    whole = np.arange(N, dtype=kind)
    savemat(path, {"time": TIME, "u": whole, "T": T, "on": U > 0.1}, do_compression=kind == "int8")
    np.testing.assert_array_equal(read(path)["u"], whole.astype(float))


@pytest.mark.parametrize("suffix", [".csv", ".mat", ".struct.mat", ".v4.mat", ".parquet", ".tdms"])
def test_damaged_files_are_read_or_refused(tmp_path: Path, suffix: str) -> None:
    optional(suffix)
    path = tmp_path / f"run{suffix}"
    columns = {"time": TIME, "u": U, "T": T}
    if suffix == ".tdms":
        write_tdms(path, [("a", name, column, {}) for name, column in columns.items()])
    elif suffix.endswith(".mat"):
        savemat(path, {"log": columns} if "struct" in suffix else columns, format="4" if "v4" in suffix else "5")
    else:
        record().save(path)
    sound, rng = path.read_bytes(), np.random.default_rng(8)
    refused = 0
    for trial in range(100):
        damaged = bytearray(sound[: rng.integers(1, len(sound))] if trial % 4 == 0 else sound)
        damaged[rng.integers(len(damaged))] = rng.integers(256)
        path.write_bytes(bytes(damaged))
        refused += is_refused(path)
    assert refused > 20


def is_refused(path: Path) -> bool:
    """Whether a damaged file is refused; one that is read holds numbers."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            assert np.isfinite(read(path)["T"]).all()
        except InputError:
            return True
    return False


def test_a_small_matlab_file_with_a_large_matrix_is_not_unpacked(tmp_path: Path) -> None:
    path = tmp_path / "run.mat"
    savemat(path, {"time": np.zeros(200_000), "u": np.zeros(200_000), "T": np.zeros(200_000)}, do_compression=True)
    assert path.stat().st_size < 100_000
    with pytest.raises(InputError, match="bytes unpacked.*max_bytes"):
        read(path, max_bytes=100_000)


# TDMS


def write_tdms(path: Path, channels: list[tuple[str, str, Any, dict[str, Any]]]) -> None:
    nptdms = pytest.importorskip("nptdms", reason="optional extra robthermal[tdms]")
    with nptdms.TdmsWriter(path) as file:
        file.write_segment([nptdms.ChannelObject(*channel) for channel in channels])


@pytest.mark.exhaustive
def test_no_byte_of_the_head_of_a_tdms_file_ends_in_a_traceback(tmp_path: Path) -> None:
    path = tmp_path / "run.tdms"
    write_tdms(path, [("a", name, column, {}) for name, column in {"time": TIME, "u": U, "T": T}.items()])
    sound = path.read_bytes()
    head = len(sound) - 8 * (len(TIME) + len(U) + len(T))
    refused = 0
    for place in range(head):
        for value in (0, 128, 255):
            path.write_bytes(sound[:place] + bytes([value]) + sound[place + 1:])
            refused += is_refused(path)
    assert refused > head


def test_tdms_with_a_time_channel(tmp_path: Path) -> None:
    path = tmp_path / "run.tdms"
    write_tdms(path, [("a", "Time [s]", TIME, {}), ("b", "u", U, {}), ("b", "T [K]", T, {})])
    check(read(path))


def test_tdms_with_waveform_increment(tmp_path: Path) -> None:
    path = tmp_path / "run.tdms"
    clock = {"wf_increment": 0.5, "wf_start_offset": 3.0}
    write_tdms(path, [("a", "u", U, clock), ("a", "T", T, clock), ("a", "other", U[:3], {})])
    check(read(path))


@pytest.mark.parametrize("clock", [{"wf_increment": "fast"}, {"wf_increment": np.nan}, {"wf_increment": np.inf},
                                   {"wf_increment": 0.5, "wf_start_offset": "noon"}])
def test_tdms_with_a_clock_that_is_no_number(clock: dict[str, Any], tmp_path: Path) -> None:
    path = tmp_path / "run.tdms"
    write_tdms(path, [("a", "u", U, clock), ("a", "T", T, clock)])
    with pytest.raises(InputError, match="channel 'u': wf_.* is .*a finite number"):
        rt.read_record(path, inputs=["u"], outputs=["T"])


def test_tdms_refuses(tmp_path: Path) -> None:
    path = tmp_path / "run.tdms"

    def refused(channels: list[tuple[str, str, Any, dict[str, Any]]], message: str, **options: Any) -> None:
        write_tdms(path, channels)
        with pytest.raises(InputError, match=message):
            read(path, **options)

    refused([("a", "u", U, {}), ("a", "T", T, {})], "neither a channel 'time' nor the property wf_increment")
    refused([("a", "u", U, {"wf_increment": 0.5}), ("a", "T", T, {"wf_increment": 1.0})], "different increments")
    refused([("a", "time", TIME, {}), ("a", "u", U, {}), ("b", "T", T, {}), ("c", "T", T, {})], "'T' stands in several")
    refused([("a", "time", TIME, {}), ("a", "u", U, {}), ("a", "T", T[1:], {})], "of length 11, the time of length 12")
    refused([("a", "time", TIME, {}), ("a", "u", U, {}), ("a", "T", ["x"] * N, {})], "column 'T' is text")
    path.write_bytes(b"TDSm junk that is none" * 10)
    with pytest.raises(InputError, match="no TDMS file"):
        read(path)


@pytest.mark.parametrize("step", ["read_metadata", "open"])
@pytest.mark.parametrize(("error", "message"), [
    (NotImplementedError("ExtendedFloat"), r"npTDMS does not read this kind of data \(ExtendedFloat\).* Export"),
    (PermissionError("denied"), r"the file cannot be read \(denied\)"),
    (KeyError("T"), "this is no TDMS file that npTDMS reads: .* damaged, or holds a kind of data .* Export")])
def test_only_damage_of_a_tdms_file_is_called_damage(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: str,
                                                     error: Exception, message: str) -> None:
    """Of its list of channels, or of the channels themselves; without the error the same file is read."""
    nptdms = pytest.importorskip("nptdms", reason="optional extra robthermal[tdms]")
    path = tmp_path / "run.tdms"
    write_tdms(path, [("a", "Time [s]", TIME, {}), ("b", "u", U, {}), ("b", "T [K]", T, {})])
    check(read(path))

    def refuse(*args: object) -> None:
        raise error

    monkeypatch.setattr(nptdms.TdmsFile, step, refuse)
    with pytest.raises(InputError, match=message):
        read(path)


@pytest.mark.parametrize(("kind", "said"), [(11, "ExtendedFloat"), (0x4F, "Unrecognised data type")])
def test_a_kind_of_data_that_the_library_lacks_is_not_called_damage_alone(tmp_path: Path, kind: int, said: str) -> None:
    """The last channel of a sound file is said to hold numbers of 80 bits, or of fixed point."""
    path = tmp_path / "run.tdms"
    write_tdms(path, [("a", "time", TIME, {}), ("a", "u", U, {}), ("a", "T", T, {})])
    raw, described = path.read_bytes(), struct.pack("<LLLQ", 20, 10, 1, N)  # index of 20 bytes, doubles, one dimension
    at = raw.rindex(described)
    path.write_bytes(raw[:at] + struct.pack("<LLLQ", 20, kind, 1, N) + raw[at + len(described):])
    with pytest.raises(InputError, match=f"damaged, or holds a kind of data that npTDMS lacks .*{said}.* Export"):
        read(path)


def test_a_property_of_a_kind_that_the_library_lacks(tmp_path: Path) -> None:
    path = tmp_path / "run.tdms"
    write_tdms(path, [("a", "u", U, {"wf_increment": 0.5}), ("a", "T", T, {"wf_increment": 0.5})])
    raw, double = path.read_bytes(), b"wf_increment" + struct.pack("<L", 10)
    path.write_bytes(raw.replace(double, b"wf_increment" + struct.pack("<L", 11)))
    with pytest.raises(InputError, match="npTDMS does not read this kind of data .*ExtendedFloat.* Export"):
        read(path)


@pytest.mark.parametrize("suffix", [".csv", ".mat", ".parquet", ".tdms"])
def test_no_format_runs_a_pickle(tmp_path: Path, suffix: str) -> None:
    optional(suffix)
    if suffix == ".tdms":
        pytest.importorskip("nptdms", reason="optional extra robthermal[tdms]")
    path = tmp_path / f"run{suffix}"
    path.write_bytes(b"\x80\x04cos\nsystem\n(S'echo pickled > " + str(tmp_path / "seen").encode() + b"'\ntR.")
    with pytest.raises(InputError):
        read(path)
    assert not (tmp_path / "seen").exists()
