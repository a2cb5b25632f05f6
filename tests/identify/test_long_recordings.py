"""Long recordings: searched on their beginnings, refined as a whole, stopped at any moment."""

from __future__ import annotations

import time

import numpy as np
import pytest

from flexgui.core.arm.build import ArmSpec, build_arm
from flexgui.core.drives import build_drive
from flexgui.core.identify import fit
from flexgui.core.identify.defect_correction import corrected_minimum, with_enough_steps, with_steps
from flexgui.core.identify.fit import Fitted, identify
from flexgui.core.identify.predictor import Predictor
from flexgui.core.identify.prepared_recording import Prepared, prepare
from flexgui.core.identify.processing import Processing
from flexgui.core.identify.refinement import refine
from flexgui.core.identify.residuals import Residuals, channel_weights
from flexgui.core.identify.uncertainty import cross_covariances
from flexgui.core.identify.unknowns import collect_unknowns
from flexgui.core.least_squares import bounds_and_prior
from flexgui.core.model import Model
from flexgui.core.progress import Progress, Silent, StoppedError, use_progress
from flexgui.core.recording.recording import Recording
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.results import Generation
from flexgui.core.scenario.schema import IdentifySpec
from flexgui.core.sensors import sensor
from flexgui.core.simulate import motion
from flexgui.core.simulate.batch import Job, run, run_many
from flexgui.core.simulate.experiment import NoiseLevels, simulate_recording

TRUTH = 1e9 * 0.05**4 / 12.0
SPEC = IdentifySpec(parameters=("EI1", "EI2"), start={"EI1": 1.3 * TRUTH, "EI2": 0.7 * TRUTH})
SAMPLES = 2_000

FINE = 256
"""Steps per sample of a reference: its own error is below a hundredth of a deviation."""
SAME = 0.1
"""Deviations within which two answers are the same."""

SOON = 1.0
"""s from the wish to stop until there is an answer."""


class Told(Silent):
    """Stops after a text that holds `word` has come `times` times."""

    def __init__(self, word: str = "", times: int = 1) -> None:
        self.word, self.left, self.texts = word, times, list[str]()
        self.since: float | None = None

    def advance(self, n: int = 1, text: str = "") -> None:
        self.texts.append(text)
        if self.word and self.word in text:
            self.left -= 1
            if not self.left:
                self.since = time.process_time()

    def generation(self, fit_label: str, generation: Generation) -> None:
        """Say nothing."""

    def stopped(self) -> bool:
        return self.since is not None


def with_modes(modes: int) -> Model:
    """The paper's arm with so many modes per segment, and all its equations."""
    arm = build_arm(ArmSpec.model_validate({"preset": "paper", "modes": modes}))
    return Model(arm, build_drive("velocity_loop", {"gains": [60.0, 30.0]}), level="nonlinear")


def recorded(model: Model, sample_time: float) -> Recording:
    """With references that jump, by a good camera and encoders."""
    asked = SimulateSpec(
        theta2=1.2, seconds=sample_time * SAMPLES, sample_time=sample_time, seed=2,
        excitation="prbs", level="nonlinear",
    )  # fmt: skip
    return simulate_recording(model, asked, "a", noise=NoiseLevels({"z": 3e-5, "encoder": 1e-5}))


@pytest.fixture(scope="module")
def model() -> Model:
    return with_modes(1)


@pytest.fixture(scope="module")
def recording(model: Model) -> Recording:
    return recorded(model, 0.5e-3)


def _prepared(model: Model, recording: Recording) -> Prepared:
    return prepare(model, recording, [sensor("z"), sensor("encoder")], Processing())


def _identify(model: Model, recording: Recording, progress: Progress) -> Fitted:
    unknowns = collect_unknowns(model, SPEC, [recording])
    return identify("a", [_prepared(model, recording)], unknowns, SPEC, {}, progress)


