"""Drives: how references become joint torques. One file each, found by walking this folder."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from core.drives.drive import Drive, drive_classes
from core.errors import InputError
from core.sentences import did_you_mean
from core.validation import validated


def build_drive(kind: str, options: Mapping[str, Any]) -> Drive:
    """The drive of a scenario's [drive] section; InputError where an option is wrong."""
    classes = drive_classes()
    if kind not in classes:
        raise InputError(f"[drive] kind {kind!r} is not known; {did_you_mean(kind, classes)}")
    return validated(classes[kind], options, "[drive]", beside=("kind",))
