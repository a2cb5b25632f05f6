"""What a user says of the effects in the model counts in the diagnosis as it does in the fit; and
what an effect of no size led to is kept without it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from flexgui.core.diagnose.base_fit import BaseFit
from flexgui.core.diagnose.candidates import applicable, not_applicable, ruled_out
from flexgui.core.diagnose.diagnose import diagnose
from flexgui.core.diagnose.evidence import TIE, Round
from flexgui.core.diagnose.ladder import Ladder, ladder
from flexgui.core.diagnose.linear_screen import screen
from flexgui.core.diagnose.memo import Memo, ModelRound
from flexgui.core.diagnose.output_changes import trials
from flexgui.core.diagnose.removal_and_exchange import needed_effects
from flexgui.core.diagnose.search import Found, Move
from flexgui.core.diagnose.search_options import Options
from flexgui.core.effects import catalogue, effect
from flexgui.core.effects.sizes import typical
from flexgui.core.estimate.fit_result import fit, with_robust_covariance
from flexgui.core.estimate.fitted_model import FittedModel, fit_model
from flexgui.core.estimate.problem import (
    FitData,
    problem_of,
    undetectable_parameters,
    with_values,
)
from flexgui.core.identify.prepared_recording import prepare
from flexgui.core.identify.processing import Processing
from flexgui.core.progress import Silent
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.scenario.rig_spec import RigSpec
from flexgui.core.sensors import sensor
from flexgui.core.simulate.experiment import simulate_recording
from tests.diagnose import fits
from tests.diagnose.fits import on_paper
from tests.helpers import PAPER, looped

TRUE = 6.0
"""N m s/rad, viscous friction of joint 1; joint 2 has half of it."""


def begun(also: Mapping[str, Mapping[str, float]] | None = None, **friction: Any) -> BaseFit:
    """The paper's arm with friction, in a model that states it as given; `also`: what else its
    recording holds."""
    effects = [{"id": "viscous_friction", **friction}] if friction else []
    hidden = {"viscous_friction": {"fv1": TRUE, "fv2": TRUE / 2}, **(also or {})}
    return fits.begun(on_paper(
        model={"level": "nonlinear", "effects": effects},
        sensors={"camera_noise": 3e-5, "encoder_noise": 1e-5},
        identify={"parameters": ["EI"], "output": ["z", "encoder"]},
        recordings=[{"simulate": {"theta2": 1.2, "seconds": 0.4}, "hidden": hidden}],
    ))  # fmt: skip


@cache
def bare() -> BaseFit:
    return begun()


def test_a_parameter_that_is_not_to_vary_stays_where_it_was_stated() -> None:
    found = begun(fv1={"start": 5.0, "vary": False}, fv2=3.0)
    h = found.base.problem
    assert "fv1" not in h.unknowns.labels and "fv2" in h.unknowns.labels
    assert h.model.effect_values["fv1"] == 5.0
    more = [*h.model.effects, effect("tip_payload")]
    later = problem_of(found.data, more, h.values())
    assert later.model.effect_values["fv1"] == 5.0 and "fv1" not in later.unknowns.labels


def test_a_users_bounds_hold_in_the_diagnosis() -> None:
    at = begun(fv1={"start": 5.0, "upper": 5.5}, fv2=3.0).base.problem
    assert at.values()["fv1"] == pytest.approx(5.5)


SAME = 0.01
"""Relative, of a coefficient that is estimated from one short recording."""


def test_without_a_word_a_stated_effect_is_estimated() -> None:
    at = begun(fv1=5.0, fv2=2.0).base.problem
    assert at.values()["fv1"] == pytest.approx(TRUE, rel=SAME)


def test_the_last_effect_goes_too_where_the_others_do_as_well_without_it() -> None:
    """It has no size, and the friction before it now stands where it belongs."""
    data = bare().data
    viscous, payload = effect("viscous_friction"), effect("tip_payload")
    values = {**bare().base.problem.values(), "fv1": TRUE, "fv2": TRUE / 2, "mt2": 1e-6}
    whole = with_robust_covariance(
        fit(problem_of(data, [viscous, payload], values), None, lambda: False, 6)
    )
    kept = needed_effects(data, whole, [viscous, payload], 0, lambda: False)
    assert [e.kind for e in kept.effects] == ["viscous_friction"]
    assert np.isfinite(kept.refit.cost)


def test_an_effect_that_is_needed_stays_though_it_is_the_last() -> None:
    data = bare().data
    viscous = effect("viscous_friction")
    start = {**bare().base.problem.values(), "fv1": TRUE, "fv2": TRUE / 2}
    whole = with_robust_covariance(fit(problem_of(data, [viscous], start), None, lambda: False, 6))
    kept = needed_effects(data, whole, [viscous], 0, lambda: False)
    assert [e.kind for e in kept.effects] == ["viscous_friction"]


def test_unknowns_have_one_order_where_an_effect_is_stated_beside_first_places() -> None:
    """Else a vector was read with the labels of another, and every refit beside a stated effect
    ended far off."""
    found = begun(fv1=5.0, fv2=3.0)
    more = problem_of(found.data, [*found.base.problem.model.effects, effect("tip_payload")],
                      found.base.problem.values())  # fmt: skip
    assert "start_theta1@" in " ".join(more.unknowns.labels)
    again = with_values(found.data, more, refine=1)
    assert again.unknowns.labels == more.unknowns.labels


WORDS = RigSpec.words()
KINDS = sorted(catalogue())


def known(*statements: str) -> FitData:
    return replace(bare().data, stated_rig={name: WORDS[name] for name in statements})


def statements_of(kind: str) -> Iterator[str]:
    """By which the effect, or a part of it, cannot be."""
    one, data = effect(kind), bare().data
    yield one.ruled_out_by
    arm = one.changed_arm(data.bare.arm, {})
    yield from (k.ruled_out_by for k in one.parameters(arm, data.bare.drive, data.sizes))


@pytest.mark.parametrize("kind", KINDS)
def test_an_effect_names_statements_that_can_be_made(kind: str) -> None:
    assert set(statements_of(kind)) <= {"", *WORDS}


@pytest.mark.parametrize("statement", WORDS)
def test_each_statement_rules_something_out(statement: str) -> None:
    assert any(statement in statements_of(kind) for kind in KINDS)


@pytest.mark.parametrize("statement", WORDS)
@pytest.mark.parametrize("kind", KINDS)
def test_what_is_ruled_out_is_not_offered_with_the_reason_and_all_else_is(
    kind: str, statement: str
) -> None:
    data, before = known(statement), not_applicable(bare().data, [kind])
    if effect(kind).ruled_out_by == statement:
        assert not_applicable(data, [kind]) == {kind: f"Stated: {WORDS[statement]}."}
        assert ruled_out(data, [kind]) == {effect(kind).title: WORDS[statement]}
        assert applicable(data, [], [kind]) == []
    else:
        assert not_applicable(data, [kind]) == before
        assert effect(kind).title not in ruled_out(data, [kind])


def test_a_scale_is_ruled_out_sensor_by_sensor_and_as_a_whole_where_none_is_left() -> None:
    one, data = effect("sensor_gain"), known("gauges_calibrated")
    rig = replace(data.rig, outputs=("deflection", "encoder"))
    assert set(one.ruled_out(rig, data.sizes)) == {
        "error of the scale of gauge 1", "error of the scale of gauge 2",
    }  # fmt: skip
    alone = replace(rig, outputs=("deflection",))
    assert one.ruled_out(alone, data.sizes) == {one.title: "the strain gauges are calibrated"}


def test_a_rotor_is_where_the_motors_are_stated_to_have_it() -> None:
    rotor = [effect("rotor_inertia")]
    assert set(undetectable_parameters(known("direct_drive"), rotor)) == {"Jh2"}
    assert set(undetectable_parameters(known("gear_ratio"), rotor)) == {"Jr2"}
    assert undetectable_parameters(bare().data, rotor) == {}


def test_a_diagnosis_ranks_nothing_that_was_ruled_out_and_keeps_the_reason() -> None:
    asked = Options(
        max_effects=0, candidates=("gravity_tilt", "torque_offset"),
        stated_rig={"level": WORDS["level"]},
    )  # fmt: skip
    begun: Any = replace(bare(), data=known("level"))
    setup: Any = SimpleNamespace(model=SimpleNamespace(effects=()))
    found = diagnose(setup, SimpleNamespace(), (), asked, base_fit=begun)  # type: ignore[arg-type]
    assert [r.effect for r in found.ranking] == ["torque_offset"]
    assert found.not_applicable == {"gravity_tilt": "Stated: the rig is level."}
    assert found.ruled_out == {"Tilted base plate": "the rig is level"}


BARE = looped(PAPER)


def data(*outputs: str) -> FitData:
    recording = simulate_recording(BARE, SimulateSpec(theta2=1.2, seconds=0.1), "r")
    e = prepare(BARE, recording, [sensor(kind) for kind in outputs], Processing())
    return FitData(BARE, (e,), (), (np.ones(len(e.channels)),), {}, {}, typical(PAPER), 1)


@pytest.mark.parametrize(("kind", "letter"), [("sensor_delay", "t"), ("sensor_gain", "g")])
@pytest.mark.parametrize(("outputs", "own"), [(("z", "encoder"), "e"), (("deflection",), "g")])
def test_only_compared_channels_are_unknown_and_tried(kind, letter, outputs, own):
    seen = data(*outputs)
    tried = problem_of(seen, [effect(kind)], {})
    names = [f"{letter}{own}1", f"{letter}{own}2"]
    assert list(tried.unknowns.labels) == names
    others = {n: v for n, v in tried.model.effect_values.items() if n not in names}
    every = effect(kind).parameters(PAPER, BARE.drive, typical(PAPER))
    assert len(others) == len(every) - len(names) and not any(others.values())
    base = problem_of(seen, [], {})
    assert [t.parameter for t in trials(base, effect(kind), seen)] == names


NEVER = lambda: False  # noqa: E731
PAYLOAD = 0.02
"""kg at the tip: far above the noise, and little beside the friction."""
SMALL, LARGE = effect("tip_payload"), effect("viscous_friction")
"""Of which the recordings hold the second alone."""

WORSE = 2.0
"""Times the squared error of the minimum."""


@cache
def searched(payload: float = 0.0) -> tuple[Found, Memo]:
    """A search that came to both effects at once, in the wrong order."""
    given = begun({"tip_payload": {"mt2": payload}}) if payload else bare()
    base = FittedModel(given.data, given.base, ())
    values = {**given.base.problem.values(), "fv1": TRUE, "fv2": TRUE / 2, "mt2": 1e-3}
    last = fit_model(given.data, [SMALL, LARGE], values, NEVER)
    seen = screen(
        given.data, given.base.problem, [], [SMALL, LARGE, effect("torque_offset")]
    )  # fmt: skip
    memo = Memo(None, (), given.data.bare.arm.modes)
    first = Round(seen, (), None, base.refit, base.refit, base.data)
    memo.rounds[base.key] = ModelRound(base, first)
    return Found((Move(base), Move(last, "", (SMALL.kind, LARGE.kind))), ()), memo


def climbed() -> Ladder:
    return ladder(*searched(), Silent())


def test_what_explains_most_comes_first_and_the_last_rung_is_the_last_model() -> None:
    found = climbed()
    assert [rung.added for rung in found.rungs] == [None, LARGE, SMALL]
    assert [r.accepted for r in found.rounds] == ["viscous_friction", "tip_payload"]
    assert found.rungs[1].model.refit.cost < 0.1 * bare().base.cost  # it is all that is hidden
    assert found.rungs[-1].model.refit.problem is searched()[0].model.refit.problem


def test_each_effect_is_ranked_against_the_rung_before_it() -> None:
    first, second = climbed().rounds
    assert first.ranking[0].effect == "viscous_friction"
    assert (first.ranking[0].refit_drop_percent or 0.0) > 90.0  # of all that is hidden
    assert second.ranking[0].effect == "tip_payload"
    assert (second.ranking[0].refit_drop_percent or 0.0) < 50.0  # there is nothing left


def test_later_evidence_does_not_depend_on_all_that_the_model_as_given_lacked() -> None:
    """Beside errors of 29 noise floors an effect that was all but certain seemed to be nothing."""
    found = ladder(*searched(PAYLOAD), Silent())
    (evidence,) = (
        r.delta_bic for t in found.rounds for r in t.ranking[:1] if t.accepted == SMALL.kind
    )
    assert evidence is not None and evidence > TIE


class Stopped(Silent):
    """A person has pressed Stop."""

    def stopped(self) -> bool:
        return True


def test_a_search_that_is_stopped_has_the_rungs_that_there_are() -> None:
    found, memo = searched()
    assert [rung.added for rung in ladder(found, memo, Stopped()).rungs] == [None]


def test_the_better_minimum_of_the_model_as_given_is_its_own() -> None:
    """A search came from a worse minimum to a better one by an effect that is gone again."""
    data, best = bare().data, bare().base
    stuck = replace(best, descended=replace(best.descended, cost=WORSE * best.cost))
    base, last = FittedModel(data, stuck, ()), FittedModel(data, best, ())
    path = (Move(base), Move(last, "Without: Soft base", removed=("Soft base",)))
    (rung,) = ladder(Found(path, ()), Memo(None, (), data.bare.arm.modes), Silent()).rungs
    assert rung.model is last
