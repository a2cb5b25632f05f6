"""One experiment that could be made: where it starts, what it plays, and how strongly."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

import numpy as np

from ..diagnose.fit_problem import Hypothesis
from ..experiments.rig_limits import RigLimits
from ..model import Model
from ..recording.spec import SimulateSpec
from ..simulate.batch import run
from ..simulate.experiment import make_task
from ..simulate.motion import Task
from ..trajectory import Trajectory

FORMS: tuple[tuple[str, Mapping[str, Any]], ...] = (
    ("levels held for 0.02 s", {"excitation": "prbs_balanced", "hold": 0.02}),
    ("levels held for 0.05 s", {"excitation": "prbs_balanced", "hold": 0.05}),
    ("levels held for 0.15 s", {"excitation": "prbs_balanced", "hold": 0.15}),
    ("a multisine to 20 Hz", {"excitation": "multisine", "options": {"highest_hz": 20.0}}),
)
"""From the links' vibrations to stretches of steady motion, in which friction and gains show."""

PLACES = (1.0 / 6.0, 0.5, 5.0 / 6.0)
"""Shares of a joint's range where experiments start: apart, and each with room to move."""

MOST_POSTURES = 5

USED_SHARE = 0.9
"""Share of a limit that the model may use: the rest is for what the model does not know."""

NEAR = 0.97
"""Share of that from which on stronger references would add nothing worth a simulation."""

MOST_TRIES = 8
GROWTH = 4.0
"""Times the amplitude, at most, from one try to the next: friction and limits are no straight
lines."""

STEPS = 16
"""Per sample, of what is shown of an experiment once it is chosen."""


@dataclass(frozen=True)
class Trial:
    """References of unit size per joint, and the size of each."""

    start: tuple[float, ...]
    """rad or m, all joints"""
    form: str
    """In words."""
    settings: Mapping[str, Any] = field(repr=False)
    seconds: float
    sample_time: float
    seed: int
    amplitudes: tuple[float, ...] = ()
    """Per joint, in the unit of its reference."""

    def task(self, model: Model) -> tuple[Task, float | None]:
        """What is simulated of it, and its working point theta2 where it has one."""
        spec = SimulateSpec(
            theta=self.start, amplitude=1.0, seconds=self.seconds, sample_time=self.sample_time,
            seed=self.seed, **self.settings,
        )  # fmt: skip
        task, point = make_task(model, spec, self.form)
        references, channels = task.references.copy(), model.drive.reference_channels(model.arm)
        for k, size in enumerate(self.amplitudes):
            at = self.start[k] if channels[k] == f"theta{k + 1}_ref" else 0.0
            references[:, k] = at + size * (references[:, k] - at)
        return replace(task, references=references), point

    def motion(self, h: Hypothesis, steps: int = STEPS) -> Trajectory:
        """Of a fitted model."""
        return simulate_reference(h, self.task(model_without_servo(h))[0], steps)


def model_without_servo(h: Hypothesis) -> Model:
    """A fitted model without the servo that may have led it along its recordings."""
    model = h.model.steered_by(None)
    own = {k: v for k, v in h.values().items() if k in model.effect_values}
    return replace(model, effect_values={**model.effect_values, **own})


def simulate_reference(h: Hypothesis, task: Task, steps: int) -> Trajectory:
    """What a fitted model does where references are played to its drive, with so many steps per
    sample or what its effects need."""
    model = model_without_servo(h)
    shared = {k: v for k, v in h.values().items() if "@" not in k}
    return run(model, model.numbers(shared), task, model.steps(task.sample_time, steps))


def trials(limits: RigLimits, seconds: float, sample_time: float) -> list[Trial]:
    """Postures within the limits times forms; all of one length, without sizes yet."""
    low, high = limits.position.T
    joints = len(low)
    inner = [_inside(low[k], high[k]) for k in range(1, joints)]
    chosen = list(product(*inner))
    chosen = chosen[:: -(-len(chosen) // MOST_POSTURES)]
    first = _round(0.5 * (low[0] + high[0]), high[0] - low[0])
    starts = [(first, *rest) for rest in chosen]
    pairs = product(starts, FORMS)
    return [
        Trial(start, form, settings, seconds, sample_time, seed)
        for seed, (start, (form, settings)) in enumerate(pairs, start=1)
    ]


def _inside(low: float, high: float) -> list[float]:
    return sorted({_round(low + share * (high - low), high - low) for share in PLACES})


def _round(place: float, span: float) -> float:
    """A place that a person can set: zero where that is near, else a hundredth of the range off at
    most."""
    if abs(place) < 0.1 * span:
        return 0.0
    digits = int(np.ceil(-np.log10(max(span, 1e-9)) + 1.5))
    return float(round(place, digits)) + 0.0


def strongest(
    trial: Trial,
    models: Sequence[Hypothesis],
    limits: RigLimits,
    begun: np.ndarray,
    doubt: np.ndarray | float,
    steps: int,
) -> Trial | None:
    """The trial as strong as the limits allow by every one of the models; None where it cannot
    move within them.

    `begun` (joints,): sizes to begin with; `doubt` as `Allowed.used` takes it; `steps` per sample.
    Each joint's size follows the tightest of its limits; the tip's are shared.
    """
    sizes, kept = np.array(begun, dtype=float), None
    for _ in range(MOST_TRIES):
        tried = replace(trial, amplitudes=tuple(map(float, sizes)))
        used = [limits.used(tried.motion(h, steps), doubt) for h in models]
        share = np.max([np.maximum(own, tip) for own, tip in used], axis=0) / USED_SHARE
        if not np.all(np.isfinite(share)):
            sizes = 0.5 * sizes
            continue
        if share.max() <= 1.0:
            kept = tried if kept is None or sum(sizes) > sum(kept.amplitudes) else kept
            if share.min() >= NEAR:
                break
        sizes = sizes * np.clip(NEAR * 1.01 / np.maximum(share, 1e-6), 1.0 / GROWTH, GROWTH)
    return kept
