"""What is said of laws that nobody listed, and why there is none."""

from __future__ import annotations

import pytest

from flexgui.core.results import Objection, Proposal, Reason
from flexgui.core.results.proposal import NO_CARRIER, NO_LAW, WITHIN_NOISE
from flexgui.sentences.proposal import (
    carrier_sentence,
    carrier_words,
    law_sentence,
    proposal_paragraphs,
    proposed_line,
)
from tests.sentences.findings import SPACE
from tests.sentences.proposals import FRICTION, NEITHER, PLANNED, carrier, law, proposal

WHY = Objection(
    Reason.AT_BOUND, parameter="the width", bound=0.5, unit="rad", unseen=(4.0, 5.0), share=0.9
)


def said(found: Proposal | None) -> str:
    return "\n".join(proposal_paragraphs(found)).replace(SPACE, " ")


def test_a_law_is_said_with_formula_values_and_errors() -> None:
    text = law_sentence(law()).replace(SPACE, " ")
    assert text.startswith(
        "Torque at joint 2 over the position of joint 2, beyond a place: a*max(theta2 - c, 0)"
    )
    for part in ("a = 12.5 ± 0.2 N m/rad", "c = 0.400 ± 0.004 rad", "explains 99 %",
                 "from 18 times to 1.0 times the noise floor"):  # fmt: skip
        assert part in text
    assert "no fit has seen" not in text and text.endswith(".")


def test_errors_on_recordings_that_no_fit_has_seen_are_said_where_there_are_any() -> None:
    text = law_sentence(law(unseen_rms=(17.0, 1.2)))
    assert "on recordings that no fit has seen from 17 times to 1.2 times" in text


@pytest.mark.parametrize(
    ("likeness", "named"), [(0.91, True), (0.5, True), (0.3, False), (float("nan"), False)]
)
def test_a_listed_effect_is_named_where_it_is_like_the_law(likeness: float, named: bool) -> None:
    text = law_sentence(law(relative="Cubic stiffness", likeness=likeness))
    assert ("Cubic stiffness is most like it" in text) == named


def test_what_the_rest_depends_on_is_said_with_its_share_and_the_next_best() -> None:
    text = carrier_sentence(proposal(law())).replace(SPACE, " ")
    assert "The rest depends most on the position of joint 2: a smooth function of it" in text
    assert "acting at joint 2, explains 97 %" in text
    assert "next, the torque of drive 1, times the sign of the speed at joint 1: 41 %." in text
    assert "time since" not in text, "it explains nothing"


def test_without_a_second_variable_the_sentence_ends() -> None:
    for carriers in ((carrier(),), (carrier(), NEITHER)):
        text = carrier_sentence(Proposal(carriers, (law(),)))
        assert text.endswith("not fitted to.") and "next" not in text
    assert not carrier_sentence(Proposal())


def test_a_factor_is_said_behind_the_variable() -> None:
    assert carrier_words(carrier()) == "the position of joint 2"
    assert carrier_words(FRICTION) == "the torque of drive 1, times the sign of the speed"


def test_paragraphs_hold_the_carrier_each_law_and_the_experiment_that_decides() -> None:
    two = proposal(law(), law(title="Another law"), experiments=(PLANNED,))
    paragraphs = proposal_paragraphs(two)
    assert paragraphs[0] == carrier_sentence(two)
    assert paragraphs[1:3] == tuple(law_sentence(each) for each in two.laws)
    assert "One law and Another law" in paragraphs[3] and len(paragraphs) == 4


@pytest.mark.parametrize(
    ("laws", "needless", "words"),
    [
        (1, ("Viscous friction",), "With the law the error is as small without Viscous friction: "
                                   "take it out of the model."),
        (2, ("Air drag", "Soft base"), "With the first law the error is as small without Air drag "
                                       "and Soft base: take them out of the model."),
    ],
)  # fmt: skip
def test_effects_that_a_law_takes_the_place_of_are_named(
    laws: int, needless: tuple[str, ...], words: str
) -> None:
    found = proposal(*(law(title=f"Law {k}") for k in range(laws)), needless=needless)
    assert words in proposal_paragraphs(found)


def test_where_no_law_was_looked_for_nothing_is_said() -> None:
    assert not proposal_paragraphs(None) and not proposed_line(None)
    assert not proposed_line(proposal(reason=NO_LAW))


@pytest.mark.parametrize(
    ("reason", "words"),
    [
        (WITHIN_NOISE, "The error is within the noise"),
        (NO_CARRIER, "No position, speed, deflection, torque or time carries the rest"),
        (NO_LAW, "No law is proposed: each that was tried in the model failed a test."),
    ],
)
def test_why_there_is_none_is_one_sentence_of_its_own(reason: str, words: str) -> None:
    text = said(proposal(reason=reason))
    assert words in text
    others = {WITHIN_NOISE: "within the noise", NO_CARRIER: "carries the rest", NO_LAW: "failed"}
    assert not any(other in text for key, other in others.items() if key != reason)


def test_the_best_law_that_was_refused_is_named_with_what_speaks_against_it() -> None:
    text = said(proposal(reason=NO_LAW, refused=(("A wall", WHY), ("A wave", WHY))))
    assert "A wall: the width ended at 0.5 rad, the bound of its plausible range." in text
    assert "A wave" not in text
    assert "The rest depends most on the position of joint 2" in text


def test_where_no_variable_carries_the_rest_none_is_said_to() -> None:
    assert "depends most on" not in said(proposal(reason=NO_CARRIER))


def test_a_search_that_was_stopped_does_not_say_that_nothing_carries_the_rest() -> None:
    for reason in (NO_CARRIER, NO_LAW):
        text = said(proposal(reason=reason, stopped=True))
        assert "stopped" in text and "carries the rest" not in text and "failed" not in text


def test_the_line_of_a_result_holds_the_first_law() -> None:
    line = proposed_line(proposal(law(), law(title="Another law")))
    assert line.startswith("Proposed: Torque at joint 2")
    assert "a*max(theta2 - c, 0)" in line and "18 times to 1.0 times" in line
    assert "\n" not in line and "Another" not in line
