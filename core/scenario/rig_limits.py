"""`[limits]` of a scenario: what the rig may do in an experiment that was not made yet."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator

from core.recording.spec import Interval, Positive, Settings


def _one_as_list(value: Any) -> Any:
    """One number stands for every joint."""
    return (value,) if isinstance(value, int | float) else value


def _pair_as_list(value: Any) -> Any:
    """One [low, high] stands for every joint."""
    flat = isinstance(value, list | tuple) and value and not isinstance(value[0], list | tuple)
    return (value,) if flat else value


PerJoint = Annotated[tuple[Positive, ...], BeforeValidator(_one_as_list)]
Ranges = Annotated[tuple[Interval, ...], BeforeValidator(_pair_as_list)]


class LimitsSpec(Settings):
    """`[limits]`: what an experiment that is planned may ask of the rig.

    Each is one value for all joints or a list with one per joint. What is not stated is what the
    model does on the estimation recordings: nobody has said that the rig can do more.
    """

    position: Ranges | None = None
    """rad (m on a slide), [low, high] per joint."""
    speed: PerJoint | None = None
    """rad/s (m/s on a slide), per joint."""
    torque: PerJoint | None = None
    """N m (N on a slide), per joint."""
    reach: tuple[Interval, Interval] | None = None
    """m, [low, high] of z1 and of z2 for the tip; left out: wherever the joints may take it."""
