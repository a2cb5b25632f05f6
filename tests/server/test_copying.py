"""What a follower's own copy takes over."""

from __future__ import annotations

from pathlib import Path

from flexgui.classroom.challenging import Challenge, Guess
from flexgui.classroom.demo import copy_session
from flexgui.session import Session
from flexgui.stages.diagnose.look import Look
from tests.session.helpers import alone


def made(folder: Path, key: str) -> Session:
    (folder / key).mkdir()
    return alone(key, folder / key)


def test_a_copy_has_what_the_teacher_found(tmp_path: Path) -> None:
    teacher, own = made(tmp_path, "teacher"), made(tmp_path, "own")
    teacher.diagnosis.looks = (Look(teacher.document.scenario),)
    copy_session(teacher, own)
    assert own.diagnosis.looks == teacher.diagnosis.looks and own.challenge.state is None
    teacher.close()
    own.close()


def test_a_copy_of_a_challenge_begins_anew(tmp_path: Path) -> None:
    teacher, own = made(tmp_path, "teacher"), made(tmp_path, "own")
    (teacher.folder / "th1.csv").write_text("t\n")
    teacher.challenge.state = Challenge(7, "hard", "sealed", (Guess("rotor_inertia"),))
    teacher.diagnosis.looks = (Look(teacher.document.scenario),)
    copy_session(teacher, own)
    assert (own.folder / "th1.csv").is_file()
    known = own.challenge.state
    assert known is not None and (known.seed, known.level, known.sealed) == (7, "hard", "sealed")
    assert not known.guesses and known.count == 2
    assert not own.diagnosis.looks, "the teacher's findings would give it away"
    teacher.close()
    own.close()
