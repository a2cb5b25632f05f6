"""How far the ends of an arm's bending segments are from where a rigid arm would have them."""

from collections.abc import Callable

import numpy as np

from ..arm.arm import Arm
from ..arm.slots import LENGTH, slot


def chord_matrix(arm: Arm, p: np.ndarray) -> np.ndarray:
    """(joints, n): the chord angle delta(l)/l of each segment, rad, from q (n,); p (13 N + 5,)."""
    return _end_rows(arm, p, lambda i: 1)


def slope_matrix(arm: Arm, p: np.ndarray) -> np.ndarray:
    """(joints, n): the slope delta'(l) at the end of each segment from q (n,); p (13 N + 5,)."""
    return _end_rows(arm, p, lambda i: i + 2)


def _end_rows(arm: Arm, p: np.ndarray, factor: Callable[[int], int]) -> np.ndarray:
    out = np.zeros((arm.joints, arm.coordinates))
    for k in range(arm.joints):
        length = p[slot(k, LENGTH)]
        rows = [factor(i) * length ** (i + 1) for i in range(arm.modes[k])]
        out[k, arm.modal_slice(k)] = rows
    return out


def deflection_rows(arm: Arm, p: np.ndarray) -> np.ndarray:
    """(joints, n): delta_k(l) in m from q (n,); p (13 N + 5,). Zero rows for rigid segments."""
    lengths = np.array([p[slot(k, LENGTH)] for k in range(arm.joints)])
    return np.asarray(chord_matrix(arm, p) * lengths[:, None])
