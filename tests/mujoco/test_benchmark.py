"""The benchmark judges answers by the truth, and refuses what is no table of answers."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

pytest.importorskip("mujoco", reason="needs MuJoCo: pip install '.[test]'")

from flexgui.core.effects import catalogue  # noqa: E402
from tests.programs.benchmark import COLUMNS, ROWS, main, numbered, ours, scores, write  # noqa: E402
from tests.programs.mujoco.wide_cases import CASES  # noqa: E402

HEAD = ",".join(COLUMNS)
TRUE = {
    case: CASES[name].made()[2] or {"nothing": {}} for case, name in numbered().items()
}  # fmt: skip


def score(answers: object) -> dict[str, str]:
    return dict(zip(ROWS, scores(answers), strict=True))  # type: ignore[arg-type]


def test_the_truth_scores_all() -> None:
    found = score(TRUE)
    assert {a for a, _, b in (v.partition(" of ") for v in found.values()) if b and a != b} == {"0"}
    assert found["something named that is not hidden"] == f"0 of {len(CASES)}"
    assert found["of these, error of a size: median, worst"] == "0.00%, 0%"


def test_no_answer_scores_nothing() -> None:
    assert {v.split(" of ")[0] for v in score({}).values()} <= {"0", "–"}


def test_an_effect_too_many_is_wrong() -> None:
    found = score({
        case: {"large_motion": {}, **{kind: e for kind, e in effects.items() if kind != "nothing"}}
        for case, effects in TRUE.items()
    })  # fmt: skip
    assert found["just what is hidden is named"].startswith("0 of")
    assert found["something named that is not hidden"] == f"{len(CASES)} of {len(CASES)}"


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("", "first line"),
        ("case;effect", "first line"),
        (f"{HEAD}\ncase999,viscous_friction,fv1,1", "no case"),
        (f"{HEAD}\ncase001,magic,fv1,1", "no effect"),
        (f"{HEAD}\ncase001,viscous_friction,fv1,much", "line 2"),
        (f"{HEAD}\ncase001,viscous_friction,fv1,nan", "finite"),
        (f"{HEAD}\ncase001,viscous_friction,fv1,", "needs a value"),
        (f"{HEAD}\ncase001,viscous_friction", "cells"),
        (f"{HEAD}\ncase001,nothing,,\ncase001,viscous_friction,fv1,1", "beside"),
        (f"{HEAD}\n" + 2 * "case001,viscous_friction,fv1,1\n", "twice"),
    ],
)
def test_a_bad_table_is_refused_in_one_sentence(
    text: str, word: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "results.csv"
    path.write_text(text, encoding="utf-8")
    assert main(["score", str(path)]) == 2
    said = capsys.readouterr().err
    assert word in said
    assert said.count("\n") == 1


def test_a_table_that_is_missing_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["score", str(tmp_path / "none.csv")]) == 2
    assert "none.csv" in capsys.readouterr().err


@pytest.mark.long
def test_what_is_written_does_not_hold_the_truth(tmp_path: Path) -> None:
    case = next(c for c, name in numbered().items() if name == "one/viscous_friction=0.12")
    write(tmp_path, [case])
    names = {path.name for path in (tmp_path / case).iterdir()}
    assert names == {"scenario.toml", *(f"posture{n}.csv.gz" for n in range(4))}
    text = (tmp_path / case / "scenario.toml").read_text(encoding="utf-8")
    assert not [effect for effect in catalogue() if effect in text]


def test_what_the_evidence_found_becomes_a_table_of_answers(tmp_path: Path) -> None:
    name, journal = "one/viscous_friction=0.12", tmp_path / "evidence.jsonl"
    bare: dict[str, object] = {"named": [], "values": {}, "of": {}}
    found = {
        "named": ["viscous_friction"],
        "values": {"fv1": 4.8, "EI1": 200.0},
        "of": {"fv1": "viscous_friction", "EI1": "arm"},
    }
    records = [
        {"key": f"engine/{name}/0", "found": found},
        {"key": "engine/one/nothing/0", "found": bare},
    ]
    journal.write_text("".join(json.dumps(r) + "\n" for r in records), encoding="utf-8")
    number = {name: case for case, name in numbered().items()}
    assert sorted(ours(journal)) == sorted([
        (number[name], "viscous_friction", "fv1", "4.8"), (number["one/nothing"], "nothing", "", "")
    ])  # fmt: skip
