"""Experiments within limits: none is violated, and the deviations come out as predicted."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flexgui.core.diagnose.evidence import TIE
from flexgui.core.diagnose.stated_results import final_parameters
from flexgui.core.errors import InputError
from flexgui.core.estimate.fit_result import with_robust_covariance
from flexgui.core.experiments.design import ExperimentRequest, design
from flexgui.core.experiments.identified_model import IdentifiedModel
from flexgui.core.experiments.plan import fit_for_planning
from flexgui.core.experiments.rig_limits import RigLimits
from flexgui.core.experiments.trial import USED_SHARE
from flexgui.core.loading import load_recordings
from flexgui.core.progress import Silent
from flexgui.core.scenario.rig_spec import LimitsSpec
from flexgui.core.scenario.schema import Scenario
from flexgui.core.scenario.stated_effects import base_model
from flexgui.core.simulate.nonlinear import simulate_within
from flexgui.sentences.experiments import plan_paragraphs
from tests.experiments.rig import LOOP, TORQUE, planned, recorded, recordings, scenario
from tests.marks import long_except

NEAR = 0.2
"""Share by which a deviation may differ from the predicted: the deviation of a fit is itself
estimated from some hundred samples of noise."""

TIGHT = LimitsSpec(
    position=((-0.05, 0.05), (1.0, 2.0)), speed=(0.1, 0.2), torque=(8.0, 4.0),
    reach=((-1.0, 1.0), (-1.0, 1.0)),
)  # fmt: skip


def used_by_the_machine(limits: RigLimits, drive: str, wish: ExperimentRequest) -> list[float]:
    machine = base_model(scenario(drive=drive)).at_level("nonlinear")
    shares = []
    for c in planned(wish, drive).chosen:
        task, _ = c.trial.task(machine)
        own, tip = limits.usage(simulate_within(machine, machine.numbers(), task).trajectory)
        shares.append(max(float(own.max()), tip))
    return shares


@pytest.mark.parametrize("drive", long_except((LOOP,), (LOOP, TORQUE)))
@pytest.mark.parametrize("limits", long_except((TIGHT,), (TIGHT, LimitsSpec())))
def test_the_machine_keeps_every_limit(drive: str, limits: LimitsSpec) -> None:
    wish = ExperimentRequest(seconds=3.0, limits=limits)
    shares = used_by_the_machine(planned(wish, drive).limits, drive, wish)
    assert shares and max(shares) <= 1.0


def test_what_is_not_stated_is_what_was_recorded() -> None:
    """Nobody has said that the rig can do more."""
    limits = planned().limits
    places = np.concatenate([r["theta2"] for r in recordings()])
    assert limits.position[1] == pytest.approx([places.min(), places.max()], abs=1e-3)
    assert np.all(np.isinf(limits.reach))


@pytest.mark.long
def test_stated_limits_replace_what_was_recorded_one_for_all_or_one_each() -> None:
    stated = planned(ExperimentRequest(seconds=3.0, limits=TIGHT)).limits
    assert stated.speed.tolist() == [0.1, 0.2]
    one = planned(
        ExperimentRequest(seconds=3.0, limits=LimitsSpec.model_validate({"speed": 0.1}))
    ).limits
    assert one.speed.tolist() == [0.1, 0.1]


@pytest.mark.long
def test_a_weaker_limit_allows_more() -> None:
    strong, weak = (
        planned(ExperimentRequest(seconds=1.0, limits=LimitsSpec(torque=(x, x)))).chosen[0]
        for x in (40.0, 10.0)
    )
    assert max(strong.trial.amplitudes) > max(weak.trial.amplitudes)


SAME = 0.02
"""Relative: a fit's deviation also counts what its unknowns take from the errors."""


SLOW = 0.004
"""s between samples, in which the second beam swings more than once."""


@pytest.mark.long
def test_what_the_recordings_show_is_what_their_fit_states() -> None:
    """Not so with the few steps of a search, which damp a fast vibration."""
    document = scenario().model_dump()
    for one in document["recordings"]:
        one["simulate"]["sample_time"] = SLOW
    slow = Scenario.model_validate(document)
    seen = load_recordings(slow, base_model(slow), Path(), None, Silent())
    model = IdentifiedModel(fit_for_planning(slow, seen, Silent()))
    shown = model.deviations(model.known)
    for name, e in model.estimates.items():
        assert shown[name] == pytest.approx(e.std, rel=SAME)


def test_the_deviations_are_reached() -> None:
    found = planned()
    more = [replace(recorded(c, seed=k), name=f"p{k}") for k, c in enumerate(found.chosen)]
    begun = fit_for_planning(scenario(), [*recordings(), *more], Silent())
    reached = {e.name: e.std for e in final_parameters(with_robust_covariance(begun.base))}
    for d in found.deviations:
        assert d.after < d.before
        assert reached[d.estimate.name] == pytest.approx(d.after, rel=NEAR)


PAIR = ("coulomb_friction", "viscous_friction")


@pytest.mark.long
def test_the_experiment_that_tells_two_effects_apart_is_chosen() -> None:
    apart = planned(ExperimentRequest(seconds=1.0, between=PAIR), hidden=True)
    assert apart.decides and apart.chosen[0].score > TIE
    assert "They distinguish " in " ".join(plan_paragraphs(apart))


@pytest.mark.long
def test_effects_that_no_experiment_distinguishes_are_named() -> None:
    found = planned(ExperimentRequest(seconds=1.0, between=PAIR))
    assert not found.decides
    assert "distinguishes Coulomb friction and Viscous joint friction" in plan_paragraphs(found)[-1]


@pytest.mark.parametrize(
    ("wish", "sentence"),
    [
        (ExperimentRequest(parameters=("EI3",)), "EI3"),
        (ExperimentRequest(between=("friction", "tip_payload")), "friction"),
        (ExperimentRequest(limits=LimitsSpec(speed=(1.0, 1.0, 1.0))), "the arm has 2 joints"),
        (
            ExperimentRequest(
                limits=LimitsSpec(position=((5.0, 6.0),), reach=((8.0, 9.0), (8.0, 9.0)))
            ),
            "limits",
        ),
    ],
)
def test_a_wish_that_cannot_be_met_is_one_sentence(wish: ExperimentRequest, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        planned(wish)


def test_where_nothing_is_estimated_nothing_is_planned() -> None:
    asked = scenario()
    nothing = asked.identify.model_copy(update={"parameters": (), "start": {}})
    begun = fit_for_planning(asked.model_copy(update={"identify": nothing}), recordings(), Silent())
    with pytest.raises(InputError, match="improve no estimated parameter"):
        design(begun, ExperimentRequest(seconds=3.0), Silent())


def test_the_words_say_what_to_play_and_what_it_tells() -> None:
    said = " ".join(plan_paragraphs(planned()))
    assert "Record 3 experiments" in said and f"{100 * USED_SHARE:.0f} % of every limit" in said
    assert "Start at rest at θ₁ = " in said and "EI1" in said
