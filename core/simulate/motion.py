"""What a simulation is asked to do: references, start, schedule; and in which stretches."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..model import Numbers
from ..progress import check_stopped


@dataclass(frozen=True)
class Task:
    """One experiment to simulate.

    time (N,) uniform in s; references (N, nr); start (2 n + ns,) the initial [q, q', s];
    schedule (N, n) or (1, n): where the linear model is linearised (only joints matter).
    """

    time: np.ndarray
    references: np.ndarray
    start: np.ndarray
    schedule: np.ndarray
    before: np.ndarray | None = None
    """(L, joints) where a virtual servo's joints were before the first sample, at the same steps,
    beginning at rest; None: the motion begins with the first sample."""
    inputs: np.ndarray | None = None
    """(N, inputs of the model) signals that its forces depend on; None: there are none."""

    @property
    def signals(self) -> np.ndarray:
        """(N, inputs + nr): inputs and references."""
        return self.references if self.inputs is None else np.hstack([self.inputs, self.references])

    @property
    def sample_time(self) -> float:
        """s"""
        return float(self.time[-1] - self.time[0]) / (len(self.time) - 1)


def at_rest(joints: np.ndarray, n: int, states: int = 0) -> np.ndarray:
    """[q, q', s] (2 n + states,) at rest and straight with the joints (nj,) given."""
    start = np.zeros(2 * n + states)
    start[: len(joints)] = joints
    return start


def full_start(task: Task, numbers: Numbers) -> np.ndarray:
    """[q, q', s, w] (2 n + states,): the task's start, with zeros for the missing states of drive
    and effects."""
    n = task.schedule.shape[1]
    states = numbers.law.states + sum(len(e.law.states) for e in numbers.elements)
    out = np.zeros(2 * n + states)
    count = min(len(task.start), 2 * n + numbers.law.states)
    out[:count] = task.start[:count]
    return out


STRETCH_STEPS = 20_000
"""Of a stretch: a step takes 1 to 20 us, alone or in lanes, so that a stop waits for less than half
a second."""


def stretches(samples: int, substeps: int) -> Iterator[slice]:
    """Rows of each stretch; the last row of one is the first of the next. One slice with all
    rows where there are few. Before each StoppedError where the user asked to stop.
    """
    rows = max(STRETCH_STEPS // substeps, 1)
    first = 0
    while True:
        check_stopped()
        last = min(first + rows, samples - 1)
        yield slice(first, last + 1)
        if last == samples - 1:
            return
        first = last
