"""Channels of a recording beside what a model makes of them."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..identify.prepared_recording import Prepared
from ..least_squares import pseudo_inverse
from ..noise.sensor_noise import noise_of
from ..trajectory import Trajectory

FLOOR = 1e-4
"""Of a channel's variance: what no model explains."""
LARGEST_UNEXPLAINED = 20.0
"""The same: a motion beyond is as wrong as one that diverges."""
MAINLY = 0.5
"""Of a channel's unexplained variance that a fault takes at least."""
ALIKE = 4.0
"""Times the variance that is left in another recording: more has a cause of its own."""
BENDING = 0.01
"""Of the arm's reach: drawings and cameras are right within it."""


@dataclass(frozen=True)
class Equation:
    """One channel at M of its samples: what is measured, and what a model makes of it."""

    channel: str
    time: np.ndarray
    """(M,), s"""
    measured: np.ndarray
    """(M,), NaN where nothing counts."""
    modelled: np.ndarray
    """(M,)"""
    free: int
    """Terms of a polynomial in time that say nothing: 0, 1 where its zero is unknown, 2 where only
    its speed is controlled, so that it drifts."""
    tolerance: float = 0.0
    """rms of what no model explains."""
    free_gain: bool = False
    """Whether nobody knows its gain: then the best one counts."""

    @cached_property
    def error(self) -> np.ndarray:
        """(M,), zero where nothing counts; infinite where the motion is."""
        if not self.free_gain:
            return self._left(self.measured - self.modelled)
        return self._left(self.measured) - self.gain * self._left(self.modelled)

    @cached_property
    def size(self) -> float:
        """Standard deviation of what is measured, and no less than what no model explains."""
        y = self._left(self.measured)[np.isfinite(self.measured)]
        return max(float(np.std(y)) if len(y) else 0.0, self.tolerance) or 1.0

    @cached_property
    def share(self) -> float:
        """Share of its variance that is not explained: MOST at most, plus FLOOR."""
        return self.share_of(self.error)

    @property
    def excess(self) -> float:
        """The share beyond what the tolerance allows."""
        allowed = (1.0 + ALIKE) * (self.tolerance / self.size) ** 2
        return max(self.share - FLOOR - allowed, 0.0)

    def share_of(self, error: np.ndarray) -> float:
        """The share of another `error` (M,)."""
        # What a correction takes out of the comparison is not explained by it.
        squares = np.where(np.isfinite(self.measured), error**2, self.size**2)
        left = float(np.mean(squares)) + self.tolerance**2
        return min(left / self.size**2, LARGEST_UNEXPLAINED) + FLOOR

    @cached_property
    def is_white(self) -> bool:
        """Whether most of what is left is white noise, or next to nothing: no fault takes it."""
        left = self.error[np.isfinite(self.measured)]
        usual = max(noise_of(left) ** 2 / MAINLY, FLOOR * self.size**2, ALIKE * self.tolerance**2)
        return bool(np.mean(left**2) < usual)

    def is_like(self, other: Equation) -> bool:
        """Whether no more is left than of this channel in another recording."""
        own, usual = ((e.share, e.share * e.size**2) for e in (self, other))
        return any(a <= ALIKE * b for a, b in zip(own, usual, strict=True))

    @property
    def gain(self) -> float:
        """Slope of what is measured over what is modelled."""
        y, x = self._left(self.measured), self._left(self.modelled)
        return float(y @ x / max(x @ x, 1e-300)) if np.isfinite(x).all() else 1.0

    def _left(self, x: np.ndarray) -> np.ndarray:
        """x (M,) where it counts, without its free polynomial."""
        counted = np.isfinite(self.measured)
        found = np.where(counted, x, 0.0)
        if not np.isfinite(found @ found):
            return np.full(len(x), np.inf)
        if self.free:
            terms = counted * (self.time - self.time.mean()) ** np.arange(self.free)[:, None]
            found -= pseudo_inverse(terms @ terms.T) @ (terms @ found) @ terms
        return found


@dataclass(frozen=True)
class Answer:
    """All channels of one recording at one vector."""

    equations: tuple[Equation, ...]

    @cached_property
    def score(self) -> float:
        """Sum over the channels of the logarithm of the share of its variance that is left."""
        return float(sum(np.log(e.share) for e in self.equations))

    @property
    def worst(self) -> float:
        """Largest share that is left beyond what no model explains."""
        return max((e.excess for e in self.equations), default=0.0)

    @property
    def is_noise(self) -> bool:
        """Whether what is left of every channel is white noise."""
        return all(e.is_white for e in self.equations)

    def of(self, channel: str) -> tuple[Equation, ...]:
        """The equations of a channel."""
        return tuple(e for e in self.equations if e.channel == channel)

    def improved(self, before: Answer) -> tuple[str, float, float]:
        """The channel of which more is explained than before, and what was and is unexplained."""
        pairs = zip(before.equations, self.equations, strict=True)
        each = [(a.channel, min(a.excess, 1.0), min(b.excess, 1.0)) for a, b in pairs]
        return max(each, key=lambda shares: shares[1] - shares[2], default=("", 0.0, 0.0))

    def is_like(self, other: Answer) -> bool:
        """Whether no more is left of any channel than in another recording of the same rig."""
        pairs = list(zip(self.equations, other.equations, strict=False))
        same = len(self.equations) == len(other.equations)
        return same and all(a.channel == b.channel and a.is_like(b) for a, b in pairs)

    @cached_property
    def errors(self) -> np.ndarray:
        """(M k,)"""
        return np.concatenate([e.error for e in self.equations])

    @cached_property
    def weights(self) -> np.ndarray:
        """(M k,) one over the standard deviation of what is left of each channel."""
        each = [np.full(len(e.error), 1.0 / (e.size * np.sqrt(e.share))) for e in self.equations]
        return np.concatenate(each)


def tip_equations(
    motion: Trajectory, prepared: Prepared, rows: np.ndarray, zeros: Collection[str] = ()
) -> tuple[Equation, ...]:
    """The camera's channels at `rows` (K,) beside the tip at the measured joints, of links that
    bend as in a simulated motion or are stiff, whichever fits better: right within what links
    bend, also where the motion is not. `zeros`: channels whose zero is unknown. None without a
    camera or encoders."""
    joints, reach = motion.arm.joints, sum(s.length for s in motion.arm.segments)
    recording, camera = prepared.recording, ("z1", "z2")
    names = [f"theta{k + 1}" for k in range(joints)]
    if not recording.has(*camera, *names) or not len(rows):
        return ()
    z, measured = (np.column_stack([recording[n] for n in c]) for c in (camera, names))
    bending, tips = motion.q[:, joints:], []
    for bent in (bending, np.zeros_like(bending)):
        tip = replace(motion, q=np.hstack([measured, bent])).tip()[0]
        written = zip(camera, tip.T, strict=True)
        tips.append(np.column_stack([prepared.through_logger(*pair) for pair in written])[rows])
    z, time = z[rows], recording.time[rows]
    seen = np.isfinite(z)
    tip = min(tips, key=lambda x: float(np.nan_to_num(np.mean((z - x)[seen] ** 2), nan=np.inf)))
    # The whole place counts: a tip that hardly moves may be somewhere else.
    return tuple(
        Equation(name, time, y, x, int(name in zeros), BENDING * reach)
        for name, y, x in zip(camera, z.T, tip.T, strict=True)
    )
