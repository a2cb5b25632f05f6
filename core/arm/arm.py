"""An arm: a planar chain of one to three segments."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from pydantic import Field, field_validator

from ..arm.mount import Mount
from ..arm.segment import Segment
from ..validation import Bounded, Positive, Stated

MOST_SEGMENTS = 3


class Pedestal(Stated):
    """What joint 1 stands on where it turns under the arm: a rotational spring with an inertia."""

    compliance: Positive
    """rad/(N m)"""
    inertia: Positive
    """kg m², of all that turns with the motor's housing, about the axis of joint 1."""


class Arm(Stated):
    """A chain of segments in a plane, with gravity (zero by default) acting in that plane.

    Coordinates q = [joint positions..., modal coordinates of segment 1, of segment 2, ...,
    twists of the elastic joints..., the two displacements of an elastic base, the angle of a
    pedestal].
    """

    segments: Annotated[tuple[Segment, ...], Field(min_length=1)]
    """One to three, from the base to the tip."""
    gravity: tuple[Bounded, Bounded] = (0.0, 0.0)
    """m/s² in the plane of motion."""
    base_compliance: Positive | None = None
    """m/N, the same in both directions; None: the base does not move."""
    pedestal: Pedestal | None = None
    """None: the base does not turn."""
    name: str = "arm"
    """For display."""
    mounts: Annotated[tuple[tuple[str, Mount], ...], Field(exclude=True)] = ()
    """Channel -> where its sensor sits, as `[sensors]` states it."""

    @field_validator("segments")
    @classmethod
    def _check_count(cls, segments: tuple[Segment, ...]) -> tuple[Segment, ...]:
        if len(segments) > MOST_SEGMENTS:
            raise ValueError(
                f"has {len(segments)} entries; an arm has one to {MOST_SEGMENTS} segments, as "
                f"recordings have signals of joints 1 to {MOST_SEGMENTS}. State links that do not "
                "move relative to each other as one."
            )
        return segments

    @property
    def joints(self) -> int:
        """Number of joints, one per segment."""
        return len(self.segments)

    @property
    def modes(self) -> tuple[int, ...]:
        """Bending modes of each segment; 0 is rigid."""
        return tuple(segment.modes for segment in self.segments)

    @property
    def coordinates(self) -> int:
        """n, the length of q."""
        base = 2 if self.base_compliance is not None else 0
        turns = self.pedestal is not None
        return self.joints + sum(self.modes) + sum(self.elastic) + base + turns

    @property
    def elastic(self) -> tuple[bool, ...]:
        """Which joints twist."""
        return tuple(s.joint_compliance is not None for s in self.segments)

    @property
    def coordinate_names(self) -> tuple[str, ...]:
        """The coordinates q in their order: theta, v, twist, base, pedestal."""
        joints = [f"theta{k + 1}" for k in range(self.joints)]
        modal = [f"v{k + 1}_{i + 1}" for k, n in enumerate(self.modes) for i in range(n)]
        twists = [f"twist{k + 1}" for k, elastic in enumerate(self.elastic) if elastic]
        base = ["base1", "base2"] if self.base_compliance is not None else []
        pedestal = ["pedestal"] if self.pedestal is not None else []
        return tuple(joints + modal + twists + base + pedestal)

    def modal_slice(self, segment: int) -> slice:
        """Where the modal coordinates of a segment (from 0) stand in q."""
        start = self.joints + sum(self.modes[:segment])
        return slice(start, start + self.modes[segment])

    def twist_place(self, segment: int) -> int | None:
        """Where the twist of a joint (from 0) stands in q; None where the joint is rigid."""
        if not self.elastic[segment]:
            return None
        return self.joints + sum(self.modes) + sum(self.elastic[:segment])

    def carries_motor(self, segment: int) -> bool:
        """Whether the motor that turns a segment (from 0) stands on a segment that moves."""
        s = self.segments[segment]
        return segment > 0 and s.mount == "previous" and s.joint == "revolute"

    @property
    def two_revolute(self) -> bool:
        """Whether the fictitious rigid arm (y, design section 2) is defined."""
        return len(self.segments) == 2 and all(
            s.joint == "revolute" and s.mount == "previous" for s in self.segments
        )


@dataclass(frozen=True)
class Structure:
    """What is compiled in: kinds of joint, number of modes, mounts."""

    joints: tuple[str, ...]
    modes: tuple[int, ...]
    mounts: tuple[str, ...]
    elastic: tuple[bool, ...] = ()
    """Which joints twist; none where empty."""
    base: bool = False
    """Whether the base moves."""
    pedestal: bool = False
    """Whether the base turns."""

    @classmethod
    def of(cls, arm: Arm) -> Structure:
        """The structure of an arm, without its numbers."""
        return cls(
            tuple(s.joint for s in arm.segments),
            arm.modes,
            tuple(s.mount for s in arm.segments),
            arm.elastic if any(arm.elastic) else (),
            arm.base_compliance is not None,
            arm.pedestal is not None,
        )

    @property
    def segments(self) -> int:
        """Number of segments."""
        return len(self.joints)

    @property
    def coordinates(self) -> int:
        """Number n of coordinates q."""
        still = self.segments + sum(self.modes) + sum(self.elastic)
        return still + 2 * self.base + self.pedestal
