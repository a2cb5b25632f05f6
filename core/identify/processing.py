"""Filters and decimation of measurement and model before they are compared.

`scipy.signal.sosfiltfilt` computes the states of a constant input each time and filters one signal
after the other (0.3 and 3.4 ms for 24 signals of 3,000 samples). Here all signals are filtered
together, without the interpreter, with the same result to the last digits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arm.signatures import OPTIONS, kernel, matrix
from ..compiler import njit, types
from ..recording.velocity import ZeroPhaseLowPass

TORQUE = "torque"

NEGLIGIBLE_GAIN = 1e-3
"""Gain of a filter below which a vibration need not be simulated well. Resonance amplifies the few
per cent that coarse points miss some tens of times, which is then invisible."""


@dataclass(frozen=True)
class Processing:
    """Filters and decimation of measurement and model."""

    filter: ZeroPhaseLowPass | None = None
    decimate: int = 1
    output_filter: ZeroPhaseLowPass | None = None
    """A further low-pass of the outputs alone: a torque may need a narrower band than its
    motion."""
    torque_filter: ZeroPhaseLowPass | None = None
    """A low-pass of the joint torques alone, to the band in which encoders show motion."""
    motion_filter: ZeroPhaseLowPass | None = None
    """A low-pass of all other outputs, to the band in which a servo prescribes that motion."""

    def filters(self, kind: str) -> tuple[ZeroPhaseLowPass, ...]:
        """The filters of a sensor's signals."""
        own = self.torque_filter if kind == TORQUE else self.motion_filter
        return tuple(f for f in (self.filter, self.output_filter, own) if f is not None)

    def apply(self, y: np.ndarray, dt: float, kinds: Sequence[str] = ()) -> np.ndarray:
        """y (N, k, ...), `dt` s apart -> (ceil(N / decimate), k, ...); `kinds` (k,) of the sensors
        of the columns, where some may be torques. Only (N, k) may have empty samples."""
        alike = {kind: (self.filters(kind), kind == TORQUE) for kind in kinds or ("",)}
        if len(set(alike.values())) == 1:
            return self._filtered(y, dt, *next(iter(alike.values())))[:: self.decimate]
        out = np.array(y)
        for kind, (filters, even) in alike.items():
            columns = [c for c, k in enumerate(kinds) if k == kind]
            out[:, columns] = self._filtered(y[:, columns], dt, filters, even)
        return out[:: self.decimate]

    def _filtered(
        self, y: np.ndarray, dt: float, filters: Sequence[ZeroPhaseLowPass], even: bool
    ) -> np.ndarray:
        complete = y.ndim > 2 or (y.size > 0 and bool(np.isfinite(y).all()))
        for low_pass in filters:
            if complete:
                y = filtered(low_pass, y, dt, even)
            else:
                y = np.column_stack([low_pass.apply(column, dt) for column in y.T])
        return y

    def band_hz(self, kinds: Sequence[str]) -> float:
        """Hz above which these sensors are not compared: the filters' gain is below
        NEGLIGIBLE_GAIN."""
        bands = [
            min((f.reach_hz(NEGLIGIBLE_GAIN) for f in self.filters(kind)), default=np.inf)
            for kind in kinds
        ]
        return max(bands, default=np.inf)

    def inside(self, kind: str, N: int, dt: float) -> np.ndarray:
        """(N,) whether a sample is further from both ends than a filter's response to them.

        A filter must extrapolate beyond the ends of a torque. A Butterworth filter of order n at f
        responds for about twice its group delay, which is below n / (2 pi f). Noise of a second
        difference at an end is 1 / (2 pi f dt)^1.5 times that inside; it counts again once the
        filter has forgotten as much. Without a filter the first and last sample have no second
        difference.
        """
        filters = self.filters(kind)
        edges = [int(np.ceil(f.order / (np.pi * f.cutoff_hz * dt))) for f in filters]
        if kind == TORQUE:
            sizes = [min(2.0 * np.pi * f.cutoff_hz * dt, 1.0) ** 1.5 for f in filters]
            edges += [f.memory(dt, size) for f, size in zip(filters, sizes, strict=True)]
        count = max([1, *edges])
        at = np.arange(N)
        return np.asarray((at >= count) & (at < N - count))

    @property
    def nothing(self) -> bool:
        """Whether measurement and model stay as they are."""
        filters = (self.filter, self.output_filter, self.torque_filter)
        return all(f is None for f in filters) and self.decimate == 1


def delayed(y: np.ndarray, time: np.ndarray, delay: float) -> np.ndarray:
    """y (N, ...) at time - delay, linear between samples, constant beyond the ends."""
    at = np.interp(time - delay, time, np.arange(len(time), dtype=float))
    below = np.minimum(at.astype(np.int64), len(time) - 2)
    share = (at - below).reshape(-1, *[1] * (y.ndim - 1))
    return np.asarray(y[below] + share * (y[below + 1] - y[below]))


def filtered(
    low_pass: ZeroPhaseLowPass, x: np.ndarray, dt: float, even: bool = False
) -> np.ndarray:
    """`low_pass.apply` along the first axis of signals x (N, ...) without empty samples, `dt` s
    apart; NaN where N is too short. `even`: the ends are mirrored as they are, not in their last
    sample: the noise of a second difference there would go on beyond it. InputError where the cut-
    off is not below half the sampling rate."""
    if len(x) < low_pass.shortest:
        return np.full(x.shape, np.nan)
    sections, steady = low_pass.design(dt)
    flat = np.ascontiguousarray(x.reshape(len(x), -1))
    padding = low_pass.padding(len(x), dt)
    return _both_ways(sections, steady, flat, padding, 0.0 if even else 2.0).reshape(x.shape)


@njit(**OPTIONS)
def _through(sections, steady, x, back):  # type: ignore[no-untyped-def]
    """x (N, k) in place through sections (s, 6) that have settled at the row they begin with."""
    N, k = x.shape
    first = x[N - 1 if back else 0].copy()
    low, high = np.empty(k), np.empty(k)
    for s in range(len(sections)):
        b0, b1, b2 = sections[s, 0], sections[s, 1], sections[s, 2]
        a1, a2 = sections[s, 4], sections[s, 5]
        for c in range(k):
            low[c], high[c] = steady[s, 0] * first[c], steady[s, 1] * first[c]
        for m in range(N):
            n = N - 1 - m if back else m
            for c in range(k):
                u = x[n, c]
                y = b0 * u + low[c]
                low[c] = b1 * u - a1 * y + high[c]
                high[c] = b2 * u - a2 * y
                x[n, c] = y


@kernel(matrix(matrix, matrix, matrix, types.int64, types.float64))
def _both_ways(sections, steady, x, padding, mirror):  # type: ignore[no-untyped-def]
    """(N, k) of x (N, k), whose ends are extended by as many samples, mirrored `mirror` / 2 times
    the last one and, where it is zero, upright."""
    sign = -1.0 if mirror else 1.0
    N, k = x.shape
    y = np.empty((N + 2 * padding, k))
    for n in range(padding):
        for c in range(k):
            y[n, c] = mirror * x[0, c] + sign * x[padding - n, c]
            y[padding + N + n, c] = mirror * x[N - 1, c] + sign * x[N - 2 - n, c]
    y[padding : padding + N] = x
    _through(sections, steady, y, False)
    _through(sections, steady, y, True)
    return y[padding : padding + N].copy()
