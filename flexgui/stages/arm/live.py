"""The model of the sliders: computes all that the first stage shows."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, lru_cache

import numpy as np

from flexgui.core.arm.arm import Arm, Structure
from flexgui.core.arm.compiled import compile_arm
from flexgui.core.bounded_cache import BoundedCache
from flexgui.core.model import Model, Numbers
from flexgui.core.results import DescriptorModel, Equation
from flexgui.core.scenario.schema import Scenario
from flexgui.core.simulate.posture import Mode, Posture, computed_once, posture, vibration_modes
from flexgui.core.simulate.response import (
    FrequencyResponse,
    StepResponse,
    frequency_response,
    step_response,
)
from flexgui.library.shipped import demo_scenario
from flexgui.session.scenario_edits import CACHE_SIZE, cached_model
from flexgui.session.state import LiveSettings

STEP_SIZE = 0.3
"""Of the reference's unit: the amplitude of the default excitation. The arm is drawn as far bent
as a step of that size of all references at once bends it."""


@dataclass(frozen=True)
class Prepared:
    """A scenario's model, ready for drawing."""

    scenario: Scenario
    model: Model

    @property
    def equations(self) -> tuple[Equation, ...]:
        """Equations of motion; slow to derive, so only when they are shown."""
        from flexgui.core.simulate.equations import equations

        return _EQUATIONS.get(_structure(self.model), lambda: equations(self.model))

    @computed_once
    def descriptor(self) -> DescriptorModel:
        """The descriptor model's matrices; only when they are shown."""
        from flexgui.core.simulate.descriptor import descriptor

        return descriptor(self.model, self.model.numbers())


@dataclass(frozen=True)
class LiveModel(Prepared):
    """What the sliders' model does at the working point."""

    live: LiveSettings
    numbers: Numbers
    at: Posture
    q: np.ndarray
    """(n,): the posture, bent."""
    modes: tuple[Mode, ...]
    clamped: tuple[Mode, ...]
    step: StepResponse
    noise: np.ndarray
    """(N, ny, nr): what the stated signal-to-noise ratio adds to the step response."""
    frequency: FrequencyResponse


def prepare(scenario: Scenario, before: Prepared | None) -> Prepared:
    """The model of a scenario, cached; a new structure takes seconds to compile."""
    if before is not None and before.scenario == scenario:
        return before
    if scenario is demo_scenario():
        return _demo()
    return _PREPARED.get(id(scenario), lambda: _prepared(scenario))


@cache
def _demo() -> Prepared:
    """The model of the demo scenario, with which most sessions begin."""
    return _prepared(demo_scenario())


def _prepared(scenario: Scenario) -> Prepared:
    model = cached_model(scenario)
    # Not by `model.compiled`: its lock is one for all models, and others must not wait.
    compile_arm(Structure.of(model.arm))
    return Prepared(scenario, model)


def is_new(arm: Arm, before: Prepared | None) -> bool:
    """Whether the arm's structure differs from that of `before` and may need compiling."""
    return before is None or Structure.of(arm) != Structure.of(before.model.arm)


_EQUATIONS: BoundedCache[tuple[Equation, ...]] = BoundedCache(CACHE_SIZE)
_PREPARED: BoundedCache[Prepared] = BoundedCache(CACHE_SIZE)
_LIVE: BoundedCache[LiveModel] = BoundedCache(CACHE_SIZE)
"""By ids of what the entries hold, so that no other object can have them."""


def live_model(prepared: Prepared, live: LiveSettings) -> LiveModel:
    """The sliders' model at the working point; milliseconds, or cached from another session."""
    return _LIVE.get((id(prepared.model), live), lambda: _live_model(prepared, live))


def _live_model(prepared: Prepared, live: LiveSettings) -> LiveModel:
    model = prepared.model
    numbers = model.numbers()
    at = posture(model, _joints(model, live), numbers)
    modes = vibration_modes(at)
    step = step_response(at)
    return LiveModel(
        scenario=prepared.scenario,
        model=model,
        live=live,
        numbers=numbers,
        at=at,
        q=_bent(at),
        modes=modes,
        clamped=vibration_modes(at, clamped=True),
        step=step,
        noise=_noise(step.values, live.snr_db),
        frequency=frequency_response(at),
    )


def _structure(model: Model) -> tuple[object, ...]:
    p = model.numbers().p
    lengths = tuple(s.length for s in model.arm.segments)
    effects = tuple(repr(effect) for effect in model.effects)
    return (Structure.of(model.arm), type(model.drive), tuple(p != 0.0), lengths, effects)


def _joints(model: Model, live: LiveSettings) -> np.ndarray:
    joints = np.zeros(model.arm.joints)
    if model.arm.joints > 1:
        joints[1] = live.theta2
    return joints


def _bent(at: Posture) -> np.ndarray:
    """The posture with the modal coordinates in static balance with the drive's first push."""
    n, joints = at.model.arm.coordinates, at.model.arm.joints
    q = at.q.copy()
    if n == joints:
        return q
    # Clamped at the joints, accelerated as the references' step does: K v = -M_vq q''.
    push = STEP_SIZE * at.B[n : n + joints].sum(axis=1)
    acceleration = np.linalg.solve(at.M[:joints, :joints], push)
    bending = at.K[joints:, joints:]
    q[joints:] = np.linalg.solve(bending, -at.M[joints:, :joints] @ acceleration)
    return q


def _noise(step: np.ndarray, snr_db: float | None) -> np.ndarray:
    """White noise, always the same draws, so that a slider changes only its size."""
    if snr_db is None:
        return np.zeros_like(step)
    return np.asarray(_draws(step.shape) * step.std(axis=0) * 10.0 ** (-snr_db / 20.0))


@lru_cache(8)
def _draws(shape: tuple[int, ...]) -> np.ndarray:
    return np.random.default_rng(1).standard_normal(shape)
