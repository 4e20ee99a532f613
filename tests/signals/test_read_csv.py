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
    "no header": ("0,1,300\n1,2,301\n", "line 1: the first row holds numbers.*header row.*header = "),
    "nul bytes": (b"time,u,T\n0,1,\x00\x01\n", "binary.*NUL"),
    "binary junk": (bytes(range(255, 128, -1)) * 40 + b"\n", "no utf-16-le text"),
    "a letter that is not certain": ("time,u,T\n0,1,300\n# Ø\n".encode("cp1252"), "line 3: byte 0xD8.*no UTF-8"),
    "no time": ("clock_x,u,T\n0,1,300\n1,1,300\n", "no column 'time'.*Write time = .*Columns: clock_x, u, T"),
    "two times": ("time,Time,u,T\n0,0,1,300\n1,1,1,300\n", "2 time columns"),
    "time in metres": ("time [m],u,T\n0,1,300\n1,1,300\n", r"'time \[m\]' is in 'm'.*time_format"),
    "column twice": ("time,u,u,T\n0,1,1,300\n1,1,1,300\n", "columns 'u', 'u' have the same name"),
    "same name, two units": ("time,u,T [K],T [C]\n0,1,1,300\n1,1,1,300\n", "have the same name"),
    "no such column": ("time,u,x\n0,1,300\n1,1,300\n", "no column 'T'.*--column 'T=x'"),
    "long row": (PLAIN.replace("1,2,301", "1,2,301,7"), "line 3: the row has 4 cells and the header has 3"),
    "all rows long": ("time,u,T\n0,1,300,9\n1,1,300,9\n", "line 2: the row has 4 cells"),
    "short row": (PLAIN.replace("1,2,301", "# x\n1,2"), "line 4: the row has 2 cells"),
    "text": (PLAIN.replace("301", "off"), "line 3, column 'T': 'off' is not a number.*missing = "),
    "text after a comment": ("# c\n" + PLAIN.replace("301", "off"), "line 4, column 'T': 'off'"),
    "hexadecimal": (PLAIN.replace("301", "0x10"), "'0x10' is not a number"),
    "underscore": (PLAIN.replace("301", "3_01"), "'3_01' is not a number"),
    "boolean": (PLAIN.replace("1,2,301", "1,True,301"), "column 'u': 'True'"),
    "complex": (PLAIN.replace("301", "1+2j"), r"'1\+2j'"),
    "all missing": ("time,u,T\n0,1,nan\n1,1,nan\n2,1,\n", "column 'T' holds no value at all"),
    "empty time": (PLAIN.replace("1,2,301", ",2,301"), "line 3, column 'time': is empty"),
    "decimal comma and point": (PLAIN.replace(",", ";").replace("302.5", "302,5").replace("300", "300.5"),
                                "decimal comma .* decimal point .*decimal = "),
    "decimal comma and separator": ("time,u,T\n0,0,1,0,300,1\n1,0,1,0,300,1\n", "6 cells.*decimal commas"),
    "thousands": ("time;u;T\n0;1;1.234,5\n1;1;1.235,5\n", "line 2: '1.234,5' has a decimal and a thousands separator"),
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
    with pytest.raises(InputError, match="line 5, column 'T': '9x9x") as caught:
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
    (tmp_path / "run.xlsx").write_text("time,u,T")
    with pytest.raises(InputError, match="no workbook"):
        read(tmp_path / "run.xlsx")
    (tmp_path / "run.csv").write_bytes(b"%PDF-1.7 x")
    with pytest.raises(InputError, match="a PDF.*Export it as CSV"):
        read(tmp_path / "run.csv")
    with pytest.raises(InputError, match="the source is a int"):
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
    np.testing.assert_array_equal(record["u"], [293.15, 293.15])
    assert dict(record.units) == {"u": "K", "T": "K", "x": "mm"}
    assert rt.read_record(path, outputs=["T"])["T"][0] == 303.15  # the header says degC, nothing has to be declared
    with pytest.raises(InputError, match="temperature_unit = 'C'"):
        rt.read_record(path, outputs=["T"], temperature_unit="C")  # type: ignore[arg-type]


def test_columns_not_listed_are_noted(write: Write) -> None:
    record = rt.read_record(write(PLAIN), outputs=["T"])
    assert record.inputs.shape == (3, 0)
    assert record.notes == ("columns not read: 'u'",)


CODES = (-127.0, -127.94, 85.0, 999.0, 9999.0, -999.0, 32767.0, 6553.5, 3276.7)  # of sensors without a reading
floats = st.floats(allow_nan=False, allow_infinity=False).filter(lambda value: value not in CODES)


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
