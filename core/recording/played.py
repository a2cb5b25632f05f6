"""A recording of an experiment that was planned: cut to what was played, its references known.

A logger starts before the motion and ends after it, and some write no references.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.signal import fftconvolve

from core.errors import InputError
from core.recording.recording import Recording

APART = 0.1
"""Share of the references' own spread by which recorded and played ones may differ: quantisation
and noise of a logger stay below a hundredth, another experiment is as far apart as its spread."""


def as_played(recording: Recording, play: Recording) -> Recording:
    """The stretch of a recording in which an experiment was played.

    Args:
        recording: as the logger wrote it; without references it starts when the playing starts.
        play: the references (N,) of each channel that was played.

    Returns:
        The recording from the first played sample to the last, with the played references where
        it has none.

    Raises:
        InputError: the references are not those that were played, or too short.
    """
    dt = recording.sample_time
    names = list(play.channels)
    length = max(int(round(len(play.time) * play.sample_time / dt)), 1)
    held = np.floor(np.arange(length) * dt / play.sample_time + 1e-6)
    rows = np.minimum(held.astype(int), len(play.time) - 1)
    played = {name: play.channels[name][rows] for name in names}
    have = [name for name in names if recording.has(name)]
    count = min(len(rows), len(recording.time))
    if have and len(recording.time) < len(rows):
        raise InputError(
            f"{recording.source} is shorter than {play.source}, which was to be played "
            f"({len(recording.time) * dt:.3g} s of {len(rows) * dt:.3g} s): record all of it, or "
            "leave `played` out."
        )
    first = _found(recording, played, have, play.source) if have else 0
    part = slice(first, first + count)
    given = {name: played[name][:count] for name in names if name not in have}
    return replace(
        recording,
        time=recording.time[part] - recording.time[first],
        channels={**{n: x[part] for n, x in recording.channels.items()}, **given},
        counted={n: x[part] for n, x in recording.counted.items()},
    )


def _found(
    recording: Recording, played: dict[str, np.ndarray], have: list[str], source: str
) -> int:
    """The sample at which the references fit best; InputError where they nowhere do."""
    misses = 0.0
    spread = sum(float(np.sum((played[n] - played[n].mean()) ** 2)) for n in have)
    for name in have:
        r, p = recording.channels[name], played[name]
        squares = np.cumsum(np.concatenate([[0.0], r**2]))
        inside = squares[len(p) :] - squares[: -len(p)]
        misses = misses + inside - 2.0 * fftconvolve(r, p[::-1], mode="valid") + np.sum(p**2)
    first = int(np.argmin(misses))
    apart = float(np.sqrt(max(np.asarray(misses)[first], 0.0) / max(spread, 1e-300)))
    if apart > APART:
        raise InputError(
            f"{recording.source} is no recording of {source}: its references differ from those "
            f"that were to be played by {100.0 * apart:.0f} % of their spread; choose the file "
            "that belongs to it, or leave `played` out."
        )
    return first
