"""Whether recordings begin while the arm moves: then the state that each begins in is not known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..recording.channels import channel_kind, is_channel
from ..recording.recording import Beginning, Recording

AT_ONCE = 8
"""Samples over which it is seen whether a motion begins at rest."""

SURE = 6.9
"""Deviations by which the first speed must exceed the noise to be a motion: of noise alone, with
AT_ONCE - 3 degrees of freedom, Student's t exceeds it once in a thousand. A campaign has some
dozens of recorded joints, and one that is wrongly thought to move gets a speed out of noise."""

SLOW_START = 0.5
"""Of the largest step within AT_ONCE samples, of all joints together: from rest the first step is a
third of the second, whatever the acceleration; a joint that moves already goes on as it went. What
vibrates faster than it is sampled may hide that in one joint."""


def begins_at_rest(place: np.ndarray) -> bool:
    """Whether positions `place` (N, k) begin at rest: the first step is small relative to the
    largest of the first samples, in all joints whose initial speed exceeds the noise around a
    parabola."""
    if len(place) <= AT_ONCE or not np.isfinite(place[:AT_ONCE]).all():
        return False
    first = place[:AT_ONCE]
    A = np.vander(np.arange(AT_ONCE), 3)
    parabola = np.linalg.lstsq(A, first, rcond=None)[0]
    noise = np.sqrt(np.sum((first - A @ parabola) ** 2, axis=0) / (AT_ONCE - 3))
    deviation = noise * np.sqrt(np.linalg.inv(A.T @ A)[1, 1])
    steps = np.abs(np.diff(first, axis=0))
    fast = steps[0][np.abs(parabola[1]) > SURE * deviation]
    return bool(np.sum(fast) <= SLOW_START * np.sum(steps.max(axis=0)))


LAGS = 16
"""Samples of all signals that predict the next place of a joint: an arm of three joints with two
modes each has 18 states, and the other joints' samples hold them as well."""

FIRST = 4
"""Samples that are predicted from rest: a motion before them shows in the first ones most. With 16
a campaign of coarse encoders that was cut seemed to begin at rest (1.95; with four 3.3)."""

FEWEST_PER_COLUMN = 4
"""Rows per column of the samples side by side, below which noise seems predicted by chance."""

MOST_START_SAMPLES = 20_000
"""Of all recordings together."""

WORSE = 2.5
"""Times the usual error, of the first samples predicted from rest, beyond which a recording is in
motion; so are all of a campaign whose median is. From rest the loops of an independent engine lay
below 1.7, cut anywhere above 3.8. A wrong alarm costs time and no accuracy."""

FAMILIAR = 1.0
"""Leverage up to which something like the first samples occurs later, so that their prediction from
rest says something: .1 where references step, tens and more where they are smooth."""


