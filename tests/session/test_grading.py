"""Hand-ins: sealed, checked, and graded into a table."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from flexgui.classroom.hand_in import (
    HEAD,
    LARGEST,
    HandIn,
    as_csv,
    grades,
    read_hand_in,
    stated_guess,
)
from flexgui.cli import app
from flexgui.core.errors import InputError
from flexgui.core.study.challenge import HEAD as CHALLENGE
from flexgui.core.study.challenge import TRUTH_FILE, obfuscate
from flexgui.stages.challenge.judging import NONE_GUESSED, Guess

TRUTH = {
    "seed": 6, "level": "hard", "effects": ["coulomb_friction", "camera_delay"], "EI": 520.0,
    "values": {"fc1": 0.2, "fc2": 0.1, "td": 0.004}, "shown": {"coulomb_friction": 3.0},
}  # fmt: skip
TRUTH_SEALED = obfuscate(json.dumps(TRUTH), "salt")

RIGHT = (Guess("coulomb_friction", "fc1 = 0.2 N m"), Guess("camera_delay", "td = 5 ms"))
HALF = (Guess("coulomb_friction"), Guess("tip_payload", "mt2 = 0.1 kg"))
ADA = HandIn("Ada", RIGHT, TRUTH_SEALED, asked=False)


def put(folder: Path, **given: HandIn) -> Path:
    for name, one in given.items():
        (folder / f"{name}.handin").write_text(one.text(), encoding="utf-8")
    return folder


def test_a_hand_in_comes_back_as_it_was(tmp_path: Path) -> None:
    assert read_hand_in(put(tmp_path, ada=ADA) / "ada.handin") == ADA
    assert ADA.text() == ADA.text()


def test_nothing_in_it_can_be_read() -> None:
    text = ADA.text()
    assert text.startswith(HEAD)
    assert not [word for word in ("Ada", "coulomb", "fc1") if word in text]


def test_guesses_are_judged_against_the_truth(tmp_path: Path) -> None:
    bob = HandIn("Bob", HALF, TRUTH_SEALED, asked=True, changed=True)
    first, second = grades(put(tmp_path, ada=ADA, bob=bob))
    assert (first.name, first.found, first.hidden, first.complete) == ("Ada", 2, 2, True)
    assert "fc1: your guess 0.2 N m, truth 0.2 N m, right" in first.size
    assert (second.found, second.complete) == (1, False)
    assert (second.used_tool_first, second.changed) == (True, True)
    assert "Camera delay" in second.truth


def test_a_changed_file_gets_a_row_with_the_fault(tmp_path: Path) -> None:
    put(tmp_path, ada=ADA)
    lines = ADA.text().splitlines()
    lines[3] = lines[3][:10] + ("A" if lines[3][10] != "A" else "B") + lines[3][11:]
    (tmp_path / "cheat.handin").write_text("\n".join(lines), encoding="utf-8")
    sound, broken = grades(tmp_path)
    assert not sound.fault
    assert "seal is broken" in broken.fault
    assert broken.found is None


@pytest.mark.parametrize(
    "content",
    [b"", b"\xff\xfe\x00", CHALLENGE.encode(), TRUTH_SEALED.encode(), b"x" * (LARGEST + 1)],
    ids=["empty", "no text", "a head alone", "a challenge's own seal", "far too long"],
)
def test_what_is_no_hand_in_gets_a_sentence(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "odd.handin").write_bytes(content)
    (row,) = grades(tmp_path)
    assert row.fault.startswith("odd.handin")
    assert "\n" not in row.fault


def test_a_sealed_text_of_another_kind_gets_a_sentence(tmp_path: Path) -> None:
    for number, text in enumerate(("[]", "no json", '{"name": 3}', '{"guesses": 1}')):
        (tmp_path / f"{number}.handin").write_text(obfuscate(text, "s", HEAD), encoding="utf-8")
    assert all("not a hand-in" in row.fault for row in grades(tmp_path))


def test_a_challenge_whose_seal_was_changed_is_no_truth(tmp_path: Path) -> None:
    forged = HandIn("Eve", RIGHT, TRUTH_SEALED.replace("A", "B", 1))
    (row,) = grades(put(tmp_path, eve=forged))
    assert "seal is broken" in row.fault


def test_a_folder_without_hand_ins_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="holds no hand-in"):
        grades(tmp_path)
    with pytest.raises(InputError, match="is not a folder"):
        grades(tmp_path / "missing")


def test_folders_of_a_learning_platform_are_searched(tmp_path: Path) -> None:
    inner = tmp_path / "Ada_123"
    inner.mkdir()
    (row,) = grades(put(inner, any=ADA) and tmp_path)
    assert row.file == "Ada_123/any.handin"


@pytest.mark.parametrize("name", ["=1+1", "+cmd", "-x", "@SUM(A1)"])
def test_a_name_cannot_become_a_formula_of_a_spreadsheet(name: str, tmp_path: Path) -> None:
    text = as_csv(grades(put(tmp_path, one=HandIn(name, RIGHT, TRUTH_SEALED))))
    (row,) = csv.DictReader(text.splitlines())
    assert row["name"] == f"'{name}"


def test_what_is_unknown_is_empty_and_the_rest_yes_or_no(tmp_path: Path) -> None:
    text = as_csv(grades(put(tmp_path, one=HandIn("", RIGHT, TRUTH_SEALED))))
    (row,) = csv.DictReader(text.splitlines())
    assert (row["used_tool_first"], row["changed"], row["complete"]) == ("", "no", "yes")


def test_a_guess_is_stated_by_id_and_size() -> None:
    assert stated_guess("camera_delay: td = 4 ms") == Guess("camera_delay", "td = 4 ms")
    assert stated_guess(NONE_GUESSED).kind == NONE_GUESSED
    with pytest.raises(InputError, match="did you mean 'camera_delay'"):
        stated_guess("camera_dely")


def test_from_the_command_line(tmp_path: Path) -> None:
    (tmp_path / TRUTH_FILE).write_text(TRUTH_SEALED, encoding="utf-8")
    target = tmp_path / "in" / "ada.handin"
    run = CliRunner()
    order = ["hand-in", str(tmp_path), "--name", "Ada", "--out", str(target)]
    asked = run.invoke(app, [*order, "--guess", "coulomb_friction: fc1 = 0.2 N m"])
    assert asked.exit_code == 0, asked.output
    graded = run.invoke(app, ["grade", str(tmp_path / "in")])
    assert graded.exit_code == 0, graded.output
    assert "1 hand-ins, 0 complete, 0 with a fault" in graded.output
    (row,) = csv.DictReader((tmp_path / "in" / "grades.csv").read_text("utf-8").splitlines())
    assert (row["name"], row["found"], row["hidden"]) == ("Ada", "1", "2")
    three = [*order, *["--guess", "camera_delay"] * 3]
    refused = run.invoke(app, three)
    assert refused.exit_code == 2
    assert "too many" in refused.output
