"""The controller's own filters against SciPy's, along a non-linear motion."""

from __future__ import annotations

import numpy as np
from scipy.signal import lsim

from flexgui.core.arm.chord import chord_matrix
from flexgui.core.drives import build_drive
from flexgui.core.model import Model
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.simulate.experiment import make_task
from tests.helpers import PAPER, simulate_fixed

AGREEMENT = 1e-4
"""Relative to the largest torque: SciPy is told the motion at 0.1 ms, straight in between."""

W, GAUGE, ZETA = 300.0, 200.0, 0.7
GAINS = np.array([[50.0, 80.0, 3.0, 5.0], [30.0, 50.0, 2.0, 2.0]])
CONSTANTS = np.array([1.5, 0.8])


def test_filtered_state_feedback_is_its_block_diagram() -> None:
    drive = build_drive(
        "state_feedback",
        {
            "gains": GAINS.tolist(),
            "torque_constants": CONSTANTS.tolist(),
            "rate_filter": W,
            "gauge_filter": {"frequency": GAUGE, "damping": ZETA},
        },
    )
    model = Model(PAPER, drive)
    spec = SimulateSpec(
        theta2=1.2, seconds=0.3, sample_time=1e-4, excitation="multisine", amplitude=0.02,
        options={"highest_hz": 20.0, "periods": 1},
    )  # fmt: skip
    task, _ = make_task(model, spec, "r")
    motion = simulate_fixed(model, model.numbers(), task, 4)
    t, start = task.time, task.start[:2]
    angle, bend = motion.q[:, :2], motion.q @ chord_matrix(PAPER, motion.p).T
    low_pass = ([GAUGE**2], [1.0, 2.0 * ZETA * GAUGE, GAUGE**2])
    low_pass_rate = ([GAUGE**2, 0.0], low_pass[1])
    expected = np.empty_like(motion.torque)
    for k in range(2):
        rate = lsim(([W, 0.0], [1.0, W]), angle[:, k] - start[k], t)[1]
        seen = lsim(low_pass, bend[:, k], t)[1]
        seen_rate = lsim(low_pass_rate, bend[:, k], t)[1]
        x = (task.references[:, k] - angle[:, k], -seen, -rate, -seen_rate)
        expected[:, k] = CONSTANTS[k] * GAINS[k] @ np.array(x)
    size = np.abs(expected).max(axis=0)
    assert np.all(np.abs(motion.torque - expected).max(axis=0) < AGREEMENT * size)
