"""Noise that was estimated with a model that lacked something is estimated again with a better
one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from flexgui.core.diagnose.base_fit import BaseFit
from flexgui.core.diagnose.ladder import ladder
from flexgui.core.diagnose.memo import Memo
from flexgui.core.diagnose.noise_update import (
    LEAST_RATIO,
    against_noise_alone,
    higher_floors,
    lower_floors,
)
from flexgui.core.diagnose.remaining_error import remaining_error
from flexgui.core.diagnose.search import Found, Search
from flexgui.core.diagnose.search_options import Options
from flexgui.core.effects import effect
from flexgui.core.estimate.fit_result import FitResult, with_robust_covariance
from flexgui.core.estimate.fitted_model import FittedModel, fit_model
from flexgui.core.estimate.minimum import converge, with_simulated_deviations
from flexgui.core.estimate.problem import problem_of, within_noise
from flexgui.core.noise.noise_floor import UNCERTAINTY, Floor
from flexgui.core.noise.noise_propagation import (
    INITIAL_STATE_CHANGE,
    initial_state_responses,
    without_responses,
)
from flexgui.core.progress import Silent
from tests.diagnose import fits
from tests.diagnose.test_stated_effects import bare
from tests.helpers import rms

HIDDEN = 80.0
"""Times its size, that the noise seemed to be: the friction that is missing stays below."""

LARGER = 4.0
"""The same where the friction shows."""

REESTIMATED = 2.0
"""Factor within which floors of the same recording agree, whatever they were before."""


LINEAR = 0.05
"""Relative: what a linear step to the minimum with other weights misses of a cost."""

TRUE = {"EI1": 75.0, "EI2": 68.0, "cb": 8.7e-6}
"""The arm's mass swings on that base at 26 Hz."""


def never() -> bool:
    return False


def with_floors(times: float, uncertainty: float = 1.0) -> FittedModel:
    """The model as given, with floors that many times as large as they are."""
    given = bare()
    large = {
        n: Floor(times * f, times * f, "estimated", uncertainty)
        for n, f in given.data.floors.items()
    }
    return fit_model(given.data.in_floors(large), (), given.base.problem.values(), never)


def found_with(floors: float, kind: str = "torque_offset") -> FittedModel:
    """A model with one effect, by default of no use in the place of the friction; floors that many
    times as large as they are."""
    given = with_floors(floors)
    return fit_model(given.data, [effect(kind)], given.refit.problem.values(), never)


def searched(model: FittedModel, candidates: tuple[str, ...]) -> tuple[Found, Memo]:
    memo = Memo(None, (), model.data.bare.arm.modes)
    options = Options(max_effects=2, candidates=candidates)
    return Search(options, Silent(), None, memo).run(model), memo


def test_an_error_within_a_noise_that_is_too_large_is_above_the_true_one() -> None:
    model = found_with(HIDDEN)
    assert within_noise(model.data, model.refit.errors)
    floors = lower_floors(model, Options(), None, True)
    assert floors is not None
    seen = model.against(model.data.in_floors(floors))
    assert not within_noise(seen.data, seen.refit.errors)
    for name, value in bare().data.floors.items():
        assert 1.0 / REESTIMATED < seen.data.floors[name] / value < REESTIMATED


def test_a_model_against_another_noise_is_the_one_that_a_fit_in_that_noise_finds() -> None:
    model, data = found_with(HIDDEN, "viscous_friction"), bare().data
    seen = model.against(data)
    again = fit_model(data, model.effects, model.refit.problem.values(), never)
    assert seen.data.floors == data.floors
    assert seen.refit.cost == pytest.approx(again.refit.cost, rel=LINEAR)
    back = seen.against(model.data)
    assert back.refit.cost == pytest.approx(model.refit.cost, rel=LINEAR)


def test_all_that_is_stated_is_against_the_last_noise() -> None:
    given = with_floors(HIDDEN, UNCERTAINTY)
    found, memo = searched(given, ("viscous_friction", "torque_offset"))
    assert [e.kind for e in found.model.effects] == ["viscous_friction"]
    climbed = ladder(found, memo, Silent())
    floors = found.model.data.floors
    assert max(given.data.floors[n] / f for n, f in floors.items()) > LEAST_RATIO
    for step in climbed.steps(memo):
        assert {e.channel: e.floor for e in step.errors} == floors
    first, last = climbed.steps(memo)
    assert last.cost_per_sample < first.cost_per_sample / LARGER
    (tried,) = (r for r in climbed.rounds if r.accepted)
    assert tried.accepted == "viscous_friction"
    assert {r.effect for r in tried.ranking} == {"viscous_friction", "torque_offset"}


def test_an_estimated_floor_makes_no_verdict_that_is_finer_than_it_is_known() -> None:
    model = found_with(1.0, "viscous_friction")
    up = {n: Floor(f / 1.3, f / 1.3, "stated") for n, f in model.data.floors.items()}
    errors = [1.3 * x for x in model.refit.errors]
    left = remaining_error(model.data.in_floors(up), errors)
    assert left.above
    loose = {n: replace(f, source="estimated", uncertainty=UNCERTAINTY) for n, f in up.items()}
    left = remaining_error(model.data.in_floors(loose), errors)
    assert left.above_floors and not left.above


