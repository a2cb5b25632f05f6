"""A hidden effect without a page: the data, a guess, the truth, the class."""

from __future__ import annotations

from pathlib import Path

import pytest

from flexgui.core.challenge.truth import Truth
from flexgui.core.effects import catalogue
from flexgui.core.errors import InputError
from flexgui.core.scenario.read import scenario_toml
from flexgui.session.session import Session
from flexgui.stages.challenge.board import MOST_ENTRIES, Board, Entry, board_table, plain_name
from flexgui.stages.challenge.judging import NONE_GUESSED, Size, judge, size_fields
from flexgui.stages.challenge.state import Challenge, Guess
from tests.approved import approved
from tests.session.helpers import HIDDEN_FRICTION, until

SEED = 4
"""Hides Coulomb friction."""

FRICTION = Guess("coulomb_friction", Size("fc1", 0.2, "N m"))
TRUTH = Truth(
    {"coulomb_friction": 3.0, "camera_delay": 2.0}, {"fc1": 0.2, "fc2": 0.1, "td": 0.004}, 520.0
)


@pytest.mark.long
def test_from_hiding_to_the_truth(session: Session) -> None:
    assert not session.challenge.guess((FRICTION,)) and session.message.bad
    assert session.challenge.hide(SEED, "easy")
    until(lambda: session.challenge.state is not None)
    known = session.challenge.state
    assert known is not None and known.revealed is None
    assert (session.folder / "th1.csv").is_file() and len(session.document.scenario.recordings) == 8
    told = scenario_toml(session.document.scenario)
    assert "coulomb" not in told and "fc1" not in told
    assert not session.challenge.reveal() and session.message.bad, "no truth before a guess"
    assert session.challenge.guess((FRICTION,), " Ada \n Lovelace ")
    assert session.services.board.guessing(SEED, "easy") == 1
    assert not session.challenge.guess((Guess("rotor_inertia"),)), "a guess stands"
    assert session.challenge.reveal()
    found = session.challenge.state
    assert found is not None and found.revealed is not None
    assert found.guesses == (FRICTION,)
    judgement = found.revealed
    assert judgement.complete and judgement.hidden == ("coulomb_friction",)
    assert judgement.each[0].size.startswith("fc1: your guess 0.2 N m, truth ")
    assert any("Coulomb friction of joint 1" in line for line in judgement.truth)
    assert not session.challenge.guess((Guess("rotor_inertia"),)), "the truth is known"
    assert not session.challenge.change_guess()
    entry = session.services.board.entries(SEED, "easy")[0]
    assert (entry.name, entry.judgement) == ("Ada Lovelace", judgement)
    assert not entry.changed
    assert session.services.board.guessing(SEED, "easy") == 0


def test_a_class_hears_of_each_other(session: Session, tmp_path: Path) -> None:
    known = session.challenge.state = Challenge(SEED, "easy", HIDDEN_FRICTION)
    folder = tmp_path / "other"
    folder.mkdir()
    other = Session("another", folder, session.services)
    heard: list[object] = []
    other.challenge.take_up(known)
    assert other.challenge.guess((Guess("camera_delay"),))
    other.subscribe(heard.append)
    assert session.challenge.guess((FRICTION,))
    assert heard, "a guess of somebody else moves the board"
    other.close()
    heard.clear()
    assert session.challenge.change_guess() and session.challenge.guess((FRICTION,))
    assert not heard


def test_a_changed_guess_is_noted_and_the_same_one_is_not() -> None:
    first, second = (Guess("rotor_inertia"),), (FRICTION,)
    once = Challenge(1, "easy", HIDDEN_FRICTION).committed(first)
    again = once.committed(first)
    assert not again.changed
    assert again.committed(second).changed and again.committed(second).committed(second).changed


