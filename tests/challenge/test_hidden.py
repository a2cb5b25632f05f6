"""Hidden effects show as much as was asked for; the noise beside them is the stated one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pytest
from scipy.optimize import least_squares

from flexgui.core.challenge.challenge_rig import (
    AR_COEFFICIENT,
    AR_COEFFICIENTS,
    STDS,
    STEPS,
    Experiment,
    bare_model,
    noise,
    readings,
    simulate_exactly,
)
from flexgui.core.challenge.detectability import CLOSE, Detectability, UnreachableError, crossing
from flexgui.core.challenge.hidden_effect import (
    candidates,
    hide_effect,
    parameters_on,
)
from flexgui.core.effects import effect
from flexgui.core.model import Model
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.simulate.batch import run
from flexgui.core.simulate.motion import Task
from flexgui.core.simulate.nonlinear import simulate_within


def least_squares_rest(truth: Model, bare: Model, experiments: Sequence[Experiment]) -> float:
    """Root mean square, in noise rms, of what SciPy's fit of EI and the starts leaves."""
    seen = [readings(truth, simulate_exactly(truth, e.task(truth))) for e in experiments]
    EI = bare.parameters["EI"].value
    weights = 1.0 / np.array(list(STDS.values()))

    def errors(x: np.ndarray) -> np.ndarray:
        numbers = bare.numbers({"EI": EI * (1.0 + x[0])})
        parts = []
        for k, (e, y) in enumerate(zip(experiments, seen, strict=True)):
            motion = simulate_within(bare, numbers, _moved(e.task(bare), x[1 + 2 * k : 3 + 2 * k]))
            parts.append((y - readings(bare, motion.trajectory)) * weights)
        return np.concatenate([p.ravel() for p in parts])

    start = np.zeros(1 + 2 * len(experiments))
    found = least_squares(errors, start, x_scale=[1e-2, *[1e-4] * (len(start) - 1)])
    return float(np.sqrt(2.0 * found.cost / len(errors(start))))


def _moved(task: Task, angles: np.ndarray) -> Task:
    start = task.start.copy()
    start[: len(angles)] += angles
    return Task(task.time, task.references, start, task.schedule)


EXPERIMENTS = [
    Experiment(f"r{k}", SimulateSpec(theta2=x, seconds=0.3, seed=k + 1))
    for k, x in enumerate((0.5, 2.0))
]

STRONG = 3.0
"""How much what is hidden shows: noise rms per sample."""

REFERENCE = 0.1
"""Relative: the reference takes exact simulations and bends the nominal parameters for good, the
sizing takes fixed steps and straight lines."""

ABSORBED = 0.01
"""What a thousandth of the stiffness leaves, being no straight line."""


@pytest.fixture(scope="module")
def detectability() -> Detectability:
    return Detectability(bare_model(), EXPERIMENTS)


@pytest.mark.parametrize("kind", ["viscous_friction", "tip_payload", "camera_delay"])
def test_the_rest_after_a_fit_of_the_nominal_parameters_is_what_was_asked_for(
    kind: str, detectability: Detectability
) -> None:
    h = hide_effect(effect(kind), detectability, STRONG, np.random.default_rng(3))
    assert h.level == pytest.approx(STRONG, rel=CLOSE)
    truth = bare_model().with_effects([h.effect], h.values)
    rest = least_squares_rest(truth, bare_model(), EXPERIMENTS)
    assert rest == pytest.approx(STRONG, rel=REFERENCE)


@pytest.mark.parametrize("kind", sorted(candidates()))
def test_twice_the_noise_needs_more_than_the_noise(kind: str, detectability: Detectability) -> None:
    found = [
        hide_effect(effect(kind), detectability, level, np.random.default_rng(3))
        for level in (1.0, 2.0)
    ]
    assert [h.level for h in found] == pytest.approx([1.0, 2.0], rel=CLOSE)
    apart = [_from_neutral(kind, h.values) for h in found]
    assert np.all(apart[1] > apart[0])


NEVER = 1e6
"""A neutral value that is no end of a line: a limit that nothing reaches."""


def _from_neutral(kind: str, values: Mapping[str, float]) -> np.ndarray:
    """Distance of each size from neutral; of a limit, its inverse."""
    sizes = [k for k in parameters_on(effect(kind), bare_model()) if not k.secondary]
    pairs = [(values[k.parameter.name], k.neutral) for k in sizes]
    return np.array([abs(x - zero) if zero < NEVER else 1.0 / x for x, zero in pairs])


def test_what_the_nominal_parameters_can_absorb_does_not_count(
    detectability: Detectability,
) -> None:
    EI = bare_model().parameters["EI"].value
    softer = bare_model().numbers({"EI": EI * (1.0 - 1e-3)})
    shown = [
        readings(bare_model(), run(bare_model(), softer, t, STEPS)) for t in detectability.tasks
    ]
    plain = np.sqrt(np.mean(
        [((a - b) / np.array(list(STDS.values()))) ** 2
         for a, b in zip(shown, detectability.plain, strict=True)]
    ))  # fmt: skip
    assert plain > 0.05
    assert detectability.seen(shown) < ABSORBED * plain


def test_a_crossing_is_the_first_one_from_neutral() -> None:
    m, found = crossing(lambda m: m if m < 8.0 else 100.0 / m, 4.0)
    assert m == pytest.approx(4.0, rel=CLOSE) and found == pytest.approx(4.0, rel=CLOSE)


@pytest.mark.parametrize("shown", [lambda m: 0.0, lambda m: 7.0, lambda m: float("nan")])
def test_what_no_size_shows_is_said(shown) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(UnreachableError):
        crossing(shown, 3.0)


def test_neither_a_level_of_the_model_nor_what_needs_other_effects_is_hidden() -> None:
    never = {"large_motion", "presliding_friction", "joint_elasticity", "backlash"}
    assert candidates() and not never & set(candidates())


SAMPLES = 200_000
SCATTER = 0.02
"""Relative; a coloured sequence of this length has about 10 000 independent samples."""


@pytest.mark.parametrize("colour", AR_COEFFICIENTS.values())
def test_both_colours_have_the_stated_deviation(colour: float) -> None:
    x = noise(np.random.default_rng(1), SAMPLES, 3e-5, colour)
    assert np.std(x) == pytest.approx(3e-5, rel=SCATTER)


@pytest.mark.parametrize("dt", [0.5e-3, 1e-3, 4e-3])
def test_the_memory_is_one_of_time_not_of_samples(dt: float) -> None:
    x = noise(np.random.default_rng(1), SAMPLES, 1.0, AR_COEFFICIENT, dt)
    next_to_each_other = np.mean(x[1:] * x[:-1])
    assert next_to_each_other == pytest.approx(AR_COEFFICIENT ** (dt / 1e-3), abs=SCATTER)


def test_coloured_noise_is_stationary_from_the_first_sample_on() -> None:
    rng = np.random.default_rng(1)
    first = np.array([noise(rng, 20, 1.0, AR_COEFFICIENT) for _ in range(5000)])
    assert np.allclose(first.std(axis=0), 1.0, atol=0.06)  # 1 % scatter per column, 20 of them
