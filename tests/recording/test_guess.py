"""Headings as laboratories write them are taken for what they are, and nothing else is guessed."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.core.recording.sources import Guess, guess_columns
from flexgui.core.sensors import sensors

sensors()  # they bring columns of their own

LOOP = ("t", "dtheta1_ref", "dtheta2_ref", "theta1", "theta2", "z1", "z2")
TORQUE = ("t", "u1", "u2", "theta1", "theta2", "z1", "z2")

FILES = {
    "own names": (LOOP, LOOP),
    "words": (LOOP, ("clock", "vel_cmd_1", "vel_cmd_2", "enc_1", "enc_2", "cam_x", "cam_y")),
    "from zero": (LOOP, ("Time", "qd_des0", "qd_des1", "q0", "q1", "tip_x", "tip_y")),
    "camel": (
        LOOP,
        ("timestamp", "Joint1VelocitySetpoint", "Joint2VelocitySetpoint", "Joint1Position",
         "Joint2Position", "CameraX", "CameraY"),
    ),
    "torques": (TORQUE, ("time", "tau_1", "tau_2", "pos_1", "pos_2", "marker_x", "marker_y")),
    "body": (
        LOOP,
        ("Zeit", "shoulder_speed_ref", "elbow_speed_ref", "shoulder_angle", "elbow_angle",
         "tcp_x", "tcp_y"),
    ),
    "voltage": (("t", "voltage1", "theta1", "deflection1"), ("time", "Vm", "theta", "strain")),
    "two encoders": (
        ("t", "i1", "theta1", "link_theta1"), ("t", "motor_current", "motor_angle", "link_angle")
    ),
    "pulses": (("t", "u1", "theta1", "known_torque1"), ("t", "force", "pos", "pulse")),
}  # fmt: skip


def columns(headers) -> dict[str, np.ndarray]:  # type: ignore[no-untyped-def]
    rng = np.random.default_rng(1)
    time = np.arange(50) * 1e-3
    return {h: time if k == 0 else rng.standard_normal(50) for k, h in enumerate(headers)}


@pytest.mark.parametrize("order", [1, -1])
@pytest.mark.parametrize("name", FILES)
def test_headings_are_taken_for_what_they_are(name: str, order: int) -> None:
    wanted, headers = FILES[name]
    whole = dict(list(columns(headers).items())[::order])
    found = guess_columns(whole, wanted)
    assert {c: one.header for c, one in found.items()} == dict(zip(wanted, headers, strict=True))


def test_a_unit_at_the_end_of_a_name_counts() -> None:
    found = guess_columns(columns(("t", "vel_cmd_1_deg", "enc_1_deg", "cam_x_mm")), LOOP)
    assert found["theta1"] == Guess("enc_1_deg", "deg")
    assert found["dtheta1_ref"] == Guess("vel_cmd_1_deg", "deg/s")
    assert found["z1"] == Guess("cam_x_mm", "mm")


def test_a_heading_that_says_nothing_or_something_else_is_not_guessed() -> None:
    assert guess_columns(columns(("column 1", "enc_1")), LOOP)["t"].header == "column 1"
    assert "z1" not in guess_columns(columns(("t", "y1 [rad]")), LOOP)
    found = guess_columns(columns(("t", "link1_angle")), (*LOOP, "link_theta1"))
    assert found["theta1"].header == "link1_angle" and "link_theta1" not in found
    rng = np.random.default_rng(1)
    file = {f"c{k}": rng.standard_normal(50) for k in range(4)}
    assert guess_columns(file, LOOP) == {}
    assert guess_columns({}, LOOP) == {}
