"""Torques or currents against the motion of every joint: which of them is out of proportion.

The torque of a joint is a sum over all joints' accelerations, tau_k = sum_j T_kj + friction. Each
part gets a gain of its own: a torque with a wrong factor changes a row of them, an encoder a
column, which tells the two apart.
"""

from __future__ import annotations

import numpy as np

from core.check.bending import SMALL, Bending, Shape
from core.check.measured import Measured

PART = 0.1
"""Of a torque's variance must a part have for its gain to say something."""
SURE = 5.0
"""Standard deviations must a gain be from zero; one error in ten is independent."""
EDGE, MOST, ALIKE = 20, 3000, 10


def gains(
    found: Measured, names: tuple[str, ...], shape: Shape | None
) -> list[tuple[str, str, float, float]]:
    """(torque, encoder, gain over the model's, share of the torque explained) of what can be said.

    Args:
        names: The torques or currents, one per joint.
        shape: The links as they are; None: as stiff ones.
    """
    links = Bending.of(found, most=np.inf)
    if links is None or not found.has(*names):
        return []
    moved = float(np.max(np.ptp(links.q[:, 1:], axis=0), initial=0.0))
    parts = links.torques_of_each(shape if moved <= SMALL else None)
    speed, dry = links.rubbed(links.q)
    count = len(links.q)
    edge = min(EDGE, count // 5)
    inner = slice(edge, count - edge, max(count // MOST, 1))
    made = []
    for k, name in enumerate(names):
        y = links.held(links.channel(name))[inner]
        A = np.column_stack([parts[:, k], speed[:, k], dry[:, k], np.ones(count)])[inner]
        part, *_ = np.linalg.lstsq(A, y, rcond=None)
        rest, total = y - A @ part, max(float(np.var(y)), 1e-300)
        explained = 1.0 - float(np.var(rest)) / total
        spread = np.sqrt(np.diag(np.linalg.pinv(A.T @ A)) * np.var(rest) * ALIKE)
        for j in range(parts.shape[2]):
            large = float(np.var(part[j] * A[:, j])) > PART * total
            if large and abs(part[j]) > SURE * spread[j]:
                made.append((name, f"theta{j + 1}", float(part[j]), explained))
    return made


def loops(found: Measured, shape: Shape) -> list[tuple[float, float, float]]:
    """Of each velocity loop, theta'* = theta' + (tau + friction) / lambda: the gain of the speed,
    that of the torque over the stated 1 / lambda, and the share of the reference explained.

    With a clock that runs c times too slow a speed is c times too small, and a torque c^2 times.
    """
    links, model = Bending.of(found), found.model
    gains_ = getattr(getattr(model, "drive", None), "gains", None)
    if links is None or model is None or gains_ is None:
        return []
    names = model.drive.reference_channels(model.arm)
    if not found.has(*names) or not all(n.startswith("dtheta") for n in names):
        return []
    torques = links.torques(links.moved(shape, links.q))
    speed, dry = links.rubbed(links.q)
    count = len(links.q)
    inner = slice(min(EDGE, count // 5), count - min(EDGE, count // 5))
    made = []
    for k, name in enumerate(names):
        y = links.held(links.channel(name))[inner]
        A = np.column_stack([speed[:, k], torques[:, k], dry[:, k], np.ones(count)])[inner]
        part, *_ = np.linalg.lstsq(A, y, rcond=None)
        explained = 1.0 - float(np.var(y - A @ part) / max(float(np.var(y)), 1e-300))
        made.append((float(part[0]), float(part[1]) * gains_[k], explained))
    return made
