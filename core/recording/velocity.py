"""Velocity from sampled position, and the filters that go with it."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
import scipy
from pydantic import BaseModel, ConfigDict, Field

from ..errors import InputError

SHORTEST_DIFFERENCE = 2
"""Samples that a difference needs."""


def central_difference(x: np.ndarray, dt: float) -> np.ndarray:
    """dx/dt of samples x (N,) every `dt` s: central differences of second order, one-sided at the
    ends.

    Empty samples (NaN) stay empty; a channel that carries only every s-th sample is
    differentiated at its own rate.
    """
    return _over_runs(np.asarray(x, dtype=float), dt, np.gradient, SHORTEST_DIFFERENCE)


FORGOTTEN = 1e-4
"""Of what is invented beyond the ends of a signal, so that the filter begins there without a jolt.
A position's ends are differentiated twice: after the usual 15 samples a joint's acceleration would
be three times itself at its end, where 30 Hz are filtered out of 500."""


class ZeroPhaseLowPass(BaseModel):
    """A Butterworth low-pass run forwards and backwards, so that it delays nothing."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    cutoff_hz: float = Field(strict=True, ge=1e-6, le=1e9, allow_inf_nan=False)
    """Hz"""
    order: int = Field(default=4, strict=True, ge=1, le=10)
    """Of the filter in one direction."""

    def apply(self, x: np.ndarray, dt: float) -> np.ndarray:
        """x (N,) filtered; dt in s.

        Empty samples (NaN) stay empty and are never bridged: each unbroken run is filtered by
        itself, and a run that is too short for the filter becomes empty.
        """
        return _over_runs(np.asarray(x, dtype=float), dt, self._filter, self.shortest)

    @property
    def shortest(self) -> int:
        """Samples that a run needs: sosfiltfilt extends both ends by 3 (order + 1)."""
        return 3 * (self.order + 1) + 1

    def _filter(self, x: np.ndarray, dt: float) -> np.ndarray:
        sections, _ = self.design(dt)
        padding = self.padding(len(x), dt)
        return np.asarray(scipy.signal.sosfiltfilt(sections, x, axis=0, padlen=padding))

    def design(self, dt: float) -> tuple[np.ndarray, np.ndarray]:
        """Second-order sections (s, 6) and their states (s, 2) after a constant input of one; `dt`
        in s. InputError where the cut-off is not below half the sampling rate."""
        if self.cutoff_hz >= 0.5 / dt:
            raise InputError(
                f"[identify] filter.cutoff_hz is {self.cutoff_hz:g}; at a sample time of {dt:g} s "
                f"it must be below {0.5 / dt:g} Hz."
            )
        return _designed(self.order, self.cutoff_hz, 1.0 / dt)

    def padding(self, N: int, dt: float) -> int:
        """Samples, every `dt` s, by which both ends of N are extended, mirrored in the first and
        the last one."""
        return min(max(3 * (self.order + 1), self.memory(dt)), N - 1)

    def memory(self, dt: float, share: float = FORGOTTEN) -> int:
        """Samples, every `dt` s, after which the filter has forgotten all but a `share` of what it
        saw: its slowest pole decays with 2 pi f sin(pi / (2 order))."""
        decay = 2.0 * np.pi * self.cutoff_hz * np.sin(0.5 * np.pi / self.order)
        return int(np.ceil(np.log(1.0 / share) / (decay * dt)))

    def reach_hz(self, share: float) -> float:
        """Hz beyond which less than a `share` of a signal is left, by the analogue filter's gain
        1 / (1 + (f / cutoff)^(2 order)) of both directions together."""
        return float(self.cutoff_hz * (1.0 / share - 1.0) ** (0.5 / self.order))

    def sentence(self) -> str:
        """The filter in words, as reports state it."""
        return (
            f"Butterworth low-pass of order {self.order} at {self.cutoff_hz:g} Hz, run forwards "
            f"and backwards: zero phase, half the amplitude at {self.cutoff_hz:g} Hz."
        )


@lru_cache
def _designed(order: int, cutoff_hz: float, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """`design`, which takes longer than filtering a short recording."""
    sections = np.asarray(scipy.signal.butter(order, cutoff_hz, fs=rate, output="sos"))
    return sections, np.asarray(scipy.signal.sosfilt_zi(sections))


def _over_runs(
    x: np.ndarray,
    dt: float,
    operation: Callable[[np.ndarray, float], np.ndarray],
    shortest: int,
) -> np.ndarray:
    """`operation(samples, step)` on each unbroken run of samples; NaN elsewhere.

    The step of a slower sensor is the usual distance between its samples; where the distance
    differs (a dropped frame), a new run begins.
    """
    sampled = np.flatnonzero(np.isfinite(x))
    if len(sampled) == len(x) >= shortest:
        return operation(x, dt)
    out = np.full(len(x), np.nan)
    if len(sampled) < shortest:
        return out
    distances = np.diff(sampled)
    stride = int(np.median(distances)) if len(distances) else 1
    for run in np.split(sampled, np.flatnonzero(distances != stride) + 1):
        if len(run) >= shortest:
            out[run] = operation(x[run], dt * stride)
    return out
