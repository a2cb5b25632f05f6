"""Sensors: what of a motion is measured. One file each, found by walking this folder."""

from __future__ import annotations

from ..plugins import discover, named
from ..sensors.link_sensor import LinkSensor
from ..sensors.sensor import Sensor


def sensor(kind: str) -> Sensor:
    """The sensor behind an output's name; InputError with the nearest known one otherwise."""
    return named(__name__, Sensor, kind, "[identify] output")


def sensors() -> dict[str, Sensor]:
    """All sensors by their kind."""
    return discover(__name__, Sensor)


def mounted_channels() -> tuple[str, ...]:
    """The channels of sensors that sit at a place of a link."""
    mounted = (one for one in sensors().values() if isinstance(one, LinkSensor))
    return tuple(name for one in mounted for kind in one.columns for name in kind.names)
