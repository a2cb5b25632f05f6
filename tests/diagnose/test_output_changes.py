"""The directions in which candidates move the outputs are slopes, however large they are tried."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flexgui.core.arm.arm import Arm, Segment
from flexgui.core.diagnose import output_changes
from flexgui.core.diagnose.candidates import applicable
from flexgui.core.diagnose.output_changes import (
    LARGEST_CHANGE,
    SMALLEST_SHARE,
    BaseErrors,
    OutputChange,
    Trial,
    as_small_as,
    simulate_output_changes,
    trials,
)
from flexgui.core.drives.velocity_loop import VelocityLoop
from flexgui.core.effects import effect
from flexgui.core.effects.sizes import typical
from flexgui.core.estimate.problem import FitData, Problem, problem_of
from flexgui.core.identify.prepared_recording import prepare
from flexgui.core.identify.processing import Processing
from flexgui.core.model import Model
from flexgui.core.sensors import sensor
from tests.helpers import from_rest, read, simulate_fixed

ARM = Arm(segments=(Segment(length=0.4, mass=2.0, EI=120.0, hub_inertia=0.02, modes=1),))
DRIVE = VelocityLoop(gains=(900.0,))
"""N m s/rad: so stiff that nothing damps the beam, which swings forty times."""

STEP, SAMPLES, STOPS = 2e-3, 600, 40
NOISE = 2e-4
"""m, of the camera."""

MISSED = 3.0
"""In noise: how far the outputs are off."""

SMALL = 1e-3
"""Of the size tried, for a slope by differences."""

PARALLEL = 0.95
"""Cosine between what was tried and the slope: the secant of a vibration that is out of step by a
third of what it is asked to explain."""

LINEAR = 5.0
"""Times what a straight line gives; friction with few steps is no straight line."""


@pytest.fixture(scope="module")
def data() -> FitData:
    bare = Model(ARM, DRIVE, "nonlinear")
    speeds = np.zeros((SAMPLES, 1))
    speeds[:STOPS] = 0.4
    task = from_rest(bare, [0.2], speeds, STEP)
    recording = read(bare, task, simulate_fixed(bare, bare.numbers(), task, 16), "z", "encoder")
    camera = sensor("z")
    names = [c.name for c in camera.channels(ARM)]
    noise = MISSED * NOISE * np.random.default_rng(1).standard_normal((SAMPLES, len(names)))
    for k, name in enumerate(names):
        recording.channels[name] += noise[:, k]
    one = prepare(bare, recording, [camera], Processing())
    floors = dict.fromkeys(names, NOISE)
    weights = (np.full(len(names), 1.0 / NOISE),)
    return FitData(bare, (one,), (), weights, floors, {}, typical(ARM), 8)


def base_and_trial(data: FitData, kind: str) -> tuple[Problem, Trial]:
    base = problem_of(data, (), {})
    (trial, *_) = trials(base, effect(kind), data)
    return base, trial


def column(data: FitData, base: Problem, trial: Trial) -> OutputChange:
    (change,) = simulate_output_changes(data, base, (), [trial], BaseErrors(base))
    return change


def times_as_large(trial: Trial, factor: float) -> Trial:
    sizes = {name: factor * x for name, x in trial.sizes.items()}
    values = {n: v + (factor - 1.0) * trial.sizes.get(n, 0.0) for n, v in trial.values.items()}
    return replace(trial, values=values, sizes=sizes)


def rms(blocks: tuple[np.ndarray, ...]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(blocks) ** 2)))


@pytest.mark.parametrize("factor", [1.0, 30.0, 1000.0])
@pytest.mark.parametrize("kind", ["cubic_stiffness", "tip_payload", "link_mass_error"])
def test_a_size_that_puts_vibrations_out_of_step_is_made_smaller(
    data: FitData, kind: str, factor: float
) -> None:
    base, trial = base_and_trial(data, kind)
    found = column(data, base, times_as_large(trial, factor))
    small = column(data, base, times_as_large(trial, SMALL))
    a, b = (np.concatenate(c.blocks).ravel() for c in (found, small))
    assert 0.0 < rms(found.blocks) <= LARGEST_CHANGE * MISSED
    assert a @ b / np.sqrt((a @ a) * (b @ b)) > PARALLEL
    assert found.values[found.parameter] - trial.values[found.parameter] == pytest.approx(
        found.sizes[found.parameter] - trial.sizes[found.parameter]
    )


def test_a_sensitivity_vanishes_with_its_size_though_an_effect_includes_another(
    data: FitData,
) -> None:
    """Stribeck friction moved the outputs by what Coulomb friction of a plausible size does."""
    base = problem_of(data, (), {})
    slopes = [t for c in applicable(data, ()) for t in trials(base, c, data) if not t.scanned]
    assert any(t.effect.includes for t in slopes)
    for trial in slopes:
        found, small = (column(data, base, times_as_large(trial, x)) for x in (1.0, SMALL))
        ratio = abs(small.sizes[trial.parameter] / found.sizes[trial.parameter])
        assert rms(small.blocks) <= LINEAR * ratio * rms(found.blocks), trial.effect.kind


def test_what_moves_the_outputs_less_than_they_are_off_is_tried_as_it_is(data: FitData) -> None:
    base, trial = base_and_trial(data, "viscous_friction")
    found = column(data, base, trial)
    assert rms(found.blocks) < LARGEST_CHANGE * MISSED
    assert found.values == trial.values


def test_a_size_at_which_the_simulation_comes_apart_is_tried_nearer_to_neutral(
    data: FitData, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One of a grid became a column of zeros, which explains nothing, without a word."""
    base, trial = base_and_trial(data, "link_mass_error")
    trial = replace(trial, scanned=True)
    whole = column(data, base, trial)
    most = max(float(np.abs(b).max()) for b in whole.blocks)
    monkeypatch.setattr(output_changes, "DIVERGED", 0.5 * most)
    found = column(data, base, trial)
    assert not found.diverged and 0.0 < rms(found.blocks) < rms(whole.blocks)
    assert found.sizes[found.parameter] == pytest.approx(
        SMALLEST_SHARE * trial.sizes[trial.parameter]
    )


