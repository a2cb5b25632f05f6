"""Sensors: what of a motion is measured. One file each, found by walking this folder."""

from __future__ import annotations

from ..plugins import discover
from ..sensors.sensor import Sensor


def sensor(kind: str) -> Sensor:
    """The sensor behind an output's name; InputError with the nearest known one otherwise."""
    return discover(__name__, Sensor).named(kind, "[identify] output")


def sensors() -> dict[str, Sensor]:
    """All sensors by their kind."""
    return discover(__name__, Sensor).members
