"""What the verdict's words say, by facts."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexgui.core.results import (
    ABOVE,
    ABOVE_IN_ONE,
    MISSING,
    NOTHING,
    UNLISTED,
    DiagnosisRound,
    Estimate,
    LinearModel,
    Objection,
    Reason,
    Remains,
)
from flexgui.core.workbench import largest_difference
from flexgui.sentences.figures import chance, linear_sentence, percent, strength
from flexgui.sentences.ranked import in_order, worth_listing
from flexgui.sentences.verdict import STOPPED, card_words, is_explained, verdict_paragraphs
from flexgui.stages.diagnose.panel_candidates import WORDS
from flexgui.views.headline import current_verdict
from tests.sentences.findings import (
    AFTER,
    FOUND,
    FRICTION,
    GIVEN,
    PAYLOAD,
    RIVALS,
    SPACE,
    VISCOUS,
    estimate,
    left,
    ranked,
    step,
    text,
)

TOLD = {
    "what the found effect is": "Coulomb friction. Two dry surfaces rub.",
    "its size, rounded to its deviation": "Coulomb friction of joint 1 is 1.2011 ± 0.0012 N m.",
    "the chance of noise": "less than one in a billion",
    "the evidence": "very strong (ΔBIC over 1000; above 10 is very strong)",
    "the next best": "next best explanation, Viscous joint friction, reaches 46 %",
    "the fall of the error": "error from 19 to 1.0 times the noise floor",
    "the fall at the tip": "tip from 0.20 mm to 0.043 mm rms",
    "what remains by channel": "Remaining error: θ₁ 0.97 and z₁ 1.0 times the noise floor",
    "what remains at the tip": "noise floor, tip 0.043 mm rms.",
    "that nothing more is there": "That is the noise floor",
}


@pytest.mark.parametrize("fact", TOLD)
def test_a_verdict_tells_of_a_found_effect(fact: str) -> None:
    assert TOLD[fact] in text(FOUND)


def test_a_found_effect_is_named_first() -> None:
    assert "first missing effect is Coulomb friction" in verdict_paragraphs(FOUND)[0]


def test_the_share_of_the_error_is_told() -> None:
    drop = GIVEN.cost_per_sample - AFTER.cost_per_sample
    share = percent(100.0 * drop / max(GIVEN.cost_per_sample - 1.0, drop))
    assert f"explains {share} of the error above the noise floor" in text(FOUND)


def test_of_an_error_at_the_floor_no_share_is_claimed() -> None:
    said = text(replace(FOUND, steps=(replace(GIVEN, cost_per_sample=1.01), AFTER)))
    assert "small effect" in said
    assert "99.4 % of the error" not in said


@pytest.mark.parametrize(("unseen", "holds"), [(1.1, True), (1.3, False), (100.0, False)])
def test_what_unseen_recordings_ask_for_is_not_called_explained(unseen: float, holds: bool) -> None:
    seen = tuple(replace(e, validation_rms=unseen * e.floor) for e in AFTER.errors)
    told = replace(FOUND, steps=(GIVEN, replace(AFTER, errors=seen)))
    assert ("That is the noise floor" in text(told)) is holds
    assert ("the validation recordings are not" in text(told)) is not holds


def test_something_found_and_something_left_are_both_told() -> None:
    said = text(replace(FOUND, final_verdict=UNLISTED, error_left=left(4.2, ("z1", 12.34))))
    assert "first missing effect is Coulomb friction" in said
    assert "4.2 times the noise floor, and no listed effect explains it" in said
    assert "z₁ contains a vibration of 12.3 Hz" in said
    assert "That is the noise floor" not in said


def test_a_rest_at_the_limit_of_the_search_is_not_called_unlisted() -> None:
    told = replace(FOUND, final_verdict=MISSING, error_left=left(4.2), limit=1)
    said = text(told)
    assert "Viscous joint friction would explain 46 % of the remaining error" in said
    assert "ended at its limit of 1" in said
    assert "no listed effect" not in said


def test_two_found_effects_have_a_paragraph_each() -> None:
    second = DiagnosisRound((ranked(PAYLOAD, 88.0, 300.0),), PAYLOAD)
    told = replace(
        FOUND, rounds=(FOUND.rounds[0], second), kept=(FRICTION, PAYLOAD),
        steps=(GIVEN, replace(AFTER, cost_per_sample=9.0), step(PAYLOAD, 1.0, None)),
    )  # fmt: skip
    said = verdict_paragraphs(told)
    assert "first missing effect is Coulomb friction, then Tip payload." in said[0]
    assert any(p.startswith("Tip payload. ") and "error from 3.0 to 1.0 times" in p for p in said)


def test_what_became_needless_is_told_and_not_claimed() -> None:
    second = DiagnosisRound((ranked(PAYLOAD, 88.0, 300.0),), PAYLOAD)
    steps = (GIVEN, AFTER, step(PAYLOAD, 1.0, None), replace(GIVEN, title="Without: x"))
    told = replace(
        FOUND, rounds=(FOUND.rounds[0], second), steps=steps, kept=(PAYLOAD,),
        needless=("Coulomb friction",),
    )  # fmt: skip
    said = verdict_paragraphs(told)
    assert "first missing effect is Tip payload" in said[0]
    assert any("Coulomb friction seemed to be missing at first" in p for p in said)


def test_nothing_missing_says_so_and_claims_no_more_than_the_recordings_show() -> None:
    told = replace(FOUND, verdict=NOTHING, rounds=(DiagnosisRound(RIVALS, None),), steps=(GIVEN,),
                   error_given=left(1.01), error_left=left(1.01), kept=())  # fmt: skip
    said = text(told)
    assert said.startswith("Nothing is missing that these recordings could show.")
    assert "None of the 3 effects tried explains enough" in said
    assert "may remain undetected" in said
    assert "missing effect" not in said


TOLERANCES = st.fixed_dictionaries(
    {
        "rms_within": st.floats(1.0, 20.0),
        "within": st.fixed_dictionaries({"z1": st.floats(1.0, 20.0)}),
        "all_idealised": st.floats(0.0, 400.0),
        "idealised": st.fixed_dictionaries({"z1": st.floats(0.0, 400.0)}),
    }
)


@given(
    rms=st.floats(0.5, 20.0), worst=st.floats(0.5, 20.0), tolerances=TOLERANCES,
    validation=st.floats(0.5, 20.0), verdict=st.sampled_from([MISSING, UNLISTED, NOTHING]),
)  # fmt: skip
def test_no_error_above_the_floor_is_called_nothing(
    rms: float, worst: float, tolerances: dict[str, Any], validation: float, verdict: str
) -> None:
    """However large the tolerances are by which the verdict let it pass."""
    error, last = Remains(rms, {"z1": worst}, **tolerances), step(None, rms**2, None)
    unseen = tuple(replace(e, validation_rms=validation * e.floor) for e in last.errors)
    alone = replace(
        FOUND, verdict=verdict, final_verdict=None, rounds=(), kept=(), error_given=error,
        steps=(replace(last, errors=unseen),), error_left=error,
    )  # fmt: skip
    added = replace(
        alone, verdict=MISSING, final_verdict=verdict, steps=(GIVEN, replace(AFTER, errors=unseen))
    )
    above = rms > ABOVE or worst > ABOVE_IN_ONE or validation >= ABOVE_IN_ONE
    assert is_explained(alone) is is_explained(added) is (verdict == NOTHING and not above)
    card = str(WORDS.verdict(alone, rms, "", "", {}, "", False, False))
    assert (" nothing_missing" in card) is is_explained(alone)
    assert ("Nothing is missing" in card) is is_explained(alone)
    assert ("nothing more is missing" in current_verdict(added)) is is_explained(added)
    assert ("That is the noise floor" in text(alone)) is is_explained(alone)
    assert all(card_words(alone)[1:]) or verdict == UNLISTED


def test_unlisted_says_so_with_the_closest_and_the_vibration() -> None:
    told = replace(
        FOUND, verdict=UNLISTED, final_verdict=UNLISTED, steps=(GIVEN,), kept=(),
        rounds=(DiagnosisRound(RIVALS[1:], None),), error_left=left(19.0, ("theta1", 7.5)),
        not_applicable={"camera_delay": "No output of a camera is compared."},
    )  # fmt: skip
    said = text(told)
    assert said.startswith("Something is missing that is not in the list of effects.")
    assert "The best, Viscous joint friction, explains 46 %" in said
    assert any(f"θ₁ contains a vibration of {hz} Hz" in said for hz in ("7.50", "7.5"))
    assert "cannot show it: Camera delay" in said


@pytest.mark.parametrize("verdict", [MISSING, NOTHING, UNLISTED])
def test_every_verdict_says_what_was_not_sought_by_what_is_stated_of_the_rig(verdict: str) -> None:
    told = replace(
        FOUND, verdict=verdict,
        not_applicable={"gravity_tilt": "Stated: the rig is level.", "camera_delay": "No camera."},
        ruled_out={"Tilted base plate": "the rig is level", "Soft base": "the base is bolted"},
    )  # fmt: skip
    said = text(told)
    assert "Not tried, as it is stated that the rig is level: Tilted base plate." in said
    assert "Not tried, as it is stated that the base is bolted: Soft base." in said
    assert said.count("Tilted base plate") == 1
    assert "as it is stated" not in text(replace(told, ruled_out={}))


RANKED_ONLY = replace(
    FOUND, final_verdict=None, limit=0, kept=(), proposed=(FRICTION,), steps=(GIVEN,),
    rounds=(DiagnosisRound(RIVALS, None),), error_left=left(19.0),
)  # fmt: skip


def test_a_ranking_without_adding_names_the_first() -> None:
    said = text(RANKED_ONLY)
    assert "first missing effect is Coulomb friction" in said
    assert "explains 99.4 % of the error above the noise floor." in said


def test_before_anything_was_added_nothing_is_said_to_remain() -> None:
    said = text(RANKED_ONLY)
    assert "Error without it: θ₁ 0.97 and z₁ 19 times the noise floor, tip 0.20 mm rms." in said
    for verdict in (NOTHING, UNLISTED):
        said = text(replace(RANKED_ONLY, verdict=verdict))
        assert "Error: θ₁ 0.97" in said and "emain" not in said.partition("Effects")[0], verdict


def test_a_stopped_ranking_names_no_effect_as_missing() -> None:
    said = text(replace(RANKED_ONLY, stopped=True, proposed=()))
    assert "missing effect" not in said and "emaining" not in said
    assert "So far Coulomb friction explains most: 99.4 %" in said
    assert said.startswith(STOPPED) and said.count(STOPPED) == 1


@pytest.mark.parametrize("verdict", [MISSING, NOTHING, UNLISTED])
def test_the_floor_is_explained_where_it_is_first_named(verdict: str) -> None:
    said = verdict_paragraphs(replace(RANKED_ONLY, verdict=verdict))[0]
    assert "times the noise floor. The noise floor is the error of a complete model" in said
    assert "fidelity" not in said


def test_an_effect_without_size_is_said_to_have_none() -> None:
    kind = "extra_bending_mode"
    told = replace(
        FOUND, rounds=(DiagnosisRound((ranked(kind, 90.0, 800.0),), kind),), kept=(kind,),
        steps=(GIVEN, step(kind, 1.0, None)),
    )  # fmt: skip
    assert "It has no parameters" in text(told)


def test_a_size_at_its_bound_is_told() -> None:
    stuck = replace(AFTER, parameters=(estimate(std=np.nan, at_bound=True),))
    told = replace(FOUND, steps=(GIVEN, stuck))
    assert "1.201 N m (at its bound)" in text(told)


def test_a_stopped_search_says_that_it_was_stopped() -> None:
    assert (
        "was stopped before it was complete" in verdict_paragraphs(replace(FOUND, stopped=True))[-1]
    )


def test_a_search_stopped_early_does_not_claim_that_nothing_in_the_list_fits() -> None:
    rounds = FOUND.rounds[1:]
    told = replace(
        FOUND,
        verdict=MISSING,
        final_verdict=None,
        rounds=rounds,
        steps=(GIVEN,),
        kept=(),
        stopped=True,
    )
    assert "not in the list" not in text(told)
    assert "is not found yet" in text(told)


def test_validation_is_told_where_there_is_any() -> None:
    seen = replace(FOUND, steps=(GIVEN, step(FRICTION, 1.0, None, validation=3.3e-5)))
    assert "On validation the error is 1.1 times the noise floor" in text(seen)
    assert "On validation" not in text(FOUND)


@given(st.floats(0.0, 100.0))
def test_no_share_is_rounded_up_to_all_of_it(share: float) -> None:
    assert "100" not in percent(share)


@pytest.mark.parametrize(
    ("p", "said"),
    [
        (0.0, "less than one in a billion"),
        (1 / 300, "about 1 in 300"),
        (1.0, "more than one in two"),
    ],
)
def test_chances_read_as_odds(p: float, said: str) -> None:
    assert chance(p) == said


@given(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6))
def test_more_evidence_is_never_called_weaker(a: float, b: float) -> None:
    grades = ("weak", "positive", "strong", "very strong")
    low, high = sorted((a, b))
    assert grades.index(strength(low)) <= grades.index(strength(high))


def test_no_number_of_effects_is_claimed_to_be_all_that_is_missing() -> None:
    assert "lacks" not in text(FOUND) and "one effect" not in text(FOUND)


def test_deviations_are_said_to_hold_only_for_a_complete_model() -> None:
    assert text(FOUND).count("The ± values hold only if the model is complete.") == 1
    assert "±" not in text(replace(FOUND, verdict=NOTHING, rounds=(), steps=(GIVEN,), kept=()))


def test_a_nominal_parameter_at_its_bound_is_said_whatever_the_verdict() -> None:
    title = "Bending stiffness of segment 1"
    stuck = Estimate("EI1", 5208.3, np.nan, "N m²", False, at_bound=True, title=title)
    sure = replace(stuck, name="EI2", title="EI2", at_bound=False)
    for verdict in (MISSING, NOTHING, UNLISTED):
        last = replace(AFTER if verdict == MISSING else GIVEN, parameters=(stuck, sure))
        steps = (GIVEN, last) if verdict == MISSING else (last,)
        said = text(replace(FOUND, verdict=verdict, steps=steps))
        assert "Bending stiffness of segment 1 ended at its bound of 5208 N m²" in said, verdict
        assert "EI2" not in said


def test_a_size_at_its_bound_is_not_told_twice() -> None:
    size = estimate(std=np.nan, at_bound=True)
    last = replace(AFTER, parameters=(size,))
    said = text(replace(FOUND, steps=(GIVEN, last)))
    assert said.count("bound") == 1


WHY = (
    "Tip payload was not added: it worsens the validation error from 1.2 to 3.0 times the noise "
    "floor, so it probably imitates another effect."
)


UNSEEN = Objection(Reason.UNSEEN, unseen=(1.2, 3.0))


@pytest.mark.parametrize("verdict", [MISSING, UNLISTED, NOTHING])
def test_a_round_that_refused_everything_says_why(verdict: str) -> None:
    refused = DiagnosisRound(RIVALS[1:], None, (("Tip payload", UNSEEN),))
    rounds = (*FOUND.rounds[:1], refused) if verdict == MISSING else (refused,)
    steps = FOUND.steps if verdict == MISSING else (GIVEN,)
    told = replace(FOUND, verdict=verdict, final_verdict=verdict, rounds=rounds, steps=steps)
    assert text(told).count(WHY) == 1


def test_what_is_certain_and_small_is_named_beside_what_nothing_explains() -> None:
    small = Objection(Reason.SMALL_SHARE, share=0.23, p_value=7e-26, delta_bic=92.0)
    last = DiagnosisRound(RIVALS[1:], None, (("Stribeck friction", small),))
    rounds = (FOUND.rounds[0], last)
    said = text(replace(FOUND, final_verdict=UNLISTED, rounds=rounds, error_left=left(3.0)))
    assert "no listed effect explains enough of it" in said
    assert "Stribeck friction was not added: it is certain" in said


def test_an_estimated_noise_names_the_settings_that_state_it() -> None:
    vague = replace(left(1.3), within={"theta1": 1.5, "z1": 1.5}, rms_within=1.5)
    said = replace(FOUND, error_left=vague, unstated_noise=("torque_noise", "encoder_noise"))
    assert "State [sensors] torque_noise and encoder_noise for a sharper" in text(said)


def test_what_explains_nothing_or_has_no_size_is_not_listed() -> None:
    nothing = ranked(VISCOUS, 0.01, -8.0)
    gone = replace(ranked(VISCOUS, 100.0, 900.0), parameters=(estimate("b1", 0.0, 0.0),))
    least = replace(estimate("b1", 1e-6, at_bound=True), lower=0.0, upper=1e3)
    stuck = replace(gone, parameters=(least,))
    for one in (nothing, gone, stuck):
        assert worth_listing([RIVALS[0], one]) == [RIVALS[0]]
        rounds = (DiagnosisRound((RIVALS[0], one), FRICTION), *FOUND.rounds[1:])
        assert "Viscous" not in text(replace(FOUND, rounds=rounds))
    assert worth_listing(RIVALS) == list(RIVALS)


def test_the_list_is_in_the_order_that_is_stated() -> None:
    little, more = ranked(PAYLOAD, 3.0, 900.0), ranked(FRICTION, 37.0, 80.0)
    untried = replace(ranked("camera_delay", 50.0, 1.0), refit_drop_percent=None)
    tied = replace(ranked(VISCOUS, 40.0, 99.0), tied_to=(estimate(),))
    shown = in_order((little, tied, untried, more))
    assert [r.effect for r in shown] == [FRICTION, PAYLOAD, "camera_delay", VISCOUS]
    assert in_order(shown, PAYLOAD)[0] is little, "what is named as missing stands first"


def test_the_linear_model_is_told_as_a_matter_of_the_model_and_only_where_it_is_worse() -> None:
    floor = 4.2e-5
    missed = linear_sentence(LinearModel(2e-4, 4.3e-5, floor)).replace(SPACE, " ")
    assert missed.startswith(
        "The tip error is 0.20 mm rms with the linear model and 0.043 mm with the full equations, "
        "at the noise floor."
    )
    assert "not from a missing effect" in missed
    both = linear_sentence(LinearModel(1.2e-3, 1e-3, floor)).replace(SPACE, " ")
    assert "1.2 mm rms with the linear model and 1.0 mm with the full equations." in both
    assert "as good as the full equations" in linear_sentence(LinearModel(1e-3, 1e-3, floor))
    assert "linear" not in linear_sentence(LinearModel(None, None))


@pytest.mark.parametrize("identifiable", [True, False])
def test_a_fit_that_stands_elsewhere_is_not_blamed_on_the_linear_model(identifiable: bool) -> None:
    linear = replace(estimate("EI1", 21750.0), unit="N m²", identifiable=identifiable)
    full = replace(linear, value=910.0, identifiable=True)
    moved = largest_difference([linear], [full])
    told = linear_sentence(LinearModel(2.6e-4, 1.1e-4, 1.1e-4, moved)).replace(SPACE, " ")
    assert ("EI1 is 910 N m² instead of 21750 N m²" in told) is identifiable
    assert ("not from a missing effect" in told) is not identifiable
