"""Kinds of joint, one file each, found by walking this folder."""

from __future__ import annotations

from ...arm.joints.joint import Joint
from ...plugins import named


def joint(kind: str) -> Joint:
    """The joint of that kind; InputError with the nearest known kind otherwise."""
    return named(__name__, Joint, kind, "joint")