def test_floors_that_are_right_stay() -> None:
    model = found_with(1.0, "viscous_friction")
    assert within_noise(model.data, model.refit.errors)
    assert lower_floors(model, Options(), None, True) is None


def test_what_a_person_tolerates_is_seen_against_the_noise_alone() -> None:
    model = found_with(HIDDEN)
    seen = against_noise_alone(model, Options())
    assert seen is not None and not within_noise(seen.data, seen.refit.errors)
    left = remaining_error(seen.data, seen.refit.errors)
    assert left.above and not left.beyond_tolerance
    assert against_noise_alone(seen, Options()) is None
    assert against_noise_alone(found_with(HIDDEN, "viscous_friction"), Options()) is None


def test_a_lower_noise_that_no_effect_confirms_changes_nothing() -> None:
    given = with_floors(LARGER)
    found, _ = searched(given, ("gravity_tilt",))
    assert not found.proposed and found.model.effects == ()
    assert found.model.data.floors == given.data.floors


def on_a_soft_base() -> tuple[FittedModel, BaseFit]:
    """A torque rig with the base in the model, and the floors of the arm on a rigid one."""
    beams = (0.64, 2.8, 75.0, 0.12), (0.69, 1.5, 68.0, 0.077)
    segments = [
        {"length": L, "mass": m, "EI": EI, "hub_inertia": J, "modes": 1} for L, m, EI, J in beams
    ]
    hidden = {"base_compliance": {"cb": TRUE["cb"]}}
    given = fits.begun(fits.on_paper(
        arm={"segments": segments},
        drive={"kind": "torque"},
        sensors={"encoder_noise": 3e-6},
        identify={"parameters": ["EI1", "EI2"], "filter": {"cutoff_hz": 60.0}},
        recordings=[{"simulate": {"theta2": 1.2, "seconds": 1.0}, "hidden": hidden}],
    ))  # fmt: skip
    added = (effect("base_compliance"),)
    return FittedModel(
        *converge(given.data, problem_of(given.data, added, TRUE), None, never), added
    ), given


def above(model: FittedModel) -> float:
    """The error of the worst channel, in noise floors."""
    return max(remaining_error(model.data, model.refit.errors).by_channel.values())


@pytest.mark.long
def test_noise_shakes_an_arm_on_a_soft_base_more_than_one_on_rock() -> None:
    model, _ = on_a_soft_base()
    assert above(model) > UNCERTAINTY  # with the model complete
    floors = higher_floors(model, Options(), True)
    assert floors is not None and floors["u1"].value > LEAST_RATIO * model.data.floors["u1"]
    assert all(f.value >= model.data.floors[name] for name, f in floors.items())
    seen = model.against(model.data.in_floors(floors))
    assert above(seen) < UNCERTAINTY
    assert higher_floors(seen, Options(), True) is None


def test_noise_does_not_move_an_arm_whose_joints_are_not_prescribed() -> None:
    model = found_with(1.0 / HIDDEN, "viscous_friction")
    assert higher_floors(model, Options(), True) is None


def test_weights_of_single_recordings_keep_their_ratios() -> None:
    model, data = found_with(1.0, "viscous_friction"), bare().data
    twice = {n: Floor(2.0 * f, 2.0 * f, "stated") for n, f in data.floors.items()}
    seen = model.against(data.in_floors(twice))
    for old, new in zip(model.data.weights, seen.data.weights, strict=True):
        assert np.allclose(new, 0.5 * old, rtol=EXACT)


NOISE = 1e-5
"""rad, of both encoders."""

SEEDS = range(6)

WIDE_ENOUGH = 1.64
"""Deviations, rms over the seeds: of six right ones it is exceeded once in a hundred (chi square of
six is 16.2)."""


EQUAL = 1e-12
"""Relative: correlations are only multiplied and divided."""


@cache
def begun(seed: int) -> BaseFit:
    """The paper's arm under recorded torques, with nothing hidden."""
    return fits.begun(fits.on_paper(
        drive={"kind": "torque"},
        sensors={"encoder_noise": NOISE},
        identify={"parameters": ["EI", "m2"]},
        recordings=[{"simulate": {
            "theta2": 1.2, "seconds": 1.0, "sample_time": 0.002, "seed": seed,
            "excitation": "prbs", "amplitude": 2.0, "hold": 0.05,
        }}],
    ))  # fmt: skip


def off(refit: FitResult) -> float:
    """Deviations by which EI is off."""
    h = refit.problem
    k = h.unknowns.labels.index("EI")
    true = begun(0).data.nuisance[0].parameter.value  # the paper's
    return float((h.vector[k] - true) / np.sqrt(refit.covariance[k, k]))


