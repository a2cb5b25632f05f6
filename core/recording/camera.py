"""The camera of one experiment: its clock and its pose."""

from __future__ import annotations

import numpy as np

from core.recording.recording import CameraPose


def shifted(x: np.ndarray, shift: float) -> np.ndarray:
    """Samples x (N,) moved earlier by `shift` sample times, not a whole number of them perhaps.

    The whole part moves samples to other rows. For the rest the value at the row's own time is
    interpolated linearly between the sensor's samples around it, so that a slow camera keeps its
    rate. What would come from outside the recording is empty (NaN).
    """
    out = np.full(len(x), np.nan)
    sampled = np.flatnonzero(np.isfinite(x))
    if not sampled.size:
        return out
    rows = sampled - int(np.floor(shift + 0.5))
    # A tolerance: a whole shift of many samples leaves a rest of rounding errors.
    wanted = np.round(rows + shift, 9)
    inside = (wanted >= sampled[0]) & (wanted <= sampled[-1]) & (rows >= 0) & (rows < len(x))
    out[rows[inside]] = np.interp(wanted[inside], sampled, x[sampled])
    return out


def in_base_frame(
    z1: np.ndarray, z2: np.ndarray, pose: CameraPose
) -> tuple[np.ndarray, np.ndarray]:
    """z = origin + R(angle) scale z_camera, in m, both (N,)."""
    c, s = pose.scale * np.cos(pose.angle), pose.scale * np.sin(pose.angle)
    return pose.origin[0] + c * z1 - s * z2, pose.origin[1] + s * z1 + c * z2
