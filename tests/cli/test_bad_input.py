"""Bad input through the command line: one sentence, exit code 2, nothing written."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.cli.cases import CASES
from tests.cli.helpers import FILE, TEXT, Case, arrange, export
from tests.slips import changed, sentences_for

LONGEST = 400
"""Characters of a sentence that is still read to its end."""


def contents(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def sentence(case: Case, folder: Path) -> str:
    """What the command says; fails where it is more or less than one sentence."""
    result = export(case, folder)
    assert result.exit_code == 2, (result.exit_code, result.output, result.exception)
    assert result.stdout == ""
    said = result.stderr
    assert said.startswith("flexgui: ")
    assert said.count("\n") == 1
    assert said.endswith((".\n", "?\n"))
    assert "Traceback" not in said
    assert len(said) < LONGEST + len(str(folder)) * 2, said
    assert not re.search(r"pydantic|numpy|<class|object at 0x|Errno", said), said
    assert not re.search(r"[^.]\.\.(\s|$)|\?\.|\.\?|: \.\s", said), said
    return said


def test_the_unspoilt_scenario_runs(tmp_path: Path) -> None:
    case = Case("good", ())
    arrange(case, tmp_path)
    result = export(case, tmp_path)
    assert result.exit_code == 0, result.output
    assert (tmp_path / "out" / "report.html").is_file()


@pytest.mark.long
def test_a_recording_from_elsewhere_is_read_and_told(tmp_path: Path) -> None:
    room = tmp_path / "room"
    room.mkdir()
    case = Case("elsewhere", (), Case("", ()).text.replace(FILE, f"../{FILE}"))
    arrange(case, room)
    (room / FILE).rename(tmp_path / FILE)
    result = export(case, room)
    assert result.exit_code == 0, result.output
    assert result.stderr == (
        f"flexgui: The scenario reads outside its folder and the data folder: {tmp_path / FILE}.\n"
    )


@pytest.mark.parametrize("case", CASES, ids=str)
def test_it_ends_in_one_sentence_and_leaves_nothing(
    case: Case, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("FLEXGUI_DATA", raising=False)
    arrange(case, tmp_path)
    before = contents(tmp_path)
    folders = sorted(p for p in tmp_path.rglob("*") if p.is_dir())
    said = sentence(case, tmp_path)
    for word in case.words:
        assert word in said, said
    assert contents(tmp_path) == before
    assert sorted(p for p in tmp_path.rglob("*") if p.is_dir()) == folders


def test_each_slip_in_a_scenario_is_told_in_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("FLEXGUI_DATA", raising=False)

    def said(entry: str) -> str:
        case = Case(entry, (), changed(TEXT, entry))
        arrange(case, tmp_path)
        before = contents(tmp_path)
        text = sentence(case, tmp_path)
        assert contents(tmp_path) == before and not (tmp_path / "out").exists()
        return text.removeprefix("flexgui: ").replace(str(tmp_path), "...").strip()

    sentences_for("slips.txt", said)


@pytest.mark.parametrize("case", CASES[:: len(CASES) // 6], ids=str)
def test_an_older_report_stays_as_it_was(
    case: Case, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("FLEXGUI_DATA", raising=False)
    arrange(case, tmp_path)
    old = tmp_path / "out"
    old.mkdir(exist_ok=True)
    (old / "report.html").write_text("the last good one")
    (old / "result.json").write_text('{"files": ["report.html", "result.json"]}')
    before = contents(old)
    sentence(case, tmp_path)
    assert contents(old) == before
