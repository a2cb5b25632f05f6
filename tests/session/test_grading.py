"""Hand-ins: sealed, checked, and graded into a table."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from flexgui.classroom.hand_in import (
    HEAD,
    LARGEST_HAND_IN,
    HandIn,
    as_csv,
    grades,
    read_hand_in,
    stated_guess,
)
from flexgui.cli import app
from flexgui.core.challenge.challenge import HEAD as CHALLENGE
from flexgui.core.challenge.challenge import TRUTH_FILE, obfuscate
from flexgui.core.errors import InputError
from flexgui.stages.challenge.judging import NONE_GUESSED, Guess
from tests.approved import approved

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
    text = ADA.text()
    assert text.startswith(HEAD) and not [w for w in ("Ada", "coulomb", "fc1") if w in text]


NO_HAND_INS = {
    "list": "[]", "no_json": "no json", "no_name": '{"name": 3}', "guess": '{"guesses": 1}'
}  # fmt: skip


def test_a_table_of_hand_ins_judges_each_and_names_what_is_wrong_with_it(tmp_path: Path) -> None:
    """Also of the folders of a learning platform; no name becomes a spreadsheet's formula."""
    (tmp_path / "Ada_123").mkdir()
    put(tmp_path / "Ada_123", ada=ADA)
    put(tmp_path, bob=HandIn("Bob", HALF, TRUTH_SEALED, asked=True, changed=True))
    put(tmp_path, eve=HandIn("Eve", RIGHT, TRUTH_SEALED.replace("A", "B", 1)))
    for number, name in enumerate(("=1+1", "+cmd", "-x", "@SUM(A1)")):
        put(tmp_path, **{f"formula{number}": HandIn(name, RIGHT, TRUTH_SEALED)})
    changed = list(ADA.text())
    changed[400] = "A" if changed[400] != "A" else "B"
    odd = {
        "changed": "".join(changed).encode(), "empty": b"", "no_text": b"\xff\xfe\x00",
        "head_alone": CHALLENGE.encode(), "own_seal": TRUTH_SEALED.encode(),
        "far_too_long": b"x" * (LARGEST_HAND_IN + 1),
    }  # fmt: skip
    for name, text in NO_HAND_INS.items():
        odd[name] = obfuscate(text, "s", HEAD).encode()
    for name, content in odd.items():
        (tmp_path / f"odd_{name}.handin").write_bytes(content)
    approved("grades.csv", as_csv(grades(tmp_path)))


def test_a_folder_without_hand_ins_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="holds no hand-in"):
        grades(tmp_path)
    with pytest.raises(InputError, match="is not a folder"):
        grades(tmp_path / "missing")


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
