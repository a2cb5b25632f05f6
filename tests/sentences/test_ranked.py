"""What is said of other explanations, by facts."""

from __future__ import annotations

from dataclasses import replace

from flexgui.core.results import DiagnosisRound, Objection, PlannedExperiment, Reason
from flexgui.sentences.experiments import experiment_sentence
from flexgui.sentences.ranked import round_sentence
from tests.sentences.findings import AFTER, FOUND, FRICTION, GIVEN, RIVALS, VISCOUS, ranked, text


def test_a_confusable_effect_is_named_with_the_experiment_that_decides() -> None:
    first = ranked(FRICTION, 99.4, 12.0, VISCOUS)
    planned = PlannedExperiment({"seconds": 3.0}, "rad/s", 50.0, ("Friction", "Damping"))
    one = DiagnosisRound((first, *RIVALS[1:]), FRICTION, experiments=(planned,))
    said = text(replace(FOUND, rounds=(one,)))
    assert "cannot distinguish Coulomb friction from Viscous joint friction" in said
    assert "To distinguish Friction and Damping, record 3 s with ±0.3 rad/s" in said
    assert "next best" not in said


def test_what_contains_the_effect_is_told_as_that_and_not_as_a_rival() -> None:
    larger = [
        ranked("presliding_friction", 99.4, 4990.0),
        ranked("stribeck_friction", 99.5, 4990.0),
    ]
    one = DiagnosisRound((RIVALS[0], *larger, *RIVALS[1:]), FRICTION)
    said = text(replace(FOUND, rounds=(one,)))
    assert (
        "Presliding friction and Stribeck friction contain Coulomb friction and explain no more: "
        "their additional parameters are not needed." in said
    )
    assert "The next different explanation, Viscous joint friction, reaches 46 %." in said
    assert "next best" not in said


def test_what_contains_the_effect_and_gains_a_little_is_told_with_its_figure() -> None:
    first, larger = ranked(FRICTION, 80.0, 5000.0), ranked("stribeck_friction", 84.0, 4990.0)
    said = text(replace(FOUND, rounds=(DiagnosisRound((first, larger), FRICTION),)))
    assert "Stribeck friction (84 %) contains Coulomb friction; the gain does not" in said


def test_a_part_of_the_effect_is_told_as_that_and_not_as_a_rival() -> None:
    first = ranked("stribeck_friction", 99.5, 5000.0)
    rounds = (DiagnosisRound((first, ranked(FRICTION, 80.0, 900.0)), "stribeck_friction"),)
    steps = (GIVEN, replace(AFTER, added="stribeck_friction"))
    said = text(replace(FOUND, rounds=rounds, steps=steps, kept=("stribeck_friction",)))
    assert "Coulomb friction (80 %) is part of Stribeck friction; alone it explains less." in said
    assert "next" not in said


def test_the_next_best_is_the_one_that_explains_most_of_the_others() -> None:
    """Whatever its place: the ranking also weighs evidence."""
    ripple = ranked("torque_ripple", 60.0, 100.0)
    one = DiagnosisRound((*RIVALS, ripple), FRICTION)
    assert "The next best explanation, Torque ripple, reaches 60 %." in text(
        replace(FOUND, rounds=(one,))
    )


def test_a_higher_figure_that_was_not_refitted_is_not_passed_over() -> None:
    """RIVALS' payload is expected to explain 70 %, more than viscous friction does."""
    assert "The estimate before refitting is higher for Tip payload (≈ 70 %)." in text(FOUND)


def test_a_close_rival_is_told_with_the_reason_against_it() -> None:
    close = ranked("torque_ripple", 99.3, 4800.0)
    one = DiagnosisRound((RIVALS[0], close), FRICTION)
    assert "reaches 99.3 %, but the evidence for it is weaker by ΔBIC 200" in text(
        replace(FOUND, rounds=(one,))
    )


def test_why_effects_were_not_added_is_told_with_its_figures() -> None:
    refused = (
        ("A", Objection(Reason.AT_BOUND, "The friction", 5.5, "N m s/rad")),
        ("B", Objection(Reason.UNSETTLED)),
        ("C", Objection(Reason.INDISTINCT)),
        ("D", Objection(Reason.SMALL_SHARE, share=0.23, p_value=7e-26, delta_bic=92.0)),
    )
    assert round_sentence(DiagnosisRound((), None, refused, ("Play",))) == (
        "A was not added: The friction ended at 5.5 N m s/rad, the bound of its plausible range. "
        "B was not added: with finer simulation steps it worsens the fit. "
        "C was not added: its size cannot be distinguished from zero. "
        "D was not added: it is certain (less than one in a billion by noise alone, ΔBIC 92), but "
        "explains only 23 % of the error above the noise floor. "
        "Could not be simulated at any size: Play."
    )


def test_an_experiment_that_decides_nothing_says_so() -> None:
    one = PlannedExperiment({"seconds": 3.0, "theta2": 1.5708}, "rad/s", 2.0, ("A", "B"))
    assert experiment_sentence(one) == (
        "3 s at θ₂ = 90° with ±0.3 rad/s, each level held for 0.02 s would not distinguish A and B "
        "(expected score 2)."
    )
