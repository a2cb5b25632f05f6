"""One possible experiment: start, references and their size."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

import numpy as np

from ..estimate.problem import Problem
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
"""From link vibrations to steady motion, in which friction and gains show."""

START_SHARES = (1.0 / 6.0, 0.5, 5.0 / 6.0)
"""Shares of a joint's range at which experiments start, with space to move."""

MOST_POSTURES = 5

USED_SHARE = 0.9
"""Share of a limit that the model may use; the rest covers its error."""

NEAR = 0.97
"""Share of that above which stronger references are not worth a simulation."""

MOST_TRIES = 8
GROWTH = 4.0
"""Largest factor on the amplitude per try: friction and limits are nonlinear."""

TRIAL_STEPS = 16
"""Steps per sample for a chosen experiment."""


@dataclass(frozen=True)
class Trial:
    """References of unit size per joint, and the size of each."""

    start: tuple[float, ...]
    """rad or m, all joints"""
    form: str
    """As text."""
    settings: Mapping[str, Any] = field(repr=False)
    seconds: float
    sample_time: float
    seed: int
    amplitudes: tuple[float, ...] = ()
    """Per joint, in the unit of its reference."""

    def task(self, model: Model) -> tuple[Task, float | None]:
        """The simulation task, and its working point theta2 if it has one."""
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

    def motion(self, problem: Problem, steps: int = TRIAL_STEPS) -> Trajectory:
        """The motion of a fitted model."""
        return simulate_reference(problem, self.task(model_without_servo(problem))[0], steps)


def model_without_servo(problem: Problem) -> Model:
    """A fitted model without a virtual servo."""
    model = problem.model.steered_by(None)
    own = {k: v for k, v in problem.values().items() if k in model.effect_values}
    return replace(model, effect_values={**model.effect_values, **own})


def simulate_reference(problem: Problem, task: Task, steps: int) -> Trajectory:
    """The motion of a fitted model under references, with so many steps per sample."""
    model = model_without_servo(problem)
    shared = {k: v for k, v in problem.values().items() if "@" not in k}
    return run(model, model.numbers(shared), task, steps)


def trials(limits: RigLimits, seconds: float, sample_time: float) -> list[Trial]:
    """Postures within the limits times forms; all of `seconds` s, sampled every `sample_time` s,
    without sizes yet."""
    low, high = limits.position.T
    joints = len(low)
    inner = [_inside(low[k], high[k]) for k in range(1, joints)]
    chosen = list(product(*inner))
    chosen = chosen[:: -(-len(chosen) // MOST_POSTURES)]
    first = _round(0.5 * (low[0] + high[0]), high[0] - low[0])
    starts = [(first, *others) for others in chosen]
    pairs = product(starts, FORMS)
    return [
        Trial(start, form, settings, seconds, sample_time, seed)
        for seed, (start, (form, settings)) in enumerate(pairs, start=1)
    ]


def _inside(low: float, high: float) -> list[float]:
    return sorted({_round(low + share * (high - low), high - low) for share in START_SHARES})


def _round(place: float, span: float) -> float:
    """A position that is easy to set: zero if near, else rounded to a hundredth of the range."""
    if abs(place) < 0.1 * span:
        return 0.0
    digits = int(np.ceil(-np.log10(max(span, 1e-9)) + 1.5))
    return float(round(place, digits)) + 0.0


def strongest(
    trial: Trial, models: Sequence[Problem], limits: RigLimits, first_sizes: np.ndarray,
    motion_error: np.ndarray | float, steps: int,
) -> Trial | None:  # fmt: skip
    """The trial as strong as the limits allow by every one of the models; None where it cannot
    move within them.

    `first_sizes` (joints,): sizes to begin with; `motion_error` as in `RigLimits.usage`;
    `steps` per sample.
    Each joint's size follows the tightest of its limits; the tip's are shared.
    """
    sizes, best = np.array(first_sizes, dtype=float), None
    for _ in range(MOST_TRIES):
        tried = replace(trial, amplitudes=tuple(map(float, sizes)))
        used = [limits.usage(tried.motion(problem, steps), motion_error) for problem in models]
        share = np.max([np.maximum(own, tip) for own, tip in used], axis=0) / USED_SHARE
        if not np.all(np.isfinite(share)):
            sizes = 0.5 * sizes
            continue
        if share.max() <= 1.0:
            best = tried if best is None or sum(sizes) > sum(best.amplitudes) else best
            if share.min() >= NEAR:
                break
        sizes = sizes * np.clip(NEAR * 1.01 / np.maximum(share, 1e-6), 1.0 / GROWTH, GROWTH)
    return best
