"""An independent measure of what an effect shows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import least_squares

from flexgui.core.model import Model
from flexgui.core.simulate.motion import Task
from flexgui.core.simulate.nonlinear import simulate_within
from flexgui.core.study.study_rig import STDS, Experiment, readings, simulate_exactly


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
