"""An arm: a planar chain of one to three segments."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from core.arm.segment import Segment


class Arm(BaseModel):
    """A chain of segments in a plane, with gravity (zero by default) acting in that plane.

    Coordinates q = [joint positions..., modal coordinates of segment 1, of segment 2, ...].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    segments: Annotated[tuple[Segment, ...], Field(min_length=1, max_length=3)]
    gravity: tuple[float, float] = (0.0, 0.0)
    name: str = "arm"

    @property
    def joints(self) -> int:
        return len(self.segments)

    @property
    def modes(self) -> tuple[int, ...]:
        return tuple(segment.modes for segment in self.segments)

    @property
    def coordinates(self) -> int:
        """n, the length of q."""
        return self.joints + sum(self.modes)

    @property
    def coordinate_names(self) -> tuple[str, ...]:
        joints = [f"theta{k + 1}" for k in range(self.joints)]
        modal = [f"v{k + 1}_{i + 1}" for k, n in enumerate(self.modes) for i in range(n)]
        return tuple(joints + modal)

    def modal_slice(self, segment: int) -> slice:
        """Where the modal coordinates of a segment (from 0) stand in q."""
        start = self.joints + sum(self.modes[:segment])
        return slice(start, start + self.modes[segment])

    @property
    def two_revolute(self) -> bool:
        """Whether the fictitious rigid arm (y, design section 2) is defined."""
        return len(self.segments) == 2 and all(
            s.joint == "revolute" and s.mount == "previous" for s in self.segments
        )
