"""The channels that a recording may have: one table of names, units and what may be empty."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from functools import cache


class Role(Enum):
    """What a channel measures or commands."""

    TIME = "time"
    SPEED = "speed of a joint"
    PLACE = "place of a joint"
    TORQUE = "torque of a drive"
    CURRENT = "current of a motor"
    VOLTAGE = "voltage of a motor"
    KNOWN_TORQUE = "torque that is known from elsewhere"
    TIP = "place of the tip"
    RIGID = "a fictitious rigid arm's angle or speed"
    DEFLECTION = "deflection of a link"
    OTHER = "what a further sensor measures"


DRIVES = (Role.TORQUE, Role.CURRENT)
"""What moves a joint."""


@dataclass(frozen=True)
class ChannelKind:
    """A family of channels; `#` in the pattern stands for the number of the joint or the axis."""

    pattern: str
    numbers: str
    units: tuple[str, ...]
    """The SI units it may have; more than one where a joint may turn or slide."""
    title: str
    role: Role = Role.OTHER
    reference: bool = False
    """Whether it was commanded, not measured."""
    sparse: bool = False
    """Whether an empty cell means 'no sample'; otherwise every row needs a number."""
    camera: bool = False
    """Whether it comes from the camera, with the camera's clock and delay."""

    @property
    def names(self) -> tuple[str, ...]:
        """The channels of this family."""
        if not self.numbers:
            return (self.pattern,)
        return tuple(self.pattern.replace("#", number) for number in self.numbers)


FURTHER = ChannelKind(
    "input#", "123", ("",), "further signal that formulas may use", sparse=True
)  # fmt: skip

CHANNEL_KINDS = (
    ChannelKind("t", "", ("s",), "time", Role.TIME),
    ChannelKind(
        "dtheta#_ref", "123", ("rad/s", "m/s"), "joint velocity reference", Role.SPEED, True
    ),
    ChannelKind("theta#_ref", "123", ("rad", "m"), "joint position reference", Role.PLACE, True),
    ChannelKind("theta#", "123", ("rad", "m"), "joint position (encoder)", Role.PLACE),
    ChannelKind("u#", "123", ("N m", "N"), "joint torque or force", Role.TORQUE),
    ChannelKind("i#_ref", "123", ("A",), "motor current reference", Role.CURRENT, True),
    ChannelKind("i#", "123", ("A",), "motor current", Role.CURRENT),
    ChannelKind("voltage#", "123", ("V",), "motor voltage", Role.VOLTAGE),
    ChannelKind(
        "known_torque#", "123", ("N m", "N"), "known extra torque or force", Role.KNOWN_TORQUE
    ),
    ChannelKind("z#", "12", ("m",), "end effector (camera)", Role.TIP, sparse=True, camera=True),
    ChannelKind(
        "y#", "12", ("rad",), "fictitious rigid joint angle", Role.RIGID, sparse=True, camera=True
    ),
    ChannelKind("ydot#", "12", ("rad/s",), "its velocity", Role.RIGID, sparse=True, camera=True),
    ChannelKind(
        "deflection#", "123", ("rad", ""), "link deflection (chord angle of its end)",
        Role.DEFLECTION, sparse=True,
    ),
    FURTHER,
)  # fmt: skip


_OF_SENSORS: dict[str, ChannelKind] = {}
"""Pattern -> family, of sensors that bring columns of their own."""


def add_channels(kinds: Iterable[ChannelKind]) -> None:
    """Let recordings have further channels; a sensor's class does so when it is made."""
    for kind in kinds:
        _OF_SENSORS[kind.pattern] = kind
    _by_name.cache_clear()


@cache
def _by_name() -> dict[str, ChannelKind]:
    return {name: kind for kind in known_kinds() for name in kind.names}


def known_kinds() -> tuple[ChannelKind, ...]:
    """All families: those of every recording, then those that sensors bring."""
    return (*CHANNEL_KINDS, *_OF_SENSORS.values())


def channel_names() -> tuple[str, ...]:
    """Every channel that a recording may have."""
    return tuple(_by_name())


def is_channel(name: str) -> bool:
    """Whether the name is one of the channels."""
    return name in _by_name()


def channel_kind(name: str) -> ChannelKind:
    """The family of a channel; KeyError where there is no such channel."""
    return _by_name()[name]


_UNKNOWN = ChannelKind("", "", ("",), "")


def _kind_of_output(name: str) -> ChannelKind:
    """As `channel_kind`; of an output that no recording has as a column one without a role."""
    return _by_name().get(name, _UNKNOWN)


def role_of(name: str) -> Role:
    """What a channel measures or commands."""
    return _kind_of_output(name).role


def is_reference(name: str) -> bool:
    """Whether a channel was commanded, not measured."""
    return _kind_of_output(name).reference


def from_camera(name: str) -> bool:
    """Whether a channel comes with the camera's clock and delay."""
    return _kind_of_output(name).camera


def channel_number(name: str) -> str:
    """The number of a channel within its family; '' where that has one channel only."""
    kind = channel_kind(name)
    return dict(zip(kind.names, kind.numbers, strict=False)).get(name, "")


def joint_of(name: str) -> int | None:
    """The joint (from 0) that a channel belongs to, None for time and the camera's channels."""
    number = channel_number(name)
    return None if channel_kind(name).camera or not number else int(number) - 1
