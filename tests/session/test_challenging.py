"""A hidden effect without a page: the data, a guess, the truth."""

from __future__ import annotations

from core.scenario.write import scenario_toml
from flexgui.session import Session
from tests.session.conftest import Offered
from tests.session.helpers import until

SEED = 4
"""Hides Coulomb friction."""


def test_from_hiding_to_the_truth(session: Session, services: Offered) -> None:
    assert not session.guess("coulomb_friction", "") and session.message.bad
    assert session.hide(SEED, "easy", services)
    until(lambda: session.challenge is not None)
    known = session.challenge
    assert known is not None and known.revealed is None
    assert (session.folder / "th1.csv").is_file() and len(session.scenario.recordings) == 8
    told = scenario_toml(session.scenario) + known.sealed
    assert "coulomb" not in told and "fc1" not in told
    assert not session.reveal() and session.message.bad, "no truth before a guess"
    assert session.guess("coulomb_friction", " fc1 = 0.2 N m ")
    assert session.reveal()
    found = session.challenge
    assert found is not None and found.revealed is not None and found.size == "fc1 = 0.2 N m"
    assert found.revealed.guessed_right and found.revealed.hidden == ("coulomb_friction",)
    assert any("fc1" in line for line in found.revealed.truth)
    assert "did not ask" in found.revealed.tool
    assert not session.guess("rotor_inertia", ""), "the truth is known"


def test_a_wrong_level_and_another_scenario(session: Session, services: Offered) -> None:
    assert session.hide(SEED, "absurd", services)
    until(lambda: not session.busy and session.message.bad)
    assert "absurd" in session.message.text and session.challenge is None
    assert session.hide(SEED, "easy", services)
    until(lambda: session.challenge is not None)
    session.choose("demo", services)
    assert session.challenge is None and not session.looks


def test_the_tour_ends_for_good(session: Session) -> None:
    assert session.tour == 0
    session.go_on_tour(None)
    assert session.tour is None
