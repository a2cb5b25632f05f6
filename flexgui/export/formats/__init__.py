"""The formats in which a model leaves: one file each, found by walking this folder."""

from __future__ import annotations

from flexgui.core.plugins import discover
from flexgui.export.model_format import ModelFormat


def model_formats() -> tuple[ModelFormat, ...]:
    """All of them, in the order of their names."""
    members = discover(__name__, ModelFormat)
    return tuple(members[kind] for kind in sorted(members))
