"""Lengths of the links as a camera and the encoders show them, beside those that are stated."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arm.arm import Arm
from ..check.equations import BENDING
from ..check.measured_recording import MeasuredRecording
from ..check.sized_faults import FACTOR, SURE, WHOLE
from ..least_squares import pseudo_inverse


def tip_products(recording: MeasuredRecording) -> np.ndarray | None:
    """(n + 3, n + 3) inner products of n links' directions, of a camera's two zeros, and of the
    place of the tip that it sees; None without what they need."""
    model = recording.model
    joints = [] if model is None else [f"theta{k + 1}" for k in range(model.arm.joints)]
    if model is None or not recording.has("z1", "z2", *joints):
        return None
    if any(s.joint != "revolute" or s.mount != "previous" for s in model.arm.segments):
        return None
    seen = recording.near("z1") & recording.near("z2")
    z = np.concatenate([recording.sampled(n)[seen] for n in ("z1", "z2")])
    angles = np.cumsum([recording.sampled(n)[seen] for n in joints], axis=0)
    links = [np.concatenate([np.cos(a), np.sin(a)]) for a in angles]
    A = np.column_stack([*links, np.repeat(np.eye(2), seen.sum(), axis=0), z])
    return np.asarray(A.T @ A)


def wrong_lengths(arm: Arm, products: Sequence[np.ndarray]) -> dict[int, float]:
    """Segment (from 0) -> the length in m that recordings with these products (n + 3, n + 3) show,
    where it is none that is stated.

    A tip is a sum of links along their directions, linear in their lengths. Both its place and its
    motion must show them: a camera's zero shifts the one, an encoder's scale the other. Nothing is
    said where that does not explain the camera within what links bend (another column is wrong
    then), or where all lengths are off by one factor, as the camera's scale may be.
    """
    n, G = arm.joints, sum(products, np.zeros((arm.joints + 3, arm.joints + 3)))
    count = G[n, n] + G[n + 1, n + 1]
    place = pseudo_inverse(G[:n, :n]) @ G[:n, -1]
    free = pseudo_inverse(G[:-1, :-1])
    moves, bends = (free @ G[:-1, -1])[:n], BENDING * np.abs(place).sum()
    left = G[-1, -1] - place @ G[:n, -1]
    if not count or place.min() <= bends or left > count * bends**2:
        return {}
    # Bending is no noise: as much of it as is allowed may be alike in all samples.
    sure = SURE * bends * np.sqrt(np.diag(free)[:n] * count)
    stated = np.array([s.length for s in arm.segments])
    off = np.log(place / stated)
    wrong = (np.abs(moves - place) < sure) & (np.abs(moves - stated) > sure) & (abs(off) > FACTOR)
    return {} if np.ptp(off) < WHOLE else {int(k): float(place[k]) for k in np.flatnonzero(wrong)}
