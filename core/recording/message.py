"""A message of ROS as named numbers: nested fields, arrays, and joints by their names."""

from __future__ import annotations

import re
from typing import Any, NamedTuple

import numpy as np

MOST_FIELDS = 200
"""Numbers of one message that are channels; a picture or a cloud of points has more."""
_REFERENCE = re.compile(r"ref|cmd|command|desired|target|setpoint|goal", re.IGNORECASE)
"""In a topic's name: what it says is wanted, not measured."""
_NUMBER = re.compile(r"\d+")
SECOND = 10**9
"""ns"""


class Flat(NamedTuple):
    """The numbers of one message."""

    names: tuple[str, ...]
    """Paths that begin with the topic."""
    values: list[float]
    stamp: int | None
    """ns, of the message's header."""


def flat(topic: str, message: Any) -> Flat | str:
    """The message's numbers, or why it has none that are channels.

    Args:
        topic: Its name without the first slash.
        message: As `rosbags` makes it: an object with fields.
    """
    header = getattr(message, "header", None)
    stamp = getattr(header, "stamp", None)
    ns = None if stamp is None else int(stamp.sec) * SECOND + int(stamp.nanosec)
    found: list[tuple[str, float]] = []
    if _is_joint_state(message):
        found = _joints(topic, message)
    elif not _collect(topic, message, found):
        return f"has more than {MOST_FIELDS} numbers per message"
    if not found:
        return "holds no numbers"
    return Flat(tuple(name for name, _ in found), [value for _, value in found], ns or None)


def _is_joint_state(message: Any) -> bool:
    return all(hasattr(message, name) for name in ("name", "position", "velocity", "effort"))


def _joints(topic: str, message: Any) -> list[tuple[str, float]]:
    """Fields of each joint, by its name and never by its place in the message."""
    wanted = _REFERENCE.search(topic) is not None
    names = [str(name) for name in message.name]
    numbers = _joint_numbers(names)
    found = []
    for field in ("position", "velocity", "effort"):
        values = getattr(message, field)
        for name, number, value in zip(names, numbers, values, strict=len(values) > 0):
            channel = _channel(field, number, wanted)
            path = f"{topic}/{name}/{field}"
            found.append((f"{path}/{channel}" if channel else path, float(value)))
    return sorted(found)


def _joint_numbers(names: list[str]) -> list[int | None]:
    """The joint (from 1) that each name means by its last number; None where that is not plain."""
    last = [int(found[-1]) if (found := _NUMBER.findall(name)) else None for name in names]
    if None in last or len(set(last)) < len(last):
        return [None] * len(names)
    first = 1 if 0 in last else 0  # some count joints from 0
    return [number + first for number in last if number is not None]


def _channel(field: str, joint: int | None, wanted: bool) -> str:
    if joint is None:
        return ""
    if field == "position":
        return f"theta{joint}_ref" if wanted else f"theta{joint}"
    if field == "velocity":
        return f"dtheta{joint}_ref" if wanted else ""
    return "" if wanted else f"u{joint}"


def _collect(path: str, value: Any, found: list[tuple[str, float]]) -> bool:
    """Adds the numbers below `value`; False where there are too many."""
    if isinstance(value, bool | int | float | np.number):
        found.append((path, float(value)))
    elif isinstance(value, np.ndarray | list | tuple):
        if len(value) > MOST_FIELDS:
            return False
        for k, each in enumerate(value):
            if not _collect(f"{path}{k + 1}", each, found):
                return False
    elif hasattr(value, "__dataclass_fields__"):
        for name in value.__dataclass_fields__:
            if name in ("header", "layout") or name.startswith("__"):
                continue
            here = path if name == "data" else f"{path}/{name}"
            if not _collect(here, getattr(value, name), found):
                return False
    return len(found) <= MOST_FIELDS
