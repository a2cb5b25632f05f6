"""The shape of an effect at each joint, chosen from columns alone."""

from __future__ import annotations

import numpy as np

from flexgui.core.diagnose.force_shape_refinement import best_force_shape, joint_force_shape
from flexgui.core.diagnose.gram_matrix import gram_matrix
from flexgui.core.diagnose.output_changes import OutputChange
from flexgui.core.effects import effect
from flexgui.core.noise.whitening import no_whitening

SAMPLES = 400
ORDERS = (3.0, 5.0, 8.0)
TIME = np.linspace(0.0, 2.0 * np.pi, SAMPLES)
LEFT = 1e-9
"""Of the squared error: it is made of the columns."""


def wave(joint: int, order: float) -> np.ndarray:
    """(M, 2): each joint shows in its own output."""
    block = np.zeros((SAMPLES, 2))
    block[:, joint - 1] = np.cos(order * TIME)
    return block


def columns() -> list[OutputChange]:
    found = []
    for order in ORDERS:
        shape = (("nr1", order), ("nr2", order))
        for joint in (1, 2):
            parameter = f"ra{joint}"
            found.append(
                OutputChange(
                    effect("torque_ripple"), parameter, {parameter: 1.0, **dict(shape)},
                    {parameter: 1.0}, False, False, shape, (wave(joint, order),),
                )
            )  # fmt: skip
    return found


def test_each_joint_has_its_own_shape() -> None:
    tried = columns()
    errors = [0.7 * wave(1, 3.0) - 0.2 * wave(2, 8.0)]
    slopes = [np.zeros((SAMPLES, 2, 0))]
    w = gram_matrix(errors, slopes, [c.blocks for c in tried], no_whitening).projected()
    found = best_force_shape(effect("torque_ripple"), tried, w)
    shape: dict[str, float] = {}
    for i in found.chosen:
        shape |= joint_force_shape(tried[i])
    assert shape == {"nr1": 3.0, "nr2": 8.0}
    assert found.explained.cost_reduction >= (1.0 - LEFT) * float(np.sum(errors[0] ** 2))
    assert found.trial_count == len(ORDERS) ** 2
