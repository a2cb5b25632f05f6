"""What of an arm decides which equations are compiled."""

from __future__ import annotations

from dataclasses import dataclass

from core.arm.arm import Arm


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

    @classmethod
    def of(cls, arm: Arm) -> Structure:
        """The structure of an arm, without its numbers."""
        return cls(
            tuple(s.joint for s in arm.segments),
            arm.modes,
            tuple(s.mount for s in arm.segments),
            arm.elastic if any(arm.elastic) else (),
            arm.base_compliance is not None,
        )

    @property
    def segments(self) -> int:
        """Number of segments."""
        return len(self.joints)

    @property
    def coordinates(self) -> int:
        """Number n of coordinates q."""
        return self.segments + sum(self.modes) + sum(self.elastic) + 2 * self.base
