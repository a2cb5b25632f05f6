"""What the verdict's words say, by facts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from core.diagnose.phrases import chance, percent, strength
from core.diagnose.verdict import MISSING, NOTHING, UNLISTED, Remains
from core.diagnose.words import Told, say
from core.effects import catalogue
from core.results import ChannelError, DiagnosisRound, Estimate, LadderStep, RankedEffect

FRICTION, VISCOUS, PAYLOAD = "coulomb_friction", "viscous_friction", "tip_payload"
SPACE = "\N{NO-BREAK SPACE}"


def estimate(
    name: str = "fc1", value: float = 1.2011, std: float = 0.0012, **more: bool
) -> Estimate:
    return Estimate(name, value, std, "N m", True, "f_{c1}", **more)


def ranked(kind: str, fall: float | None, bic: float | None, *confused: str) -> RankedEffect:
    return RankedEffect(kind, catalogue()[kind].title, 50.0, 1e-40, 70.0, fall, bic, confused)


def step(
    added: str | None, cost: float, tip: float | None, validation: float = np.nan
) -> LadderStep:
    title = catalogue()[added].title if added else "The model as given"
    errors = (ChannelError("z1", "m", 3e-5 * np.sqrt(cost), 3e-5, validation),)
    return LadderStep(added, title, (), errors, tip, cost)


def left(rms: float, line: tuple[str, float] | None = None) -> Remains:
    return Remains(rms, {"theta1": 0.97, "z1": rms}, line)


GIVEN, AFTER = step(None, 361.0, 1.96e-4), step(FRICTION, 1.0, 4.29e-5)
RIVALS = (ranked(FRICTION, 99.4, 5000.0), ranked(VISCOUS, 46.0, 900.0), ranked(PAYLOAD, None, None))

FOUND = Told(
    MISSING, NOTHING,
    rounds=(DiagnosisRound(RIVALS, FRICTION), DiagnosisRound(RIVALS[1:], None)),
    steps=(GIVEN, AFTER), given=left(19.0), left=left(1.0), kept=(FRICTION,), limit=2,
    titles={"fc1": "Coulomb friction of joint 1"}, sizes={FRICTION: (estimate(),)},
)  # fmt: skip


def text(told: Told) -> str:
    return " ".join(say(told)).replace(SPACE, " ")


def test_a_found_effect_is_named_with_what_it_is() -> None:
    said = text(FOUND)
    assert "lacks an effect: Coulomb friction" in say(FOUND)[0]
    assert "Two dry surfaces rub: the friction has the same level at every speed" in said


def test_its_size_is_told_in_si_units_rounded_to_its_deviation() -> None:
    assert "Coulomb friction of joint 1 is 1.2011 ± 0.0012 N m." in text(FOUND)


def test_how_sure_is_told_by_chance_and_evidence() -> None:
    said = text(FOUND)
    assert "less than one in a billion" in said
    assert "very strong (ΔBIC over 1000, where above 10 counts as very strong)" in said


def test_the_share_and_the_fall_of_the_error_are_told() -> None:
    said = text(FOUND)
    assert "explains 99.4 % of the error above the floor" in said
    assert "from 19 times its floor to 1.0 times" in said
    assert "of the tip from 0.20 mm to 0.043 mm rms" in said


def test_of_an_error_at_the_floor_no_share_is_claimed() -> None:
    said = text(replace(FOUND, steps=(replace(GIVEN, cost_per_sample=1.01), AFTER)))
    assert "small effect" in said
    assert "99.4 % of the error" not in said


def test_the_next_best_explanation_is_told() -> None:
    assert "next best explanation, Viscous joint friction, reaches 46 %" in text(FOUND)


def test_what_remains_is_told_by_channel() -> None:
    said = text(FOUND)
    assert "What remains: θ₁ 0.97 and z₁ 1.0 times the floor" in said
    assert "the tip is missed by 0.043 mm rms" in said
    assert "That is the floor" in said


def test_a_confusable_effect_is_named_with_the_experiment_that_decides() -> None:
    first = ranked(FRICTION, 99.4, 12.0, VISCOUS)
    sentence = "To tell them apart, record 3 s."
    one = DiagnosisRound((first, *RIVALS[1:]), FRICTION, sentence)
    said = text(replace(FOUND, rounds=(one,)))
    assert "cannot tell Coulomb friction from Viscous joint friction" in said
    assert sentence in said
    assert "next best" not in said


def test_what_contains_the_effect_is_no_rival_of_it() -> None:
    stribeck = ranked("stribeck_friction", 99.5, 4990.0)
    one = DiagnosisRound((RIVALS[0], stribeck, *RIVALS[1:]), FRICTION)
    assert "Stribeck" not in text(replace(FOUND, rounds=(one,)))


def test_a_close_rival_is_told_with_the_reason_against_it() -> None:
    close = ranked("torque_ripple", 99.3, 4800.0)
    one = DiagnosisRound((RIVALS[0], close), FRICTION)
    assert "reaches 99.3 %, but the evidence for it is weaker by ΔBIC 200" in text(
        replace(FOUND, rounds=(one,))
    )


def test_something_found_and_something_left_are_both_told() -> None:
    said = text(replace(FOUND, final=UNLISTED, left=left(4.2, ("z1", 12.34))))
    assert "lacks an effect: Coulomb friction" in said
    assert "4.2 times the floor is left that no effect of the list explains" in said
    assert "z₁ holds a vibration of 12.3 Hz" in said
    assert "That is the floor" not in said


def test_a_rest_at_the_limit_of_the_search_is_not_called_unlisted() -> None:
    told = replace(FOUND, final=MISSING, left=left(4.2), limit=1)
    said = text(told)
    assert "Viscous joint friction would take 46 % of what is left" in said
    assert "ended at its limit of 1" in said
    assert "no effect of the list" not in said


def test_two_found_effects_have_a_paragraph_each() -> None:
    second = DiagnosisRound((ranked(PAYLOAD, 88.0, 300.0),), PAYLOAD)
    told = replace(
        FOUND, rounds=(FOUND.rounds[0], second), kept=(FRICTION, PAYLOAD),
        steps=(GIVEN, replace(AFTER, cost_per_sample=9.0), step(PAYLOAD, 1.0, None)),
    )  # fmt: skip
    said = say(told)
    assert "lacks 2 effects: Coulomb friction and Tip payload" in said[0]
    assert any(
        p.startswith("Tip payload. ") and "from 3.0 times its floor to 1.0" in p for p in said
    )


def test_what_became_needless_is_told_and_not_claimed() -> None:
    second = DiagnosisRound((ranked(PAYLOAD, 88.0, 300.0),), PAYLOAD)
    steps = (GIVEN, AFTER, step(PAYLOAD, 1.0, None), replace(GIVEN, title="Without: x"))
    told = replace(FOUND, rounds=(FOUND.rounds[0], second), steps=steps, kept=(PAYLOAD,))
    said = say(told)
    assert "lacks an effect: Tip payload" in said[0]
    assert any("Coulomb friction seemed to be missing at first" in p for p in said)


def test_nothing_missing_says_so_and_claims_no_more_than_the_recordings_show() -> None:
    told = replace(FOUND, verdict=NOTHING, rounds=(DiagnosisRound(RIVALS, None),), steps=(GIVEN,),
                   given=left(1.01), left=left(1.01), kept=())  # fmt: skip
    said = text(told)
    assert said.startswith("Nothing is missing that these recordings could show.")
    assert "3 effects were tried" in said
    assert "can still be there" in said
    assert "lacks" not in said


def test_unlisted_says_so_with_the_closest_and_the_vibration() -> None:
    told = replace(
        FOUND, verdict=UNLISTED, final=UNLISTED, steps=(GIVEN,), kept=(),
        rounds=(DiagnosisRound(RIVALS[1:], None),), left=left(19.0, ("theta1", 7.5)),
        not_applicable={"camera_delay": "No output of a camera is compared."},
    )  # fmt: skip
    said = text(told)
    assert said.startswith("Something is missing that is not in the list of effects.")
    assert "closest, Viscous joint friction, explains 46 %" in said
    assert "θ₁ holds a vibration of 7.50 Hz" in said or "θ₁ holds a vibration of 7.5 Hz" in said
    assert "cannot show it: Camera delay" in said


def test_a_ranking_without_adding_names_the_first() -> None:
    told = replace(FOUND, final=None, limit=0, kept=(), steps=(GIVEN,), sizes={},
                   rounds=(DiagnosisRound(RIVALS, None),), left=left(19.0))  # fmt: skip
    said = text(told)
    assert "lacks an effect: Coulomb friction" in said
    assert "explains 99.4 % of the error above the floor." in said


def test_an_effect_without_size_is_said_to_have_none() -> None:
    kind = "extra_bending_mode"
    told = replace(
        FOUND, rounds=(DiagnosisRound((ranked(kind, 90.0, 800.0),), kind),), kept=(kind,),
        steps=(GIVEN, step(kind, 1.0, None)), sizes={kind: ()},
    )  # fmt: skip
    assert "It has no size" in text(told)


def test_a_size_at_its_bound_is_told() -> None:
    told = replace(FOUND, sizes={FRICTION: (estimate(std=np.nan, at_bound=True),)})
    assert "1.201 N m (at the bound of what is allowed)" in text(told)


def test_a_stopped_search_says_that_it_was_stopped() -> None:
    assert "was stopped before it was through" in say(replace(FOUND, stopped=True))[-1]


def test_a_search_stopped_early_does_not_claim_that_nothing_in_the_list_fits() -> None:
    rounds = FOUND.rounds[1:]
    told = replace(
        FOUND, verdict=MISSING, final=None, rounds=rounds, steps=(GIVEN,), kept=(), stopped=True
    )
    assert "not in the list" not in text(told)
    assert "was not found yet" in text(told)


def test_validation_is_told_where_there_is_any() -> None:
    seen = replace(FOUND, steps=(GIVEN, step(FRICTION, 1.0, None, 3.3e-5)))
    assert "no fit has seen the error is 1.1 times the floor" in text(seen)
    assert "no fit has seen" not in text(FOUND)


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
