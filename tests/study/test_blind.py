"""The blind matrix: its list of cases, its book-keeping, and a short run of it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from core.errors import InputError
from core.study.hidden import candidates
from core.study.rig import noisy
from tests.studies import blind, blind_case
from tests.studies.blind_case import answer_text, made, run_case
from tests.studies.blind_cases import Case, Choice
from tests.studies.blind_run import finished, order_text, run_all
from tests.studies.blind_tables import both, near_floor, right, tables, unlisted
from tests.study import counting
from tests.study.counting import MORTAL, UNLUCKY, Number

pytestmark = pytest.mark.long

MEAN_SQUARE = 0.15
"""Relative scatter of the mean square of four thousand coloured samples, three deviations."""

SHORT = [
    Case("singles", ("viscous_friction",), "strong", 1, "white"),
    Case("singles", ("tip_payload",), "strong", 1, "coloured"),
    Case("singles", ("camera_delay",), "strong", 2, "white"),
    Case("singles", ("structural_damping",), "weak", 1, "white"),
    Case("pairs", ("camera_misalignment", "rotor_inertia"), "strong", 1, "white"),
    Case("nulls", (), "none", 1, "white"),
    Case("nulls", (), "none", 2, "coloured"),
    Case("outside", ("vibration",), "strong", 1, "white"),
]


def test_the_planned_matrix_is_the_one_that_was_asked_for() -> None:
    cases = Choice().cases()
    keys = [c.key for c in cases]
    assert len(set(keys)) == len(keys)
    count = {part: sum(c.part == part for c in cases) for part in ("pairs", "nulls", "outside")}
    assert count == {"pairs": 40, "nulls": 200, "outside": 60}
    for kind in candidates():
        mine = [c for c in cases if c.part == "singles" and c.what == (kind,)]
        levels = {c.level for c in mine}
        assert levels in ({"weak", "strong"}, {"switched"})
        assert {c.noise for c in mine} == {"white", "coloured"}
        assert len(mine) == 10 * len(levels)


def test_pairs_are_of_different_rooms_and_no_pair_comes_twice() -> None:
    pairs = Choice(parts=("pairs",), noises=("white",)).cases()
    assert len({c.what for c in pairs}) == len(pairs) == 20
    locations = {kind: one.location for kind, one in candidates().items()}
    assert all(locations[c.what[0]] != locations[c.what[1]] for c in pairs)


def test_both_colours_hide_the_same_truth_and_the_noise_is_as_stated() -> None:
    white, coloured = (
        Case("singles", ("viscous_friction",), "weak", 1, noise) for noise in ("white", "coloured")
    )
    first, second = made(white), made(coloured)
    assert first.truth == second.truth
    for data, case in ((first, white), (second, coloured)):
        _, square = noisy(data.recordings, case.noise, case.stream)
        assert square == pytest.approx(1.0, rel=MEAN_SQUARE)


def test_finished_cases_are_not_run_again_and_failures_are_kept(tmp_path: Path) -> None:
    out, said = tmp_path / "x.jsonl", []
    work, two = counting.answer_text, [Number(2), Number(UNLUCKY)]
    first = run_all(two, work, out, said.append)
    assert first["n2"]["square"] == 4 and first["n13"]["failed"] == "ValueError: unlucky"
    assert said[0] == "2 cases, 0 of them finished before."
    assert sorted(said[1:]) in (["1/2 n13", "2/2 n2"], ["1/2 n2", "2/2 n13"])
    out.write_text(out.read_text() + '{"key": "n5", "squ')  # as if the power had failed
    later = run_all([*two, Number(5)], work, out, said.append, 1)
    assert said[3:] == ["3 cases, 2 of them finished before.", "1/1 n5"]
    assert later["n5"]["square"] == 25
    lines = out.read_text().splitlines()
    assert sum('"n2"' in line for line in lines) == 1
    assert finished([*two, Number(5), Number(6)], out) == later


def test_a_killed_worker_is_replaced_and_no_case_is_lost(tmp_path: Path) -> None:
    cases = [*map(Number, range(4)), Number(MORTAL, str(tmp_path / "mark"))]
    found = run_all(cases, counting.answer_text, tmp_path / "x.jsonl", lambda _: None)
    assert {r["key"]: r["square"] for r in found.values()} == {c.key: c.value**2 for c in cases}


def test_a_case_that_kills_every_worker_ends_the_matrix_and_keeps_the_rest(tmp_path: Path) -> None:
    cases, out = [*map(Number, range(3)), Number(MORTAL)], tmp_path / "x.jsonl"
    with pytest.raises(InputError, match="workers ended"):
        run_all(cases, counting.answer_text, out, lambda _: None, 1)
    assert set(finished(cases, out)) == {"n0", "n1", "n2"}


def test_ctrl_c_ends_with_what_is_finished(tmp_path: Path) -> None:
    cases, out, said = [Number(k) for k in range(40)], tmp_path / "x.jsonl", []

    def told(text: str) -> None:
        said.append(text)
        if text.startswith("2/"):
            raise KeyboardInterrupt

    found = run_all(cases, counting.slow_answer_text, out, told)
    assert 2 <= len(found) < len(cases)
    assert said[-1] == "Stopped; the same command continues from here."
    later = run_all(cases[: len(found) + 1], counting.answer_text, out, lambda _: None)
    assert later.items() >= found.items() and len(later) == len(found) + 1


def test_a_case_reaches_a_worker_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(blind_case, "run_case", lambda case: {"key": case.key, "seen": case == one})
    one = SHORT[4]
    assert json.loads(answer_text(order_text(one))) == {"key": one.key, "seen": True}


@pytest.mark.parametrize(
    "arguments",
    [["--part", "singels"], ["--effects", "coulomb"], ["--noise", "pink"], ["--processes", "0"]],
)
def test_a_slip_is_one_sentence_and_two(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert blind.main(arguments) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_a_file_that_is_no_text_is_refused(tmp_path: Path) -> None:
    (tmp_path / "x").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="something else"):
        finished([], tmp_path / "x")


def test_the_short_matrix_is_right(tmp_path: Path) -> None:
    records = [json.loads(json.dumps(run_case(c))) for c in SHORT]
    by_part = {part: [r for r in records if r["part"] == part] for part in blind.PARTS}
    assert all(right(r) and near_floor(r) for r in by_part["singles"])
    assert all(both(r) for r in by_part["pairs"])
    assert all(not r["accepted"] and r["verdict"] == "nothing_missing" for r in by_part["nulls"])
    assert all(unlisted(r) for r in by_part["outside"])
    sizes = [s for r in by_part["singles"] for s in r["sizes"].values()]
    assert all(abs(s["value"] - s["truth"]) < 4.0 * s["std"] for s in sizes)
    assert all(np.isfinite(s["std"]) for s in sizes)
    text = tables(records)
    assert "MISSED" not in text and "vibration" in text
