"""The measured arm: postures that agree with the encoders and with what was seen of the bending.

A recording does not hold the modal coordinates, so they are reconstructed: of all bendings that
explain the measured link deflections or the measured tip, the one with the least bending energy.
For one mode per segment and two joints that is the only one; for more modes it is the shape that
a force at the tip gives, close to the first natural mode.
"""

from __future__ import annotations

import numpy as np

from core.arm.arm import Arm
from core.arm.chord import chord_matrix
from core.arm.compiled import CompiledArm
from core.arm.slots import gravity_slot
from core.model import Model, Numbers
from core.recording.recording import Recording

STEPS = 5
"""Newton steps; the tip is nearly linear in the bending, so each takes two digits or more."""

REGULARISATION = 1e-3
"""Of the largest compliance seen at the tip. A bending that hardly moves the tip (along a straight
arm) is not read from it: the camera's noise would become a large bending. What moves the tip is
not touched, since each step takes the share that the one before has left."""


def measured_postures(recording: Recording, model: Model, numbers: Numbers) -> np.ndarray | None:
    """q (N, n) of a recording; None without encoders. Straight where nothing tells the bending.

    Between samples of a slow camera the bending runs straight in time.
    """
    arm = model.arm
    names = [f"theta{k + 1}" for k in range(arm.joints)]
    if not recording.has(*names):
        return None
    q = np.zeros((len(recording.time), arm.coordinates))
    q[:, : arm.joints] = np.column_stack([recording[name] for name in names])
    if arm.coordinates == arm.joints:
        return q
    flexibility = _flexibility(arm, model.compiled, numbers.p)
    _add_deflections(q, recording, arm, numbers.p, flexibility)
    if recording.has("z1", "z2"):
        z = np.column_stack([recording["z1"], recording["z2"]])
        _add_tip(q, recording.time, z, model.compiled, numbers.p, flexibility)
    return q


def _flexibility(arm: Arm, compiled: CompiledArm, p: np.ndarray) -> np.ndarray:
    """(n, n) inverse of the bending stiffness, zero for the joints."""
    without_gravity = p.copy()
    without_gravity[gravity_slot(arm.joints, 0) : gravity_slot(arm.joints, 2)] = 0.0
    K, _ = compiled.linear_matrices(np.zeros(arm.coordinates), without_gravity)
    out = np.zeros_like(K)
    out[arm.joints :, arm.joints :] = np.linalg.inv(K[arm.joints :, arm.joints :])
    return out


def _add_deflections(
    q: np.ndarray, recording: Recording, arm: Arm, p: np.ndarray, flexibility: np.ndarray
) -> None:
    """The least bending with the measured chord angle of each link that has a gauge."""
    for k, row in enumerate(chord_matrix(arm, p)):
        name = f"deflection{k + 1}"
        if not arm.modes[k] or not recording.has(name):
            continue
        shape = flexibility @ row
        q += filled(recording.time, recording[name][:, None]) * (shape / (row @ shape))


def _add_tip(
    q: np.ndarray,
    time: np.ndarray,
    z: np.ndarray,
    compiled: CompiledArm,
    p: np.ndarray,
    flexibility: np.ndarray,
) -> None:
    """Bends q (N, n) until its tips stand at z (N, 2)."""
    seen = np.flatnonzero(np.isfinite(z).all(axis=1))
    if not seen.size:
        return
    bent = q[seen]
    for _ in range(STEPS):
        tips, slopes = zip(*(compiled.tip_place(row, p) for row in bent), strict=True)
        miss, J = z[seen] - np.array(tips), np.array(slopes)
        yielding = J @ flexibility
        compliance = yielding @ np.swapaxes(J, 1, 2)
        size = np.trace(compliance, axis1=1, axis2=2)[:, None, None]
        pull = np.linalg.solve(compliance + REGULARISATION * size * np.eye(2), miss[:, :, None])
        bent = bent + (np.swapaxes(yielding, 1, 2) @ pull)[:, :, 0]
    change = np.full_like(q, np.nan)
    change[seen] = bent - q[seen]
    q += filled(time, change)


def filled(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Columns (N, k) with NaN replaced by what runs straight between the samples around it."""
    known = np.isfinite(values).all(axis=1)
    if known.all():
        return values
    if not known.any():
        return np.zeros_like(values)
    return np.column_stack([np.interp(time, time[known], column[known]) for column in values.T])
