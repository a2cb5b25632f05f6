"""What is said of a search: approved texts, and what holds of them whatever the figures are."""

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
    UNJUDGED,
    UNLISTED,
    Diagnosis,
    DiagnosisRound,
    Doubt,
    DoubtReason,
    Estimate,
    LinearModel,
    Objection,
    PlannedExperiment,
    RankedEffect,
    Reason,
    Remains,
)
from flexgui.core.workbench import largest_difference
from flexgui.sentences.experiments import experiment_sentence
from flexgui.sentences.figures import chance, linear_sentence, percent, strength
from flexgui.sentences.ranked import in_order, round_sentence, worth_listing
from flexgui.sentences.verdict import card_words, is_explained, verdict_paragraphs
from flexgui.stages.diagnose.panel_candidates import WORDS
from flexgui.views.headline import current_verdict
from tests.approved import approved
from tests.sentences.findings import (
    AFTER,
    FOUND,
    FRICTION,
    GIVEN,
    PAYLOAD,
    RIVALS,
    VISCOUS,
    as_page,
    estimate,
    left,
    ranked,
    step,
    text,
)
from tests.sentences.proposals import law, proposal

STRIBECK, MODE, VERDICTS = "stribeck_friction", "extra_bending_mode", (MISSING, NOTHING, UNLISTED)
LARGER_FIRST = (ranked(STRIBECK, 99.5, 5000.0), ranked(FRICTION, 80.0, 900.0))
SECOND = DiagnosisRound((ranked(PAYLOAD, 88.0, 300.0),), PAYLOAD)
RANKED_ONLY = replace(
    FOUND, final_verdict=None, limit=0, kept=(), proposed=(FRICTION,), steps=(GIVEN,),
    rounds=(DiagnosisRound(RIVALS, None),), error_left=left(19.0),
)  # fmt: skip
NONE_MISSING = replace(
    FOUND, verdict=NOTHING, rounds=(DiagnosisRound(RIVALS, None),), steps=(GIVEN,),
    error_given=left(1.01), error_left=left(1.01), kept=(),
)  # fmt: skip


def unseen(multiple: float) -> Diagnosis:
    """Found, with an error on validation of so many floors."""
    errors = tuple(replace(e, validation_rms=multiple * e.floor) for e in AFTER.errors)
    return replace(FOUND, steps=(GIVEN, replace(AFTER, errors=errors)))


def ranking(*effects: RankedEffect, **more: Any) -> Diagnosis:
    """With another ranking in its only round."""
    return replace(FOUND, rounds=(DiagnosisRound(effects, FRICTION, **more),))


def unsure(*doubts: tuple[DoubtReason, str, str, float, float], added: bool = False) -> Diagnosis:
    """An error within the noise floor that shows nothing: of the model as given, or of one with an
    effect `added`."""
    found = FOUND if added else replace(NONE_MISSING, verdict=UNJUDGED)
    given = tuple(Doubt(*each) for each in doubts)
    return replace(
        found, final_verdict=UNJUDGED, doubts=given, unstated_noise=("torque_noise",),
    )  # fmt: skip


def refusing(why: Objection, title: str, **more: Any) -> Diagnosis:
    """Nothing more was added after the first, for a reason."""
    last = DiagnosisRound(RIVALS[1:], None, ((title, why),))
    return replace(FOUND, rounds=(FOUND.rounds[0], last), **more)


def at_bound(verdict: str) -> Diagnosis:
    """A parameter of the arm ended at its bound."""
    title = "Bending stiffness of segment 1"
    stuck = Estimate("EI1", 5208.3, np.nan, "N m²", False, at_bound=True, title=title)
    sure = replace(stuck, name="EI2", title="EI2", at_bound=False)
    last = replace(AFTER if verdict == MISSING else GIVEN, parameters=(stuck, sure))
    return replace(FOUND, verdict=verdict, steps=(*FOUND.steps[: verdict == MISSING], last))


