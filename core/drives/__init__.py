"""Drives: how references become joint torques. One file each, found by walking this folder."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..drives.drive import Drive, drive_classes
from ..drives.known_joints import (
    KNOWN_MOTION,
    KNOWN_TORQUE,
    with_known_motion,
    with_known_torque,
)
from ..errors import InputError
from ..sentences import did_you_mean
from ..validation import validated


def build_drive(kind: str, options: Mapping[str, Any]) -> Drive:
    """The drive of a scenario's [drive] section; InputError where an option is wrong."""
    classes = drive_classes()
    if kind not in classes:
        raise InputError(f"[drive] kind {kind!r} is not known; {did_you_mean(kind, classes)}")
    beside = (KNOWN_TORQUE, KNOWN_MOTION)
    own = {key: value for key, value in options.items() if key not in beside}
    drive = validated(classes[kind], own, "[drive]", beside=("kind", *beside))
    pushed = with_known_torque(drive, options.get(KNOWN_TORQUE, ()))
    return with_known_motion(pushed, options.get(KNOWN_MOTION, ()))