@pytest.mark.parametrize("tries", [1, 2])
def test_the_outputs_change_as_simulated_at_the_stated_size(
    data: FitData, monkeypatch: pytest.MonkeyPatch, tries: int
) -> None:
    """After the last try, too, of a size that would have to be smaller still."""
    monkeypatch.setattr(output_changes, "SMALLER_TRIES", tries)
    base, trial = base_and_trial(data, "tip_payload")
    found = column(data, base, times_as_large(trial, 1000.0))
    monkeypatch.setattr(output_changes, "SMALLER_TRIES", 1)
    again = column(data, base, replace(trial, values=found.values, sizes=found.sizes))
    assert again.blocks[0] == pytest.approx(found.blocks[0], abs=0.0)


def test_what_comes_apart_at_every_size_is_said(
    data: FitData, monkeypatch: pytest.MonkeyPatch
) -> None:
    base, trial = base_and_trial(data, "link_mass_error")
    monkeypatch.setattr(output_changes, "DIVERGED", 0.0)
    found = column(data, base, trial)
    assert found.diverged and rms(found.blocks) == 0.0


def test_a_smaller_size_begins_at_neutral_to_the_last_digit() -> None:
    """A rounded neutral of -3e-25 was no compliance that an arm could have."""
    rng = np.random.default_rng(7)
    for size, share in rng.uniform(1e-9, 1.0, (200, 2)):
        values, sizes = {"cb": size, "shape": 0.3}, {"cb": size}
        trial = Trial(effect("drive_gain"), "cb", values, sizes, True, False, ())
        other = OutputChange(
            **{**vars(trial), "sizes": {"cb": share * size}}, blocks=(np.zeros((1, 1)),)
        )
        smaller = as_small_as(trial, [other])
        assert smaller.values["cb"] - smaller.sizes["cb"] == 0.0
        assert smaller.sizes["cb"] == pytest.approx(share * size)
        assert smaller.values["shape"] == 0.3
