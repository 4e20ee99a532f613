"""A file gives the same record, report or message whichever way it is cut into blocks."""

from __future__ import annotations

import json
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import robthermal as rt
from robthermal import InputError
from robthermal.signals.importing import _decode, _table, _text

N = 90
NAMES: dict[str, Any] = {"inputs": ["I"], "outputs": ["T1", "T2"], "temperature_unit": "degC"}
Line = Callable[[int], str]


def plain(k: int) -> str:
    return f"{k};0.5;{20 + 0.01 * k:.2f};{25 - 0.02 * k:.2f}".replace(".", ",")


def german(k: int) -> str:
    return f"01.03.2024 23:{58 + k // 60:02d}:{k % 60:02d};500;" + plain(k).split(";", 2)[2]


def of_day(minutes: int) -> str:
    return f"{minutes // 60 % 24:02d}:{minutes % 60:02d}:00"


def text_of(line: Line, header: str = "time;I [A];T1 [°C];T2 [°C]", n: int = N) -> str:
    return header + "\n" + "".join(line(k) + "\n" for k in range(n))


PLAIN = text_of(plain)
SLASHED = text_of(lambda k: f"{1 + (k + 60) // 90 * 12}/3/2024 0:{k // 60:02d}:{k % 60:02d};0,5;20,5;25,1")
FILES: dict[str, tuple[str | bytes, dict[str, Any]]] = {
    "plain": (PLAIN, {}),
    "preamble, units row, carriage returns": (
        "Logger 7\nSerial;12\n\n" + PLAIN.replace("I [A];T1 [°C];T2 [°C]\n", "I;T1;T2\ns;A;°C;°C\n").replace(
            "\n", "\r\n"), {}),
    "Windows letters far down": (("# start\n" + PLAIN + "# Prüfstand Süd °C\n" + plain(N) + "\n").encode("cp1252"), {}),
    "utf-16": (PLAIN.encode("utf-16"), {}),
    "repeated headers, blanks and comments": (
        PLAIN.replace("\n30;", "\n\ntime;I [A];T1 [°C];T2 [°C]\n30;").replace("\n50;", "\n# pause; 2\n   \n50;"), {}),
    "repeated header with its units": (PLAIN.replace("I [A];T1 [°C];T2 [°C]\n", "I;T1;T2\ns;A;°C;°C\n").replace(
        "\n70;", "\ntime;I;T1;T2\ns;A;°C;°C\n70;"), {}),
    "an incomplete last row": (PLAIN + "90;0,5;20", {}),
    "an incomplete last row and blanks": (PLAIN + "90;0,5\n\n# end\n\n", {}),
    "ragged far down": (PLAIN.replace("\n77;", "\n77;1;"), {}),
    "short far down": (PLAIN.replace("\n77;0,5;", "\n77;"), {}),
    "short, then the header": (PLAIN + "90;0,5\ntime;I [A];T1 [°C];T2 [°C]\n", {}),
    "text far down": (PLAIN.replace("\n81;0,5;20,81", "\n81;0,5;warm").replace("\n85;0,5;", "\n85;0,5;off"), {}),
    "two columns with text": (PLAIN.replace("23,4", "x").replace("\n40;0,5", "\n40;y"), {}),
    "words for missing readings": (
        PLAIN.replace("20,44", "OL").replace("20,60", "n/a").replace("\n70;0,5", "\n70;"), {}),
    "filled": (PLAIN.replace("20,44", "OL").replace("\n60;0,5;20,60;23,80", ""), {"gaps": "fill"}),
    "gaps": (PLAIN.replace("\n33;0,5;20,33;24,34", "").replace("\n66;0,5;20,66;23,68", ""), {}),
    "gaps refused": (PLAIN.replace("\n33;0,5;20,33;24,34", ""), {"gaps": "refuse"}),
    "repeated rows": (PLAIN.replace("\n50;0,5;20,50;24,00", 2 * "\n50;0,5;20,50;24,00"), {}),
    "repeated times": (PLAIN.replace("\n51;", "\n50;"), {}),
    "repeated times, mean": (PLAIN.replace("\n51;", "\n50;"), {"duplicates": "mean", "gaps": "fill"}),
    "a restart": (PLAIN + text_of(plain).split("\n", 1)[1], {"restarts": "split"}),
    "a restart refused": (PLAIN + text_of(plain).split("\n", 1)[1], {}),
    "jitter": (text_of(lambda k: f"{k + 0.05 * (k % 3):.2f};0.5;{20 + 0.3 * k % 7:.2f};25".replace(".", ",")), {}),
    "a fault code far down": (PLAIN.replace("20,80", "-127"), {}),
    "a fault code declared": (PLAIN.replace("20,80", "-127"), {"missing": [-127]}),
    "glitches": (PLAIN.replace("20,10", "41,0").replace("23,4", "83,4"), {}),
    "median filter": (PLAIN.replace("20,10", "41,0"), {"median_filter": 3.0}),
    "rounded stamps": (text_of(lambda k: f"{int(1.5 * k)};0,5;20,{k:02d};25"), {}),
    "German dates": (text_of(german, "Zeit;I [mA];T1 [°C];T2 [°C]"), {}),
    "a day above 12 far down": (SLASHED, {"gaps": "split", "restarts": "split"}),
    "no day above 12": (SLASHED.replace("13/3", "1/3"), {}),
    "days above 12 in both places": (SLASHED.replace("13/3", "3/13", 3), {}),
    "fractions far down": (text_of(lambda k: f"2024-03-01 10:00:{k // 2:02d}{'.5' * (k % 2)};0,5;20,5;25,1"), {}),
    "fractions of other dates far down": (text_of(
        lambda k: f"01.03.2024 10:00:{k // 2:02d}{',5' * (k % 2)};0,5;20,5;25,1"), {}),
    "an hour without a zone": (text_of(
        lambda k: f"2024-10-27 {of_day(60 + 3 * k - 60 * (k >= 40))};0,5;20,5;25,1"), {}),
    "zones mixed": (text_of(lambda k: f"2024-03-01T10:{k:02d}:00{'Z' * (k < 55)};0,5;20,5;25,1", n=59), {}),
    "no time far down": (PLAIN.replace("\n80;", "\n;").replace("\n82;", "\n;"), {}),
    "no time but text far down": (PLAIN.replace("\n80;", "\nnoon;"), {}),
    "past midnight": (text_of(lambda k: f"{of_day(23 * 60 + k)};0,5;20,5;25,1"), {}),
    "durations": (text_of(lambda k: f"{k} sec;0,5;20,5;25,1"), {}),
    "date and time of day": (text_of(lambda k: f"2024-03-01;10:{k // 60:02d}:{k % 60:02d};0,5;20,5;25,1",
                                     "date;time;I [A];T1 [°C];T2 [°C]"), {}),
    "quotes": ('"time";"I [A]";"note; odd";"T1 [°C]";"T2 [°C]"\n' + "".join(
        f'"{k}";0,5;"a; b" ;"20,5";25,1\n' for k in range(N)), {}),
    "empty and nameless columns": ("time;I [A];T1 [°C];T2 [°C];spare;;late\n" + "".join(
        f"{plain(k)};;7;{'x' * (k > 80)}\n" for k in range(N)), {}),
    "whole numbers, decimals far down": (text_of(lambda k: f"{k};1;20;25{',5' * (k > 2000)}", n=2100), {}),
}