def test_no_truth_while_the_guess_is_being_changed(session: Session) -> None:
    session.challenge.state = Challenge(1, "easy", HIDDEN_FRICTION)
    assert not session.challenge.change_guess(), "there is none yet"
    assert session.challenge.guess((FRICTION,)) and session.challenge.change_guess()
    assert not session.challenge.reveal() and session.message.bad
    assert session.challenge.state.guesses, "nothing is lost"


def test_the_board_says_who_changed() -> None:
    plain = Entry("Ada", judge((FRICTION,), HIDDEN_FRICTION), 185.0)
    changed = Entry("Bob", judge((Guess("rotor_inertia"),), HIDDEN_FRICTION), 2.0, True)
    table = board_table([plain, changed], 0)
    assert table.rows[0].cells[1:] == ("Coulomb friction", "1 of 1", "near", "3:05 min")
    assert table.rows[1].cells[3:] == ("–", "0:02 min")
    assert [row.cells[0] for row in table.rows] == ["Ada", "Bob °"]
    assert table.caption == "° changed the guess."
    assert not board_table([plain], 0).caption


WRITTEN = (
    "0.2", " 0,2 ", ",5", "2E-1", "\N{MINUS SIGN}3", "  ", "banana", "0.2 N m", "1e999", "nan",
    "1.234,5", "٣", "1_0",
)  # fmt: skip
DELAY = Guess("camera_delay", Size("td", 4.4, "ms"))
GUESSED = (
    (Guess("coulomb_friction", Size("fc1", 0.3, "N m")), DELAY),
    (Guess("camera_delay", Size("td", 40.0, "ms")),),
    (Guess(NONE_GUESSED),),
    (Guess("coulomb_friction", Size("fc2", -0.11, "N m")),),
)


def test_sizes_are_read_and_guesses_judged() -> None:
    """A size is a number with point or comma."""
    field = size_fields("coulomb_friction")[0]
    lines = [f"{field.title}: {field.label}"]
    for text in WRITTEN:
        try:
            lines.append(f"'{text}' is {field.stated(text)}")
        except InputError as error:
            lines.append(f"'{text}' is refused: {error}")
    for guesses in GUESSED:
        found = judge(guesses, TRUTH)
        stated = "; ".join(f"{one.title}, {one.size}" for one in guesses)
        lines += ["", stated, f"{found.sentence} ({found.found}, {found.complete})"]
        lines += [f"near {one.near}: {one.size}" for one in found.each]
    approved("guesses.txt", "\n".join(line.rstrip() for line in lines))


@pytest.mark.parametrize("kind", sorted(catalogue()))
def test_a_size_is_stated_in_the_unit_that_is_asked_for(kind: str) -> None:
    for one in size_fields(kind):
        assert one.stated("0,25") == Size(one.name, 0.25, one.unit)
    assert size_fields("nothing") == ()


def test_a_board_keeps_no_more_than_a_class_needs() -> None:
    board = Board()
    entry = Entry("x", judge((FRICTION,), HIDDEN_FRICTION), 1.0)
    for k in range(MOST_ENTRIES + 5):
        board.note(1, "easy", str(k))
        board.note(1, "easy", str(k), entry)
    assert len(board.entries(1, "easy")) == MOST_ENTRIES and not board.guessing(1, "easy")
    for seed in range(200):
        board.note(seed, "easy", "k", entry)
    assert not board.entries(1, "easy"), "old seeds are forgotten"


def test_a_name_is_one_short_line() -> None:
    assert plain_name(" Ada \n Lovelace ") == "Ada Lovelace" and len(plain_name("x" * 99)) < 30


def test_a_wrong_level_and_another_scenario(session: Session) -> None:
    assert session.challenge.hide(SEED, "absurd")
    until(lambda: not session.run.busy and session.message.bad)
    assert "absurd" in session.message.text and session.challenge.state is None
    assert session.challenge.hide(SEED, "easy")
    until(lambda: session.challenge.state is not None)
    session.choose("demo")
    assert session.challenge.state is None and not session.diagnosis.versions
