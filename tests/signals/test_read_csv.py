"""CSV files: every legal spelling gives the same record; every fault is named with its place."""

from __future__ import annotations

import tracemalloc
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import robthermal as rt
from robthermal import InputError, Record

Write = Callable[..., Path]
PLAIN = "time,u,T\n0,1,300\n1,2,301\n2,3,302.5\n"


def read(path: Path, **options: object) -> Record:
    return rt.read_record(path, inputs=["u"], outputs=["T"], **options)  # type: ignore[arg-type]


@pytest.mark.usefixtures("quiet")
@pytest.mark.parametrize(
    "text",
    [
        PLAIN,
        PLAIN.rstrip("\n"),
        PLAIN.replace(",", ";"),
        PLAIN.replace(",", "\t"),
        PLAIN.replace("\n", "\r\n"),
        PLAIN.replace("\n", "\r"),
        PLAIN.replace("\n", "\r\r\n"),
        "\ufeff" + PLAIN,
        PLAIN.replace("time", "TIME"),
        PLAIN.replace("time", "Time [s]").replace("u,", " u [W] ,"),
        PLAIN.replace(",", " , "),
        "# bench 3; run 7, again\n\n" + PLAIN.replace("1,2", "  # pause\n\n1,2") + "# end",
        PLAIN.replace("time,u,T", '"time","u","T"').replace("300", '"300"'),
        PLAIN.replace("2,3,302.5", "2.0,+3e0,3025E-1"),
        'T,time,remark,u\n300,0,a b,1\n301,1,"x, y",2\n302.5,2,# odd,3\n',
    ],
)
def test_legal_spellings_give_one_record(write: Write, text: str) -> None:
    record = read(write(text))
    np.testing.assert_array_equal(record["u"], [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(record["T"], [300.0, 301.0, 302.5])
    assert (record.sample_time, record.start_time, record.name) == (1.0, 0.0, "run.csv")


def test_umlauts_in_utf8_are_welcome(write: Write) -> None:
    record = rt.read_record(write("time,Öl [°C]\n0,20\n1,21\n"), outputs=["Öl"], temperature_unit="degC")
    np.testing.assert_array_equal(record["Öl"], [293.15, 294.15])


FAULTS = {
    "empty": ("", "the file is empty"),
    "blank": ("\n\n  \n", "no header row"),
    "comments only": ("# a\n# b\n", "no header row"),
    "header only": ("time,u,T\n# nothing yet\n", "a header and no data rows"),
    "one row": ("time,u,T\n0,1,300\n", "1 data row"),
    "no header": ("0,1,300\n1,2,301\n", "line 1: the first row holds numbers.*header row"),
    "nul bytes": (b"time,u,T\n0,1,\x00\x01\n", "binary.*NUL"),
    "binary junk": (bytes(range(255, 128, -1)) * 40 + b"\n", "no UTF-8"),
    "latin-1": ("time,u,T\n0,1,300\n# 20 °C\n".encode("latin-1"), r"line 3\) is no UTF-8.*Save it as UTF-8"),
    "utf-16": (PLAIN.encode("utf-16"), "binary"),
    "no time": ("t,u,T\n0,1,300\n1,1,300\n", "no column 'time'.*Columns in the file: t, u, T"),
    "two times": ("time,Time,u,T\n0,0,1,300\n1,1,1,300\n", "2 time columns"),
    "time in ms": ("time [ms],u,T\n0,1,300\n1,1,300\n", r"'time \[ms\]' is in ms.*seconds"),
    "column twice": ("time,u,u,T\n0,1,1,300\n1,1,1,300\n", "'u' stands twice"),
    "same name, two units": ("time,u,T [K],T [C]\n0,1,1,300\n1,1,1,300\n", "have the same name"),
    "nameless": ("time,u,T,\n0,1,300,\n1,1,300,\n", "a column has no name.*trailing separator"),
    "no such column": ("time,u,t\n0,1,300\n1,1,300\n", "no column 'T'. Did you mean 't'"),
    "long row": (PLAIN.replace("1,2,301", "1,2,301,7"), "line 3: row 1 has 4 cells and the header has 3"),
    "all rows long": ("time,u,T\n0,1,300,9\n1,1,300,9\n", "line 2: row 0 has 4 cells"),
    "short row": (PLAIN.replace("1,2,301", "# x\n1,2"), "line 4: row 1 has 2 cells"),
    "short row, text column": ("time,a,u,T\n0,x,1,300\n1,y,1\n", "line 3: row 1 has 3 cells"),
    "text": (PLAIN.replace("301", "off"), "line 3: column 'T' holds 'off' in row 1, time 1 s, which is not a number"),
    "text after a comment": ("# c\n" + PLAIN.replace("301", "off"), "line 4: column 'T' holds 'off' in row 1"),
    "hexadecimal": (PLAIN.replace("301", "0x10"), "'0x10'"),
    "underscore": (PLAIN.replace("301", "3_01"), "'3_01'.*not a number"),
    "boolean": (PLAIN.replace("1,2,301", "1,True,301"), "column 'u' holds 'True'"),
    "complex": (PLAIN.replace("301", "1+2j"), r"'1\+2j'"),
    "infinite": (PLAIN.replace("301", "inf"), "'inf' in row 1, time 1 s, which is not finite"),
    "overflow": (PLAIN.replace("301", "1e999"), "'1e999'.*not finite"),
    "nan": (PLAIN.replace("301", "NaN"), r"line 3: column 'T' is NaN \(not a number\) in row 1, time 1 s"),
    "empty cell": (PLAIN.replace("301", ""), "line 3: column 'T' is empty in row 1, time 1 s.*not filled"),
    "empty time": (PLAIN.replace("1,2,301", ",2,301"), "column 'time' is empty in row 1"),
    "decimal comma": (PLAIN.replace(",", ";").replace("302.5", "302,5"), "'302,5'.*decimal comma.*decimal point"),
    "decimal comma and separator": ("time,u,T\n0,0,1,0,300,1\n1,0,1,0,300,1\n", "6 cells.*decimal point"),
    "quote never closed": (PLAIN.replace("2,301", '"2,301'), "line 3: row 1 has 2 cells"),
}


@pytest.mark.parametrize("case", FAULTS)
def test_faults_are_named(write: Write, case: str) -> None:
    content, message = FAULTS[case]
    path = write(content)
    with pytest.raises(InputError, match=message) as caught:
        read(path)
    assert str(path) in str(caught.value)


def test_a_line_of_100_megabytes_is_refused_unread(tmp_path: Path) -> None:
    path = tmp_path / "long.csv"
    with path.open("wb") as file:
        for _ in range(100):
            file.write(b"1," * 500_000)
    tracemalloc.start()
    with pytest.raises(InputError, match="first line is longer than 64 KiB"):
        read(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 2**20


def test_a_long_line_later_is_named_in_a_short_message(write: Write) -> None:
    path = write(PLAIN + "3,4," + "9x" * 1_000_000 + "\n")
    with pytest.raises(InputError, match="line 5: column 'T' holds '9x9x") as caught:
        read(path)
    assert len(str(caught.value)) < 500


def test_a_file_larger_than_memory_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "huge.csv"
    with path.open("wb") as file:
        file.write(PLAIN.encode())
        file.truncate(2**42)  # sparse: takes no room on the disk
    with pytest.raises(InputError, match="max_bytes.*Slice the file"):
        read(path)


def test_max_bytes(write: Write) -> None:
    path = write(PLAIN)
    with pytest.raises(InputError, match="more than the limit of 10"):
        read(path, max_bytes=10)
    assert len(read(path, max_bytes=len(PLAIN))) == 3
    with pytest.raises(InputError, match="max_bytes is 0"):
        read(path, max_bytes=0)


def test_paths(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read(tmp_path / "none.csv")
    (tmp_path / "folder.csv").mkdir()
    with pytest.raises(InputError, match="not a file"):
        read(tmp_path / "folder.csv")
    with pytest.raises(InputError, match="ends in '.xlsx'.*one of .csv"):
        read(tmp_path / "run.xlsx")
    with pytest.raises(InputError, match="path is 7"):
        read(7)  # type: ignore[arg-type]


def test_names_or_a_system_must_be_given(write: Write) -> None:
    path = write(PLAIN)
    with pytest.raises(InputError, match="neither a system nor column names"):
        rt.read_record(path)
    with pytest.raises(InputError, match="'u' is used twice"):
        rt.read_record(path, inputs=["u"], outputs=["u"])
    with pytest.raises(InputError, match="outputs is 'T'"):
        rt.read_record(path, outputs="T")


def test_units_of_listed_outputs(write: Write) -> None:
    path = write("time,u [degC],T [degC],x [mm]\n0,20,30,1\n1,20,31,1\n")
    record = rt.read_record(path, inputs=["u"], outputs=["T", "x"], temperature_unit="degC")
    np.testing.assert_array_equal(record["T"], [303.15, 304.15])
    np.testing.assert_array_equal(record["x"], [1.0, 1.0])
    np.testing.assert_array_equal(record["u"], [20.0, 20.0])
    assert dict(record.units) == {"u": "degC", "T": "K", "x": "mm"}
    with pytest.raises(InputError, match=r"'T' is in \[degC\] and temperature_unit is 'K'"):
        rt.read_record(path, outputs=["T"])
    with pytest.raises(InputError, match="temperature_unit is 'C'"):
        rt.read_record(path, outputs=["T"], temperature_unit="C")  # type: ignore[arg-type]


def test_columns_not_listed_are_noted(write: Write) -> None:
    record = rt.read_record(write(PLAIN), outputs=["T"])
    assert record.inputs.shape == (3, 0)
    assert record.notes == ("columns not read: 'u'",)


floats = st.floats(allow_nan=False, allow_infinity=False)


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(arrays(np.float64, st.tuples(st.integers(2, 6), st.just(3)), elements=floats), st.sampled_from([1.0, 0.1, 60.0]))
def test_saved_numbers_come_back_to_the_last_bit(tmp_path: Path, table: np.ndarray, h: float) -> None:
    record = Record(
        sample_time=h, inputs=table[:, :1], outputs=table[:, 1:], input_names=["u"], output_names=["y1", "y2"]
    )
    path = tmp_path / "run.csv"
    record.save(path)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*glitch")
        again = rt.read_record(path, inputs=["u"], outputs=["y1", "y2"])
    np.testing.assert_array_equal(again.inputs, record.inputs)
    np.testing.assert_array_equal(again.outputs, record.outputs)
    assert again.sample_time == h
    assert [item.name for item in tmp_path.iterdir()] == ["run.csv"]