def with_beginnings(
    recordings: Sequence[Recording], joints: int, references: Sequence[str], held: bool,
    weighs: bool = False,
) -> list[Recording]:  # fmt: skip
    """The recordings of one campaign, marked with what is known of the motion that each begins in.

    From rest all that an arm does comes from what drives it. So the next value of each channel is
    predicted from the samples before by a linear equation fitted to all recordings, and the first
    values from rest before the first sample: in a motion that goes on these are much worse. Where
    nobody knows what leads the joints, their first steps decide. Where the joints or `references`
    (channels that drive them) were not recorded, the arm is taken to rest.

    `held`: whether the drive's feedback holds the joints. Under a torque encoders alone do not show
    whether the links rest. `weighs`: whether links bend under their weight. Then they may hang or
    be let go, and only a log that begins before its motion shows that nothing swings.
    """
    names = [f"theta{k + 1}" for k in range(joints)]
    able = [r for r in recordings if _complete(r, [*names, *references])]
    if not able:
        return list(recordings)
    share = max(MOST_START_SAMPLES // len(able), 4 * LAGS)
    sensors = _sensors(able)
    places = [_columns(r, [*names, *sensors], share) for r in able]
    driving = [_columns(r, references, share) for r in able]
    judged = _first_errors(places, driving, LAGS) if references else None
    if judged is None:  # nothing predicts it
        slow = [begins_at_rest(place[:, :joints]) for place in places]
        judged = np.where(slow, 0.0, np.inf), np.full(len(able), np.inf)
    worse, leverage = judged
    beginnings = {}
    for r, place, x, unlike in zip(able, places, worse, leverage, strict=True):
        still = _begins_still(place)
        moves = max(x, float(np.median(worse))) > WORSE and not still
        rests = (held or sensors) and (still or unlike <= FAMILIAR)
        at_rest = Beginning.REST
        if weighs:
            at_rest = Beginning.EQUILIBRIUM if still else Beginning.UNKNOWN
        beginnings[r.name] = Beginning.MOTION if moves else at_rest if rests else Beginning.UNKNOWN
    return [replace(r, beginning=beginnings.get(r.name, r.beginning)) for r in recordings]


STILL = 0.01
"""Of a channel's whole range: by less it changes over the first samples of a log that begins
before its motion."""

NOISE_ALONE = 2.0
"""Times the variance of white noise, seen in third differences, that the first samples have where
nothing moves; what swings by a radian per sample has twenty-five times as much."""


def _begins_still(places: np.ndarray) -> bool:
    """Whether all channels (N, k) show nothing but noise over the first 2 LAGS samples, or hardly
    change."""
    first = places[: 2 * LAGS]
    noise = np.mean(np.diff(first, 3, axis=0) ** 2, axis=0) / 20.0
    small = np.ptp(first, axis=0) <= STILL * np.ptp(places, axis=0)
    return bool(np.all(small | (np.var(first, axis=0) <= NOISE_ALONE * noise)))


def _sensors(recordings: Sequence[Recording]) -> list[str]:
    """Channels beside the encoders that all recordings have with every sample."""
    return [
        name for name in recordings[0].channels
        if is_channel(name) and channel_kind(name).sparse
        and all(r.has(name) and np.isfinite(r[name]).all() for r in recordings)
    ]  # fmt: skip


def _complete(recording: Recording, names: Sequence[str]) -> bool:
    long_enough = recording.has(*names) and len(recording.time) > 4 * LAGS
    return long_enough and all(np.isfinite(recording[n]).all() for n in names)


def _columns(recording: Recording, names: Sequence[str], most: int) -> np.ndarray:
    """(N, k)"""
    columns = [recording[n][:most] for n in names]
    return np.column_stack(columns) if columns else np.zeros((min(len(recording.time), most), 0))


def _first_errors(
    places: Sequence[np.ndarray], driving: Sequence[np.ndarray], lags: int
) -> tuple[np.ndarray, np.ndarray] | None:
    """Per recording the rms error of the first samples predicted from rest, relative to the usual,
    of the channel where it is largest; and how unlike all others these samples are (leverage).
    None where there are too few samples."""
    windows = [_side_by_side(y, u, lags) for y, u in zip(places, driving, strict=True)]
    A, B = (np.vstack([part[lags:] for part in parts]) for parts in zip(*windows, strict=True))
    if len(A) < FEWEST_PER_COLUMN * A.shape[1]:
        return _first_errors(places, driving, lags // 2) if lags > 3 else None
    scales = np.maximum(np.linalg.norm(A, axis=0), 1e-300)
    orthogonal, triangle = np.linalg.qr(A / scales)
    turned, sizes, axes = np.linalg.svd(triangle)
    # Directions below the last digits of files say nothing.
    sizes = np.maximum(sizes, 1e-7 * sizes[0])
    weights = (axes.T / sizes) @ (turned.T @ (orthogonal.T @ B))
    left = A / scales @ weights - B
    usual = np.sqrt(np.sum(left**2, axis=0) / (len(A) - A.shape[1]))
    errors, leverages = [], []
    for before, after in windows:
        first = before[:FIRST] / scales
        leverage = np.sum((first @ axes.T / sizes) ** 2, axis=1)
        error = (first @ weights - after[:FIRST]) / np.sqrt(1.0 + leverage)[:, None]
        errors.append(np.max(np.sqrt(np.mean(error**2, axis=0)) / np.maximum(usual, 1e-300)))
        leverages.append(np.median(leverage))
    return np.array(errors), np.array(leverages)


def _side_by_side(
    place: np.ndarray, driving: np.ndarray, lags: int
) -> tuple[np.ndarray, np.ndarray]:
    """(N - 1, c): one, all places of some samples before, from rest, and what drives the arm up to
    now; and the places (N - 1, k) that follow, all from the first place on."""
    N = len(place)
    y = np.vstack([np.repeat(place[:1], lags, axis=0), place]) - place[0]
    u = np.vstack([np.zeros((lags, driving.shape[1])), driving])
    outputs = [y[lags + 1 - i : lags + N - i] for i in range(1, lags + 1)]
    drive = [u[lags + 1 - i : lags + N - i] for i in range(lags + 1)]
    return np.hstack([np.ones((N - 1, 1)), *outputs, *drive]), y[lags + 1 : lags + N]
