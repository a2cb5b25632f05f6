"""Chord angles of bending segments and the fictitious rigid arm (design section 2).

The rigid arm has the same geometry and the same tip: z = g(y), solved for y in closed form; the
encoders only choose the elbow's side and the turn. The paper's y = theta + J(theta)^-1 (z -
g(theta)) is its first Newton step. For two revolute joints, to first order, y = C1 q with
    y1 = theta1 + delta1(l1)/l1,
    y2 = theta2 + delta1'(l1) - delta1(l1)/l1 + delta2(l2)/l2,
which is (9) of the paper for one mode: [[1, 0, l1, 0], [0, 1, l1, l2]].
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from core.arm.arm import Arm
from core.arm.slots import LENGTH, slot
from core.errors import InputError

SINGULAR_MARGIN = 0.05
"""rad: closer than this to theta2 = 0 or pi the rigid arm's angles are not defined well enough."""


def chord_matrix(arm: Arm, p: np.ndarray) -> np.ndarray:
    """(joints, n): the chord angle delta(l)/l of each segment from q."""
    return _end_rows(arm, p, lambda i: 1)


def slope_matrix(arm: Arm, p: np.ndarray) -> np.ndarray:
    """(joints, n): the slope delta'(l) at the end of each segment from q."""
    return _end_rows(arm, p, lambda i: i + 2)


def _end_rows(arm: Arm, p: np.ndarray, factor: Callable[[int], int]) -> np.ndarray:
    out = np.zeros((arm.joints, arm.coordinates))
    for k in range(arm.joints):
        length = p[slot(k, LENGTH)]
        rows = [factor(i) * length ** (i + 1) for i in range(arm.modes[k])]
        out[k, arm.modal_slice(k)] = rows
    return out


def rigid_angle_matrix(arm: Arm, p: np.ndarray) -> np.ndarray:
    """C1 (2, n), (9) of the paper; for two revolute joints only."""
    require_two_revolute(arm)
    chord, slope = chord_matrix(arm, p), slope_matrix(arm, p)
    C1 = np.eye(2, arm.coordinates)
    C1[0] += chord[0]
    C1[1] += slope[0] - chord[0] + chord[1]
    for k in range(2):
        place = arm.twist_place(k)
        if place is not None:
            C1[k, place] = 1.0
    return C1


def require_two_revolute(arm: Arm) -> None:
    """InputError where the fictitious rigid arm is not defined."""
    if not arm.two_revolute:
        raise InputError(
            f"[identify] output 'y' or 'ydot' is defined for two revolute joints only, and arm "
            f'{arm.name!r} is not such an arm; choose output = "z" instead.'
        )


def require_regular(theta2: np.ndarray, name: str) -> None:
    """InputError where theta2 (N,) comes too close to a stretched or folded arm."""
    nearest = np.pi * np.round(theta2 / np.pi)
    distance = np.abs(theta2 - nearest)
    worst = int(np.argmin(distance))
    if distance[worst] < SINGULAR_MARGIN:
        raise InputError(
            f"Recording {name}: theta2 comes within {distance[worst]:.3f} rad of "
            f"{'0' if nearest[worst] == 0 else 'pi'}, where y and ydot are singular; "
            f'choose [identify] output = "z" instead.'
        )


def rigid_jacobian(theta: np.ndarray, l1: float, l2: float) -> np.ndarray:
    """J (N, 2, 2) of the rigid arm at joint angles theta (N, 2)."""
    s1, c1 = np.sin(theta[:, 0]), np.cos(theta[:, 0])
    s12, c12 = np.sin(theta[:, 0] + theta[:, 1]), np.cos(theta[:, 0] + theta[:, 1])
    J = np.empty((len(theta), 2, 2))
    J[:, 0, 0], J[:, 0, 1] = -l1 * s1 - l2 * s12, -l2 * s12
    J[:, 1, 0], J[:, 1, 1] = l1 * c1 + l2 * c12, l2 * c12
    return J


def rigid_angles(theta: np.ndarray, z: np.ndarray, l1: float, l2: float) -> np.ndarray:
    """y (N, 2): angles of the rigid arm with the tip z (N, 2), on the side of theta (N, 2)."""
    cosine = (np.sum(z * z, axis=1) - l1 * l1 - l2 * l2) / (2.0 * l1 * l2)
    elbow = np.arccos(np.clip(cosine, -1.0, 1.0)) * np.sign(np.sin(theta[:, 1]))
    first = np.arctan2(z[:, 1], z[:, 0])
    first = first - np.arctan2(l2 * np.sin(elbow), l1 + l2 * np.cos(elbow))
    y = np.column_stack([first, elbow])
    turns = 2.0 * np.pi * np.round((theta - y) / (2.0 * np.pi))
    return np.asarray(y + turns)


def rigid_rates(y: np.ndarray, tip_speed: np.ndarray, l1: float, l2: float) -> np.ndarray:
    """y' (N, 2) = J(y)^-1 z' from the rigid arm's angles y and the tip's velocity (N, 2); NaN where
    the arm is stretched or folded exactly, as an arm that starts at zero is."""
    J = rigid_jacobian(y, l1, l2)
    singular = np.linalg.det(J) == 0.0
    J[singular] = np.eye(2)
    rates = np.linalg.solve(J, tip_speed[:, :, None])[:, :, 0]
    rates[singular] = np.nan
    return np.asarray(rates)
