"""A channel that never changes, or freezes."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ...check.case import Case
from ...check.finding import Check, Finding
from ...check.measured_recording import LONGEST, ON_LATTICE
from ...recording.channels import is_reference

LONGER = 4.0
"""Times the next longest run: an encoder at rest repeats values too, but more than once."""


class Dead(Check):
    """One value all the time, or for one long stretch while the others move."""

    kind = "dead"

    def find(self, case: Case) -> Iterable[Finding]:
        recording = case.recording
        for name in recording.channels:
            values = recording.counted(name)
            good = np.flatnonzero(np.isfinite(values))
            if len(good) < LONGEST:
                continue
            x = values[good]
            if np.ptp(x) == 0.0:
                span = float(recording.time[good[-1]] - recording.time[good[0]])
                sentence = f"{name} is constant at {x[0]:g}"
                yield case.finding(self.kind, name, span, "s", sentence)
            elif not is_reference(name):  # a reference may stand still
                yield from self._frozen(case, name, good, x)

    def _frozen(self, case: Case, name: str, good: np.ndarray, x: np.ndarray) -> Iterable[Finding]:
        starts = np.flatnonzero(np.r_[True, np.diff(x) != 0.0])
        lengths = np.diff(np.r_[starts, len(x)])
        order = np.argsort(lengths)[::-1]
        after = int(starts[order[0]] + lengths[order[0]])
        if _released_from_friction(x, after):
            return
        longest, second = lengths[order[0]], lengths[order[1]] if len(order) > 1 else 0
        if longest < max(LONGEST, LONGER * second) or _clipped(x, x[starts[order[0]]]):
            return
        time = case.recording.time[good]
        begin = time[starts[order[0]]]
        span = longest * case.recording.step
        sentence = f"{name} stays at {x[starts[order[0]]]:.6g} for {span:.4g} s from {begin:.4g} s"
        mask = f"mask = {{ {name} = [[{begin:.9g}, {begin + span:.9g}]] }}"
        yield case.finding(self.kind, name, span, "s", sentence, mask)


def _released_from_friction(x: np.ndarray, after: int) -> bool:
    """Whether an encoder leaves a stretch of equal samples at sample `after` as a joint does that
    dry friction held: by a count, or faster and faster. A channel that froze jumps to where the
    joint is by then, and goes on at its usual speed."""
    step = _counting_step(x)
    if step == 0.0 or after + 1 >= len(x):
        return False
    jump, next_ = abs(x[after] - x[after - 1]), abs(x[after + 1] - x[after])
    return bool(jump < max(1.5 * step, next_))


def _counting_step(x: np.ndarray) -> float:
    """What all changes of x (N,) are whole multiples of, but for rounding; 0: nothing is."""
    changes = np.abs(np.diff(x))
    changes = changes[changes > 1e-9 * np.ptp(x)]
    if not len(changes):
        return 0.0
    step = float(changes.min())
    whole = changes / step
    off = float(np.sqrt(np.mean((whole - np.round(whole)) ** 2)))
    return step if off < ON_LATTICE else 0.0


def _clipped(x: np.ndarray, value: float) -> bool:
    """A longest run at the top or the bottom that is not the only one there is a limit."""
    return bool(
        value in (x.max(), x.min()) and np.sum(np.diff(np.flatnonzero(x == value)) > 1) >= 2
    )
