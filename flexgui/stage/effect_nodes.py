"""Effects that were added to the model, written where they act on the arm."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from flexgui.stage.scene import Owner, Stage

NAME = "effects"
"""Under which they are attached."""

RISE, APART = 0.21, 0.07
"""Of the arm's reach: how high the first stands over its place, and the next over it."""

SCALE = 1.1


@dataclass(frozen=True)
class Drawn:
    """One effect to write."""

    title: str
    place: str
    """As effects state it: joints, tip, segments, base, camera or drive."""


def show_effects(stage: Stage, owner: Owner, effects: Sequence[Drawn]) -> None:
    """Writes them instead of what was written before."""
    reach, taken, handles = stage.body.reach, dict[str, int](), []
    joints = stage.body.arm.joints
    stage.detach(NAME)  # first: the new ones may have the same names
    for k, one in enumerate(effects):
        for place in _anchors(one.place, joints):
            level = taken.get(place, 0)
            taken[place] = level + 1
            handles.append(
                owner.scene.add_label(
                    f"{stage.anchor(place)}/effect{k}", f"+ {one.title}",
                    position=(0.0, 0.0, (RISE + APART * level) * reach),
                    font_screen_scale=SCALE,
                )
            )  # fmt: skip
    stage.attach(NAME, *handles)


def _anchors(place: str, joints: int) -> list[str]:
    """Names of the stage's places; a segment is written at its end."""
    each = {
        "joints": [f"origin{k + 1}" for k in range(joints)],
        "drive": ["origin1"],
        "segments": [f"end{k + 1}" for k in range(joints)],
        "tip": ["tip"],
        "camera": ["camera"],
    }
    return each.get(place, ["base"])
