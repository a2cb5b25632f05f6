"""What a simulation is asked to do: references, start, schedule."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from core.model import Numbers


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

    @property
    def sample_time(self) -> float:
        """s"""
        return float(self.time[-1] - self.time[0]) / (len(self.time) - 1)


def at_rest(joints: np.ndarray, n: int, states: int = 0) -> np.ndarray:
    """[q, q', s] at rest and straight with the joints (nj,) given."""
    start = np.zeros(2 * n + states)
    start[: len(joints)] = joints
    return start


def full_start(task: Task, numbers: Numbers) -> np.ndarray:
    """[q, q', s, w]: the task's start with the states of drive and effects that it lacks, at zero.

    An effect may give the drive states that the task's maker did not know of.
    """
    n = task.schedule.shape[1]
    states = numbers.law.states + sum(len(e.law.states) for e in numbers.elements)
    out = np.zeros(2 * n + states)
    known = min(len(task.start), 2 * n + numbers.law.states)
    out[:known] = task.start[:known]
    return out