@pytest.mark.long
def test_deviations_hold_what_the_noise_did_to_the_estimates() -> None:
    plain = {seed: with_robust_covariance(begun(seed).base) for seed in SEEDS}
    wide = [
        off(with_simulated_deviations(begun(seed).data, fit, {})) for seed, fit in plain.items()
    ]
    assert rms(wide) < WIDE_ENOUGH < rms([off(fit) for fit in plain.values()])


def test_no_deviation_becomes_smaller_and_correlations_stay() -> None:
    before = with_robust_covariance(begun(0).base)
    after = with_simulated_deviations(begun(0).data, before, {})
    own = [np.sqrt(np.diag(fit.covariance)) for fit in (before, after)]
    assert np.all(own[1] >= own[0]) and np.any(own[1] > own[0])
    apart = [fit.covariance / np.outer(s, s) for fit, s in zip((before, after), own, strict=True)]
    assert apart[1] == pytest.approx(apart[0], rel=EQUAL)


SILENT = 1e-9
"""rad: encoders that tell nothing of a noise."""


def test_without_noise_deviations_stay_as_they_are() -> None:
    before = with_robust_covariance(begun(0).base)
    stated = {"theta1": SILENT, "theta2": SILENT}
    assert with_simulated_deviations(begun(0).data, before, stated).covariance == pytest.approx(
        before.covariance
    )


def test_what_has_no_deviation_gets_none() -> None:
    before = with_robust_covariance(begun(0).base)
    before.covariance[:] = np.nan
    assert with_simulated_deviations(begun(0).data, before, {}) is before


TIMES = np.linspace(0.0, 3.0, 400)
SWINGS = np.stack([np.cos(9.0 * TIMES), np.sin(9.0 * TIMES)], axis=-1)
LARGE = np.array([[1.0, 200.0]])
"""Two channels in units of their own."""

EXACT = 1e-9


def compared(values: Mapping[str, float]) -> np.ndarray:
    """(M, 2): both channels swing by the first state."""
    swing = SWINGS @ np.array([values["start_v1_1"], values["start_dv1_1"]])
    return swing[:, None] * LARGE + values["EI"]


VALUES: dict[str, float] = {"EI": 3.0, "start_v1_1": 0.2, "start_dv1_1": -0.4}


def answers_of() -> np.ndarray:
    answers = initial_state_responses(VALUES, compared(VALUES), compared)
    assert answers is not None
    return answers


def test_a_first_state_is_changed_a_little_and_nothing_else() -> None:
    answers = answers_of()
    assert answers == pytest.approx(
        INITIAL_STATE_CHANGE * SWINGS[:, None, :] * LARGE[..., None], rel=1e-6
    )
    assert initial_state_responses({"EI": 3.0}, np.zeros((400, 2)), compared) is None


def test_what_it_explains_goes_and_noise_stays() -> None:
    answers = answers_of()
    noise = np.random.default_rng(0).standard_normal((len(TIMES), 2)) * 1e-3 * LARGE
    shaken = (SWINGS @ np.array([0.7, -3.0]))[:, None] * LARGE
    left = without_responses(shaken + noise, answers)
    assert np.abs(without_responses(shaken, answers)).max() < EXACT * np.abs(shaken).max()
    assert np.std(left, axis=0) == pytest.approx(np.std(noise, axis=0), rel=0.02)


def test_samples_that_nobody_took_stay_empty() -> None:
    answers = answers_of()
    shaken = (SWINGS @ np.array([0.7, -3.0]))[:, None] * LARGE
    gaps = shaken.copy()
    gaps[50:80, 1] = np.nan
    left = without_responses(gaps, answers)
    assert np.isnan(left[50:80, 1]).all() and np.isfinite(left[:50]).all()
    assert np.nanmax(np.abs(left)) < EXACT * np.abs(shaken).max()
    assert without_responses(gaps, None) is gaps


def test_a_channel_without_noise_stays_so() -> None:
    """As encoders of a simulation are, whose camera has some."""
    answers = answers_of()
    none = np.zeros((len(TIMES), 2))
    assert not without_responses(none, answers).any()
    one = np.where(np.arange(2) == 0, np.cos(9.0 * TIMES)[:, None], 0.0)
    assert np.isfinite(without_responses(one, answers)).all()


HELD = 0.1
"""Of what noise moves an estimate by without a prior that is ten times as sharp."""


def test_noise_moves_an_estimate_less_that_a_prior_holds() -> None:
    """The draws counted as if nothing were known."""
    start = begun(0).base.problem
    k = start.unknowns.labels.index("EI")
    free = with_robust_covariance(begun(0).base)
    known = 0.1 * float(np.sqrt(free.covariance[k, k]))
    items = list(start.unknowns.items)
    items[k] = replace(items[k], parameter=replace(items[k].parameter, prior_std=known))
    sharp = replace(start, unknowns=replace(start.unknowns, items=tuple(items)))
    before = with_robust_covariance(replace(free, problem=sharp))
    loose, held = (with_simulated_deviations(begun(0).data, fit, {}) for fit in (free, before))
    assert held.covariance[k, k] < HELD**2 * loose.covariance[k, k]
