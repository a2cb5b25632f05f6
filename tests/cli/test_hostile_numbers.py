"""Numbers, names and places that used to end in a traceback, or never."""

from __future__ import annotations

import os
import sys
import tempfile
import warnings
from pathlib import Path

import pytest

from flexgui import cli
from tests.cli.helpers import COLUMNS, FILE, SCENARIO, TEXT, Case, arrange, csv, table

GOOD = Case("good", ())
LONGEST = 300
"""Characters of a sentence that somebody still reads to its end."""

Said = tuple[int, str]


@pytest.fixture
def command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):  # type: ignore[no-untyped-def]
    """Runs a command line in the folder of the test: exit code and what it says."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("FLEXGUI_DATA", raising=False)

    def run(*arguments: str) -> Said:
        code = cli.run(arguments)
        out, err = capsys.readouterr()
        assert out == "" or code == 0
        return code, err

    return run


def refused(said: Said, *words: str) -> None:
    code, text = said
    assert code == 2
    assert text.startswith("flexgui: ") and text.count("\n") == 1 and len(text) <= LONGEST + 1
    assert text.endswith((".\n", "?\n")) and "Traceback" not in text
    for word in words:
        assert word in text


@pytest.mark.parametrize("column", COLUMNS[1:])
def test_one_huge_cell_is_one_sentence(column: str, command, tmp_path) -> None:  # type: ignore[no-untyped-def]
    lines = table()
    lines[40][COLUMNS.index(column)] = "-1e300"
    (tmp_path / SCENARIO).write_text(TEXT)
    (tmp_path / FILE).write_text(csv(lines))
    refused(command("export", SCENARIO, "--out", "out"), FILE, column, "row 40")


MANY = {
    "recordings": (
        "title = 'x'\n[arm]\npreset = 'paper'\n" + "[[recordings]]\nsimulate = {}\n" * 10_000,
        "[recordings]", "at most 500",
    ),
    "samples": (
        "title = 'x'\n[arm]\npreset = 'paper'\n"
        + "[[recordings]]\nsimulate = {seconds = 400.0}\n" * 3,
        "1,200,000", "1,000,000",
    ),
    "formulas": (
        TEXT + "[[model.own]]\ntarget = 'joint1'\nformula = '-a*dtheta1'\n"
        "parameters = {a = 1.0}\n" * 300,
        "own", "at most 20",
    ),
    "text": ("# " + "x" * 600_000, SCENARIO, "500,000 characters"),
}  # fmt: skip


@pytest.mark.parametrize("name", MANY)
def test_too_many_are_counted(name: str, command, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    text, *words = MANY[name]
    (tmp_path / SCENARIO).write_text(text)
    refused(command("export", SCENARIO, "--out", "out"), *words)


@pytest.mark.parametrize("length", [300, 5000])
@pytest.mark.parametrize(
    "arguments",
    [
        ("export", "{}", "--out", "out"),
        ("export", SCENARIO, "--out", "{}"),
        ("export", SCENARIO, "--out", "out", "--data", "{}"),
        ("study", "{}"),
        ("{}",),
        ("export", SCENARIO, "--{}", "out"),
    ],
    ids=" ".join,
)
def test_a_name_that_is_too_long_is_one_sentence(
    arguments: tuple[str, ...], length: int, command, tmp_path: Path
) -> None:  # type: ignore[no-untyped-def]
    arrange(GOOD, tmp_path)
    refused(command(*(part.format("a" * length) for part in arguments)))


def test_a_data_folder_that_is_none_is_told(command, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    arrange(GOOD, tmp_path)
    said = command("export", SCENARIO, "--out", "out", "--data", "nowhere")
    refused(said, "--data nowhere is no folder")


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such pipes in folders")
def test_a_pipe_is_not_waited_for(command, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    os.mkfifo(tmp_path / "pipe.toml")
    refused(command("export", "pipe.toml", "--out", "out"), "pipe.toml", "pipe")
    (tmp_path / SCENARIO).write_text(TEXT)
    os.mkfifo(tmp_path / FILE)
    refused(command("export", SCENARIO, "--out", "out"), FILE, "pipe")


def test_thousands_of_columns_do_not_fill_the_sentence(command, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    (tmp_path / SCENARIO).write_text(TEXT)
    lines = "x" + "," * 5000 + "\n" + "0" + ",0" * 5000 + "\n"
    (tmp_path / FILE).write_text(lines)
    refused(command("export", SCENARIO, "--out", "out", "--quiet"), FILE, "no column t", "more")


@pytest.fixture
def failing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):  # type: ignore[no-untyped-def]
    """Lets the work of `export` end in an error, with a warning of a library before it."""

    def prepare(error: Exception) -> None:
        def fail(*given: object, **named: object) -> None:
            warnings.warn("overflow encountered in multiply", RuntimeWarning, stacklevel=1)
            raise error

        arrange(GOOD, tmp_path)
        monkeypatch.setattr("flexgui.core.workbench.run_scenario", fail)
        monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))

    return prepare


@pytest.mark.parametrize(
    ("error", "word"),
    [
        (MemoryError(), "memory"),
        (FileNotFoundError(2, "No such file", "template.html"), "Internal error"),
        (FloatingPointError("overflow"), "Internal error"),
        (ValueError("operands could not be broadcast together"), "could not be broadcast"),
        (IndexError("index 3 is out of bounds"), "not in your input"),
        (RecursionError(), "RecursionError"),
    ],
)
def test_only_wrong_input_is_laid_at_the_users_door(
    error: Exception, word: str, command, failing, tmp_path: Path
) -> None:  # type: ignore[no-untyped-def]
    failing(error)
    code, said = command("export", SCENARIO, "--out", "out")
    assert code == 1
    assert said.startswith("flexgui: ") and said.count("\n") == 1 and word in said
    (kept,) = tmp_path.glob("flexgui-*.txt")
    assert said.endswith(f"The traceback is in {kept}.\n")
    assert f"{type(error).__name__}" in kept.read_text() and "Traceback" in kept.read_text()


def test_a_place_that_the_system_refuses_is_named_and_a_traceback_shown_on_request(
    command, failing, capsys: pytest.CaptureFixture[str]
) -> None:  # type: ignore[no-untyped-def]
    failing(OSError(28, "No space left on device", "out/report.html"))
    refused(command("export", SCENARIO, "--out", "out"), "out/report.html", "no space left")
    assert cli.run(["--help"]) == 0 and "--traceback" in capsys.readouterr().out
    failing(ValueError("operands could not be broadcast together"))
    with pytest.raises(ValueError, match="broadcast"):
        command("export", SCENARIO, "--out", "out", "--traceback")
