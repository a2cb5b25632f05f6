"""What sensors that are mounted on links have in common."""

from __future__ import annotations

import numpy as np

from ..arm.arm import Arm
from ..arm.mount import Mount
from ..arm.slots import LENGTH, slot
from ..recording.channels import ChannelKind, channel_number
from ..sensors.sensor import Channel, Sensor

SECOND = "b"
"""After the number of a link whose second sensor of a kind it is."""


def families(kind: str, unit: str, title: str) -> tuple[ChannelKind, ...]:
    """The columns of a kind of sensor: one per link, and a second one on each."""
    return (
        ChannelKind(f"{kind}#", "123", (unit,), title, sparse=True),
        ChannelKind(f"{kind}#{SECOND}", "123", (unit,), f"{title}, second place", sparse=True),
    )


class LinkSensor(Sensor):
    """A sensor at a place of a link. Each channel stands for itself: a rig may have it on some
    links only, or two on one."""

    unit = ""
    on_bending_links: bool = False
    """Whether a rigid link cannot have it."""
    at_end: bool = True
    """Whether it sits at the end of its link where no place is stated; else at the root."""
    primary = True
    optional = True
    each_alone = True

    def _links(self, arm: Arm) -> list[int]:
        return [k for k, modes in enumerate(arm.modes) if modes or not self.on_bending_links]

    def channels(self, arm: Arm) -> tuple[Channel, ...]:
        second = [f"{self.kind}{k + 1}{SECOND}" for k in self._links(arm)]
        names = [f"{self.kind}{k + 1}" for k in self._links(arm)]
        stated = dict(arm.mounts)
        return tuple(Channel(n, self.unit) for n in [*names, *(n for n in second if n in stated)])

    def is_stated(self, arm: Arm) -> bool:
        return any(c.name in dict(arm.mounts) for c in self.channels(arm))

    def defined_on(self, arm: Arm) -> bool:
        return bool(self._links(arm))

    def places(self, arm: Arm, p: np.ndarray) -> list[tuple[int, float, Mount]]:
        """Of each channel the segment (from 0), the distance from its joint in m, and what is
        stated; p (13 N + 5,) are the arm's numbers."""
        found = []
        for channel in self.channels(arm):
            k = int(channel_number(channel.name)) - 1
            mount = dict(arm.mounts).get(channel.name, Mount())
            default = float(p[slot(k, LENGTH)]) if self.at_end else 0.0
            found.append((k, default if mount.place is None else mount.place, mount))
        return found