def outcome(path: Path, options: dict[str, Any]) -> Any:
    with warnings.catch_warnings(record=True) as notes:
        warnings.simplefilter("always")
        try:
            found = rt.read_records(path, **NAMES, **options)
        except InputError as error:
            return str(error)
    imported = found[0].imported
    assert imported is not None
    lost = sum(action["rows"] for action in imported.actions)
    assert imported.rows["used"] + lost == imported.rows["file"]
    arrays = [(part.inputs.tolist(), part.outputs.tolist(), part.start_time, part.sample_time) for part in found]
    return arrays, imported.to_dict(), sorted(str(note.message) for note in notes)


def inspection(path: Path, options: dict[str, Any]) -> str:
    try:
        return json.dumps(rt.signals.inspect_file(path, **options).to_dict())
    except InputError as error:
        return str(error)


@pytest.mark.exhaustive
@pytest.mark.parametrize("name", FILES)
def test_blocks_of_a_few_rows_give_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    content, options = FILES[name]
    path = tmp_path / "run.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    own = {key: value for key, value in options.items() if key != "median_filter"}
    whole, seen = outcome(path, options), inspection(path, own)
    for size in (37, 113, 500):
        monkeypatch.setattr(_text, "BLOCK", size)
        monkeypatch.setattr(_decode, "BLOCK", size + 10)
        assert outcome(path, options) == whole
        assert inspection(path, own) == seen


@pytest.mark.parametrize("seed", range(4))
def test_parts_computed_in_pieces(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, seed: int) -> None:
    """Resampling, glitches, steps: pieces of a few rows against one piece."""
    rng = np.random.default_rng(seed)
    t = np.arange(300) + 0.1 * rng.uniform(-1, 1, 300) * (seed % 2)
    T = 20 + np.cumsum(rng.normal(0, 0.01, (300, 2)), axis=0)
    T[rng.integers(0, 300, 3), 0] += 5.0
    path = tmp_path / "run.csv"
    rows = (f"{a:.6f};{k // 50};{b:.4f};{c:.4f}\n" for k, (a, (b, c)) in enumerate(zip(t, T, strict=True)) if k != 140)
    path.write_text("time;I;T1;T2\n" + "".join(rows))
    whole = outcome(path, {})
    monkeypatch.setattr(_table.spans, "__defaults__", (17,))
    monkeypatch.setattr("robthermal.signals._glitches._PIECE", 13)
    assert outcome(path, {}) == whole
    assert len(whole[0]) == 2 and "glitch" in json.dumps(whole[1])
