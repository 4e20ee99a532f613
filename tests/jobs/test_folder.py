"""Output folders: all or nothing, and only over an earlier result."""

from __future__ import annotations

from pathlib import Path

import pytest

import robthermal as rt
from robthermal.cli.terminal import free, place


def fill(folder: Path, text: str) -> None:
    (folder / "summary.json").write_text(text)
    (folder / "certificates").mkdir()
    (folder / "certificates" / "c.json").write_text(text)


def test_it_appears_only_when_complete(tmp_path: Path) -> None:
    target = tmp_path / "new" / "out"
    with rt.jobs.folder.output_folder(target) as folder:
        fill(folder, "one")
        assert not target.exists()
    assert (target / "certificates" / "c.json").read_text() == "one"
    assert [path.name for path in target.parent.iterdir()] == ["out"]


@pytest.mark.parametrize("stop", [KeyboardInterrupt, ValueError, MemoryError])
def test_whatever_stops_it_leaves_the_earlier_result(tmp_path: Path, stop: type[BaseException]) -> None:
    with rt.jobs.folder.output_folder(tmp_path / "out") as folder:
        fill(folder, "first")
    with pytest.raises(stop), rt.jobs.folder.output_folder(tmp_path / "out") as folder:
        fill(folder, "second")
        raise stop
    assert (tmp_path / "out" / "summary.json").read_text() == "first"
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_an_earlier_result_is_replaced_as_a_whole(tmp_path: Path) -> None:
    with rt.jobs.folder.output_folder(tmp_path / "out") as folder:
        fill(folder, "first")
        (folder / "old.json").write_text("")
    with rt.jobs.folder.output_folder(tmp_path / "out") as folder:
        fill(folder, "second")
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"summary.json", "certificates"}
    assert (tmp_path / "out" / "summary.json").read_text() == "second"
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_an_empty_folder_may_be_used(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    with rt.jobs.folder.output_folder(tmp_path / "out") as folder:
        fill(folder, "here")
    assert (tmp_path / "out" / "summary.json").read_text() == "here"


def test_what_is_not_a_result_is_refused(tmp_path: Path) -> None:
    (tmp_path / "photos").mkdir()
    (tmp_path / "photos" / "cat.jpg").write_text("meow")
    with pytest.raises(rt.InputError, match=r"photos.*other things.*--out"):
        rt.jobs.folder.check_free(tmp_path / "photos")
    with pytest.raises(rt.InputError, match=r"is a file.*--out"):
        rt.jobs.folder.check_free(tmp_path / "photos" / "cat.jpg")
    with pytest.raises(rt.InputError, match=r"cat\.jpg.*not a folder"):
        rt.jobs.folder.check_free(tmp_path / "photos" / "cat.jpg" / "deeper" / "out")


def test_an_earlier_result_that_is_replaced_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    free(tmp_path / "out")
    place(tmp_path / "checks.xml")
    assert capsys.readouterr().err == ""
    (tmp_path / "out").mkdir()
    fill(tmp_path / "out", "old")
    (tmp_path / "checks.xml").write_text("old", encoding="utf-8")
    free(tmp_path / "out")
    place(tmp_path / "checks.xml")
    assert capsys.readouterr().err.splitlines() == [
        f"note: {tmp_path / 'out'} holds an earlier result, which is replaced",
        f"note: {tmp_path / 'checks.xml'} exists, and is replaced"]
    with pytest.raises(rt.InputError, match="other things in it"):
        free(tmp_path)
