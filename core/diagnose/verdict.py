"""Whether what remains is within the floor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.identify.prepared import Prepared

MISSING, NOTHING, UNLISTED = "missing", "nothing_missing", "unlisted"

ABOVE = 1.06
"""Times the floor: from this rms on an error is well above it. Noise coloured by a filter of ten
samples moves the rms of a few seconds of four channels by one per cent."""

ABOVE_IN_ONE = 1.2
"""The same for the worst channel alone."""

LINE = 1e-4
"""Chance that white noise shows a spectral line as high: below it, it is one."""


@dataclass(frozen=True)
class Remains:
    """What is left of the error, in floors."""

    rms: float
    """Over all channels."""
    by_channel: dict[str, float]
    line: tuple[str, float] | None
    """(channel, Hz) of a spectral line that stands out of an error above the floor."""

    @property
    def above(self) -> bool:
        return self.rms > ABOVE or any(x > ABOVE_IN_ONE for x in self.by_channel.values())


def remains(experiments: Sequence[Prepared], errors: Sequence[np.ndarray]) -> Remains:
    """From weighted errors (M, k) per recording."""
    squares: dict[str, list[np.ndarray]] = {}
    for e, r in zip(experiments, errors, strict=True):
        for k, (name, _) in enumerate(e.channels):
            squares.setdefault(name, []).append(r[e.counted[:, k], k] ** 2)
    by_channel = {n: float(np.sqrt(np.mean(np.concatenate(s)))) for n, s in squares.items()}
    everything = np.concatenate([x for parts in squares.values() for x in parts])
    return Remains(
        float(np.sqrt(np.mean(everything))), by_channel, _line(experiments, errors, by_channel)
    )


def _line(
    experiments: Sequence[Prepared], errors: Sequence[np.ndarray], rms: dict[str, float]
) -> tuple[str, float] | None:
    """The strongest line of the channel that is furthest above its floor."""
    channel = max(rms, key=lambda name: rms[name])
    if rms[channel] < ABOVE:
        return None
    best: tuple[float, float] | None = None
    for e, r in zip(experiments, errors, strict=True):
        names = [name for name, _ in e.channels]
        if channel not in names:
            continue
        x = r[:, names.index(channel)]
        dt = float(e.time[1] - e.time[0])
        found = line_of(x, dt)
        if found is not None and (best is None or found[0] < best[0]):
            best = found
    return None if best is None or best[0] > LINE else (channel, best[1])


WINDOW = 25
"""Frequencies on each side against which a line is judged."""


def line_of(x: np.ndarray, dt: float) -> tuple[float, float] | None:
    """(chance, Hz) of the highest line over its neighbourhood; None for short signals."""
    N = len(x)
    if N < 8 * WINDOW:
        return None
    power = np.abs(np.fft.rfft((x - x.mean()) * np.hanning(N))) ** 2
    width = 2 * WINDOW + 1
    padded = np.pad(power, WINDOW, mode="reflect")
    around = np.median(np.lib.stride_tricks.sliding_window_view(padded, width), axis=1)
    ratio = power[3:] / np.maximum(around[3:] / np.log(2.0), 1e-300)
    k = int(np.argmax(ratio))
    chance = min(len(ratio) * float(np.exp(-min(ratio[k], 700.0))), 1.0)
    return chance, float((k + 3) / (N * dt))
