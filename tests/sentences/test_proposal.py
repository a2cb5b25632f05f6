"""What is said of laws that nobody listed, and why there is none."""

from __future__ import annotations

from dataclasses import replace

import pytest

from flexgui.core.results import Event, Objection, Proposal, Reason
from flexgui.core.results.proposal import NO_CARRIER, NO_LAW, WITHIN_NOISE
from flexgui.sentences.proposal import law_sentence, proposal_paragraphs, proposed_line
from tests.approved import approved
from tests.sentences.findings import as_page
from tests.sentences.proposals import FRICTION, NEITHER, PLANNED, carrier, law, proposal

WHY = Objection(
    Reason.AT_BOUND, parameter="the width", bound=0.5, unit="rad", unseen=(4.0, 5.0), share=0.9
)
PUSH = Event("r2", 1.204, 1.398, "tip", "the tip", (3.04, -1.96), "N", ((0.0, 1.1), (1.5, 3.0)))
BRAKE = Event("r1", 0.5, 0.62, "joint1", "joint 1", (-0.4,), "N m")
TWO = (law(), law(title="Another law"))

CASES: dict[str, Proposal] = {
    "one law": proposal(law()),
    "a law that holds on what no fit has seen": proposal(law(unseen_rms=(17.0, 1.2))),
    "a law like a listed effect": proposal(law(relative="Cubic stiffness", likeness=0.91)),
    "two laws and the experiment that decides": proposal(*TWO, experiments=(PLANNED,)),
    "one needless effect": proposal(law(), needless=("Viscous friction",)),
    "two laws and two needless effects": proposal(*TWO, needless=("Air drag", "Soft base")),
    "one carrier": Proposal((carrier(),), (law(),)),
    "no second carrier": Proposal((carrier(), NEITHER), (law(),)),
    "a carrier with a factor first": Proposal((FRICTION,), (law(),)),
    "carriers that these recordings cannot tell apart": proposal(law(), alike=1),
    "a push in two recordings": Proposal(events=(PUSH, replace(PUSH, recording="r3", start=0.7))),
    "a torque at a joint": Proposal(events=(BRAKE,)),
    "within the noise": proposal(reason=WITHIN_NOISE),
    "no carrier": proposal(reason=NO_CARRIER),
    "no law": proposal(reason=NO_LAW),
    "refused laws": proposal(reason=NO_LAW, refused=(("A wall", WHY), ("A wave", WHY))),
    "stopped without a carrier": proposal(reason=NO_CARRIER, stopped=True),
    "stopped without a law": proposal(reason=NO_LAW, stopped=True),
}


def test_what_is_said_of_every_kind_of_proposal() -> None:
    said = {
        name: filter(None, [*proposal_paragraphs(found), proposed_line(found)])
        for name, found in CASES.items()
    }
    approved("proposals.md", as_page(said))
    assert not proposal_paragraphs(None) and not proposed_line(None)


@pytest.mark.parametrize(("likeness", "named"), [(0.5, True), (0.3, False), (float("nan"), False)])
def test_a_listed_effect_is_named_where_it_is_like_the_law(likeness: float, named: bool) -> None:
    text = law_sentence(law(relative="Cubic stiffness", likeness=likeness))
    assert ("Cubic stiffness is most like it" in text) == named