BY_VERDICT = {
    "not sought, as it is stated": lambda verdict: replace(
        FOUND, verdict=verdict,
        not_applicable={"gravity_tilt": "Stated: the rig is level.", "camera_delay": "No camera."},
        ruled_out={"Tilted base plate": "the rig is level", "Soft base": "the base is bolted"},
    ),
    "at a bound": at_bound,
    "ranked only": lambda verdict: replace(RANKED_ONLY, verdict=verdict),
}  # fmt: skip

CASES: dict[str, Diagnosis] = {
    "found": FOUND,
    "found, of an error at the floor": replace(
        FOUND, steps=(replace(GIVEN, cost_per_sample=1.01), AFTER)
    ),
    "found, and something is left": replace(
        FOUND, final_verdict=UNLISTED, error_left=left(4.2, ("z1", 12.34))
    ),
    "at the limit of the search": replace(
        FOUND, final_verdict=MISSING, error_left=left(4.2), limit=1
    ),
    "two found": replace(
        FOUND, rounds=(FOUND.rounds[0], SECOND), kept=(FRICTION, PAYLOAD),
        steps=(GIVEN, replace(AFTER, cost_per_sample=9.0), step(PAYLOAD, 1.0, None)),
    ),
    "one became needless": replace(
        FOUND, rounds=(FOUND.rounds[0], SECOND), kept=(PAYLOAD,), needless=("Coulomb friction",),
        steps=(GIVEN, AFTER, step(PAYLOAD, 1.0, None), replace(GIVEN, title="Without: x")),
    ),
    "nothing missing": NONE_MISSING,
    "unlisted": replace(
        FOUND, verdict=UNLISTED, final_verdict=UNLISTED, steps=(GIVEN,), kept=(),
        rounds=(DiagnosisRound(RIVALS[1:], None),), error_left=left(19.0, ("theta1", 7.5)),
        not_applicable={"camera_delay": "No output of a camera is compared."},
    ),
    "unlisted, with a law that two listed effects imitate": replace(
        FOUND, verdict=UNLISTED, final_verdict=UNLISTED, steps=(GIVEN,), kept=(),
        rounds=(DiagnosisRound(RIVALS[1:], None),),
        error_left=replace(left(19.0, ("theta1", 7.5)), line=("z1", 15.0)),
        proposal=proposal(law(rms=(19.0, 1.0)), needless=("Viscous friction", "Torque ripple")),
    ),
    "cannot be judged: the noise": unsure(
        (DoubtReason.REFUTED_NOISE, "u1", "N m", 2.2, 0.8),
        (DoubtReason.REFUTED_NOISE, "u2", "N m", 0.9, 0.3),
        (DoubtReason.FLOOR_ABOVE_SPREAD, "deflection1", "rad", 0.02, 0.01),
    ),
    "cannot be judged: unseen recordings": unsure(
        (DoubtReason.UNSEEN, "z1", "m", 3e-5, 9e-5), added=True
    ),
    "stopped": replace(FOUND, stopped=True),
    "stopped before anything was found": replace(
        FOUND, final_verdict=None, rounds=FOUND.rounds[1:], steps=(GIVEN,), kept=()
    ),
    "a ranking that was stopped": replace(
        RANKED_ONLY, verdict=UNJUDGED, stopped=True, proposed=()
    ),
    "an effect without size": replace(
        FOUND, kept=(MODE,), steps=(GIVEN, step(MODE, 1.0, None)),
        rounds=(DiagnosisRound((ranked(MODE, 90.0, 800.0),), MODE),),
    ),
    "a size at its bound": replace(
        FOUND,
        steps=(GIVEN, replace(AFTER, parameters=(estimate(std=np.nan, at_bound=True),))),
    ),
    "validation at the floor": unseen(1.1),
    "validation above the floor": unseen(1.3),
    "refused for the validation": refusing(Objection(Reason.UNSEEN, unseen=(1.2, 3.0)), "Payload"),
    "certain and small": refusing(
        Objection(Reason.SMALL_SHARE, share=0.23, p_value=7e-26, delta_bic=92.0),
        "Stribeck friction", final_verdict=UNLISTED, error_left=left(3.0),
    ),
    "an estimated noise": replace(
        FOUND, unstated_noise=("torque_noise", "encoder_noise"),
        error_left=replace(left(1.3), within={"theta1": 1.5, "z1": 1.5}, rms_within=1.5),
    ),
    "a tolerated error": replace(FOUND, error_left=replace(left(0.9), over_noise=3.7)),
    "confusable": ranking(
        ranked(FRICTION, 99.4, 12.0, VISCOUS), *RIVALS[1:], experiments=(
            PlannedExperiment({"seconds": 3.0}, "rad/s", 50.0, ("Friction", "Damping")),
        ),
    ),
    "contained in larger ones": ranking(
        RIVALS[0], ranked("presliding_friction", 99.4, 4990.0), ranked(STRIBECK, 99.5, 4990.0),
        *RIVALS[1:],
    ),
    "contained in one that gains a little": ranking(
        ranked(FRICTION, 80.0, 5000.0), ranked(STRIBECK, 84.0, 4990.0)
    ),
    "with a part of it as rival": replace(
        FOUND, steps=(GIVEN, replace(AFTER, added=STRIBECK)), kept=(STRIBECK,),
        rounds=(DiagnosisRound(LARGER_FIRST, STRIBECK),),
    ),
    "the next best stands last": ranking(*RIVALS, ranked("torque_ripple", 60.0, 100.0)),
    "a close rival": ranking(RIVALS[0], ranked("torque_ripple", 99.3, 4800.0)),
    **{f"{name}, {verdict}": made(verdict) for name, made in BY_VERDICT.items()
       for verdict in VERDICTS},
}  # fmt: skip


