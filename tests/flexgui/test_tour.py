"""The card of the tour goes along with whoever walks by the stages."""

from __future__ import annotations

import pytest

from flexgui.panels.tour import STEPS, step_of

LOOK, COMPARE, DIAGNOSE, ADD = range(1, 5)


@pytest.mark.parametrize(
    ("tour", "stage", "shown"),
    [
        (LOOK, "Data", LOOK),
        (LOOK, "Identify", COMPARE),
        (LOOK, "Compare", COMPARE),
        (LOOK, "Diagnose", DIAGNOSE),
        (COMPARE, "Diagnose", DIAGNOSE),
        (ADD, "Diagnose", ADD),
        (DIAGNOSE, "Compare", DIAGNOSE),
        (DIAGNOSE, "Arm", DIAGNOSE),
    ],
)
def test_the_card_is_never_behind_the_person(tour: int, stage: str, shown: int) -> None:
    assert step_of(tour, stage) == shown


@pytest.mark.parametrize("tour", [None, 0])
def test_a_tour_that_has_not_begun_does_not_begin_by_itself(tour: int | None) -> None:
    assert step_of(tour, "Diagnose") == tour


def test_every_step_leads_to_a_stage() -> None:
    assert all(step.stage for step in STEPS[1:])
