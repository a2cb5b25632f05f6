"""How a study goes through its cases: what is finished, killed or interrupted."""

from __future__ import annotations

from pathlib import Path

import pytest

from flexgui.core.errors import InputError
from tests.studies.study_run import finished, run_all
from tests.study import counting
from tests.study.counting import MORTAL, UNLUCKY, Number

pytestmark = pytest.mark.long


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
    with pytest.raises(InputError, match="workers stopped"):
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


def test_a_file_that_is_no_text_is_refused(tmp_path: Path) -> None:
    (tmp_path / "x").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="other content"):
        finished([], tmp_path / "x")
