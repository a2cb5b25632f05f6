"""Hidden effects show as much as was asked for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pytest
from scipy.optimize import least_squares

from flexgui.core.challenge.challenge_rig import STDS, bare_model
from flexgui.core.challenge.detectability import CLOSE, Detectability, UnreachableError, crossing
from flexgui.core.challenge.hidden_effect import (
    candidates,
    hide_effect,
    parameters_on,
)
from flexgui.core.effects import effect
from flexgui.core.model import Model
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.simulate.experiment import simulate_recording


def least_squares_rest(truth: Model, bare: Model, experiments: Sequence[SimulateSpec]) -> float:
    """Root mean square, in noise rms, of what SciPy's fit of EI and the starts leaves."""
    seen = [readings(truth, e) for e in experiments]
    EI = bare.parameters["EI"].value
    weights = 1.0 / np.array(list(STDS.values()))

    def errors(x: np.ndarray) -> np.ndarray:
        values, starts = {"EI": EI * (1.0 + x[0])}, x[1:].reshape(-1, 2)
        parts = [
            (y - readings(bare, e, values, start)) * weights
            for e, y, start in zip(experiments, seen, starts, strict=True)
        ]
        return np.concatenate([p.ravel() for p in parts])

    start = np.zeros(1 + 2 * len(experiments))
    found = least_squares(errors, start, x_scale=[1e-2, *[1e-4] * (len(start) - 1)])
    return float(np.sqrt(2.0 * found.cost / len(errors(start))))


def readings(
    model: Model,
    spec: SimulateSpec,
    values: Mapping[str, float] | None = None,
    start: Sequence[float] = (),
) -> np.ndarray:
    """(N, 4): what camera and encoders read without noise; the joints begin `start` rad off."""
    joints = (0.0, spec.theta2 or 0.0)
    state = {f"theta{k + 1}": joints[k] + x for k, x in enumerate(start)}
    recording = simulate_recording(model, spec, "r", values=values, state=state)
    return np.column_stack([recording[name] for name in STDS])


EXPERIMENTS = [SimulateSpec(theta2=x, seconds=0.3, seed=k + 1) for k, x in enumerate((0.5, 2.0))]

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
    softer = {"EI": EI * (1.0 - 1e-3)}
    shown = [simulate_recording(bare_model(), spec, "r", values=softer) for spec in EXPERIMENTS]
    changes = [
        (a[name] - b[name]) / std
        for a, b in zip(shown, detectability.recordings, strict=True)
        for name, std in STDS.items()
    ]
    plain = np.sqrt(np.mean(np.square(changes)))
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