def test_what_is_said_of_every_kind_of_finding() -> None:
    approved("verdicts.md", as_page({name: verdict_paragraphs(d) for name, d in CASES.items()}))


def test_what_is_said_of_refusals_experiments_and_the_linear_model() -> None:
    refused = (
        ("A", Objection(Reason.AT_BOUND, "The friction", 5.5, "N m s/rad")),
        ("B", Objection(Reason.UNSETTLED)),
        ("C", Objection(Reason.INDISTINCT)),
        ("D", Objection(Reason.SMALL_SHARE, share=0.23, p_value=7e-26, delta_bic=92.0)),
    )
    planned = PlannedExperiment({"seconds": 3.0, "theta2": 1.5708}, "rad/s", 2.0, ("A", "B"))
    linear = replace(estimate("EI1", 21750.0), unit="N m²")
    fits = {
        "worse": (2e-4, 4.3e-5, 4.2e-5),
        "both far": (1.2e-3, 1e-3, 4.2e-5),
        "as good": (1e-3, 1e-3, 4.2e-5),
        "unknown": (None, None),
        "its fit stands elsewhere": (
            2.6e-4, 1.1e-4, 1.1e-4, largest_difference([linear], [replace(linear, value=910.0)]),
        ),
        "its fit was not determined": (
            2.6e-4, 1.1e-4, 1.1e-4,
            largest_difference([replace(linear, identifiable=False)], [replace(linear, value=9.1)]),
        ),
    }  # fmt: skip
    page = {
        "refused": [round_sentence(DiagnosisRound((), None, refused, ("Play",)))],
        "an experiment that decides nothing": [experiment_sentence(planned)],
        **{f"linear: {name}": [linear_sentence(LinearModel(*fit))] for name, fit in fits.items()},
    }
    approved("refusals_and_linear_model.md", as_page(page))


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
    validation=st.floats(0.5, 20.0), verdict=st.sampled_from(VERDICTS),
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