def test_a_search_on_the_beginnings_leads_to_the_answer_of_all_samples(
    model: Model, recording: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    linear = model.at_level("lpv")
    whole = _identify(linear, recording, Silent())
    monkeypatch.setattr(fit, "SEARCH_SAMPLES", SAMPLES // 4)
    found = _identify(linear, recording, Silent())
    deviations = np.array([e.std for e in whole.fit.estimates])
    assert len(found.fit.convergence) == len(whole.fit.convergence) > 1
    assert found.fit.convergence[-1].best < 0.5 * whole.fit.convergence[-1].best
    assert np.all(np.abs(found.vector - whole.vector) < SAME * deviations)
    assert found.fit.residual_count == whole.fit.residual_count


def test_a_stop_leaves_what_was_found_by_then(model: Model, recording: Recording) -> None:
    told = Told("refining, cost")
    found = _identify(model, recording, told)
    assert told.since is not None
    assert time.process_time() - told.since < SOON
    assert found.fit.stopped
    assert np.all(np.isfinite(found.vector)) and np.isfinite(found.fit.cost)


def test_a_stop_before_any_estimate_leaves_the_start(model: Model, recording: Recording) -> None:
    found = _identify(model, recording, Told("first vibrations"))
    assert found.fit.stopped
    assert found.vector == pytest.approx([e.start for e in found.fit.estimates])


class Patient(Silent):
    """Stops when asked for the n-th time whether it wishes to."""

    def __init__(self, patience: int) -> None:
        self.left = patience

    def stopped(self) -> bool:
        self.left -= 1
        return self.left < 0


PATIENCE = (0, 1, 2, 3, 5)


def test_whenever_a_stop_comes_the_start_has_the_same_cost() -> None:
    """Within the comparison of starts, one step per sample was left for the summary."""
    model = with_modes(2)
    swings = recorded(model, 4e-3)
    ends = [_identify(model, swings, Patient(n)).fit for n in PATIENCE]
    costs = [f.cost for f in ends if all(e.value == e.start for e in f.estimates)]
    assert all(f.stopped for f in ends)
    assert len(costs) > 3 and set(costs) == {costs[0]}


def one_step_per_sample(model: Model, recording: Recording) -> Residuals:
    experiments = [_prepared(model, recording)]
    unknowns = collect_unknowns(model, SPEC, [recording])
    return Residuals(Predictor(experiments, unknowns, steps=1), channel_weights(experiments, {}))


LEFT = 0.1
"""Of what noise leaves, rms: what twice the steps of a search may change."""


def test_what_a_search_sees_is_what_noise_leaves_and_not_its_steps() -> None:
    """Far from the minimum more is left, and fewer steps show it as well."""
    model = with_modes(3)
    one = one_step_per_sample(model, recorded(model, 1e-3))
    start, truth = one.unknowns.parameters.vector(), np.array([TRUTH, TRUTH])
    enough = with_enough_steps(one, truth)
    steps = enough.predictor.steps
    assert steps is not None
    left, finer = enough(truth), with_steps(enough, 2 * steps)(truth)
    assert np.linalg.norm(finer - left) < LEFT * np.linalg.norm(finer)
    assert np.linalg.norm(one(truth) - finer) > np.linalg.norm(finer)
    assert (with_enough_steps(one, start).predictor.steps or 0) < steps


def test_a_stop_within_the_first_simulation_of_a_descent_leaves_its_start(
    model: Model, recording: Recording
) -> None:
    residuals = one_step_per_sample(model, recording)
    start = residuals.unknowns.parameters.vector()
    with use_progress(Patient(0)):
        found = refine(residuals, start, lambda _: False)
    assert found.stopped_before_first_step and np.array_equal(found.vector, start)


def test_stretches_change_nothing(
    model: Model, recording: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    task = _prepared(model, recording).task
    numbers = model.numbers()
    jobs = [Job(model, numbers, task), Job(model, model.numbers({"EI1": 300.0}), task)]
    alone, together = run(model, numbers, task, 2), run_many(jobs, 2)
    monkeypatch.setattr(motion, "STRETCH_STEPS", 501)
    again = run(model, numbers, task, 2)
    assert np.array_equal(alone.q, again.q) and np.array_equal(alone.torque, again.torque)
    for a, b in zip(together, run_many(jobs, 2), strict=True):
        assert np.array_equal(a.q, b.q) and np.array_equal(a.torque, b.torque)


@pytest.mark.parametrize("workers", [1, 2])
def test_simulations_look_whether_they_are_wanted(
    model: Model, recording: Recording, workers: int
) -> None:
    task = _prepared(model, recording).task
    told = Told("x")
    told.advance(text="x")
    jobs = [Job(model, model.numbers(), task)] * 20
    with use_progress(told), pytest.raises(StoppedError):
        run_many(jobs, 2, workers)
    assert len(run_many(jobs[:1], 1)) == 1  # outside nobody listens


@pytest.mark.parametrize(
    ("modes", "sample_time"), [(1, 0.5e-3), pytest.param(3, 1e-3, marks=pytest.mark.long)]
)
def test_the_last_step_takes_the_error_of_few_steps_off(modes: int, sample_time: float) -> None:
    """Against a step whose simulations are all fine; slopes with few steps of the fast vibrations
    of three modes led two and a half deviations away."""
    model = with_modes(modes)
    recording = recorded(model, sample_time)
    found = _identify(model, recording, Silent())
    experiments = [_prepared(model, recording)]
    predictor = Predictor(experiments, collect_unknowns(model, SPEC, [recording]), steps=FINE)
    exact = Residuals(predictor, channel_weights(experiments, {}))
    slopes = exact.vector(exact.slopes(found.vector))
    step = np.linalg.lstsq(slopes, exact(found.vector), rcond=None)[0]
    deviations = np.array([e.std for e in found.fit.estimates])
    assert np.all(np.abs(step) < SAME * deviations)


def test_corrected_steps_lead_to_the_minimum_from_far_away(
    model: Model, recording: Recording
) -> None:
    whole = _identify(model, recording, Silent())
    residuals = one_step_per_sample(model, recording)
    start = whole.vector * np.array([1.02, 0.98])
    slopes, limits = residuals.slopes(start), bounds_and_prior(residuals.unknowns.parameters)
    _, found = corrected_minimum(residuals, start, slopes, limits)
    deviations = np.array([e.std for e in whole.fit.estimates])
    assert np.all(np.abs(start - whole.vector) > 5.0 * deviations)
    assert np.all(np.abs(found.vector - whole.vector) < SAME * deviations)


def test_where_a_simulation_diverges_no_minimum_is_stated(
    model: Model, recording: Recording
) -> None:
    residuals = one_step_per_sample(model, recording)
    start = residuals.unknowns.parameters.vector()
    slopes, limits = residuals.slopes(start), bounds_and_prior(residuals.unknowns.parameters)
    _, found = corrected_minimum(residuals, np.full(len(start), np.nan), slopes, limits)
    assert not np.isfinite(found.cost)


@pytest.mark.parametrize("lag", [0, 1, 50, 200])
def test_covariances_by_transform_are_those_by_products(lag: int) -> None:
    r = np.random.default_rng(3).standard_normal((500, 3)).cumsum(axis=0)
    found = cross_covariances(r, 200)
    wanted = r[: 500 - lag].T @ r[lag:] / 500
    assert found[lag] == pytest.approx(wanted, abs=1e-9 * np.abs(found).max())
