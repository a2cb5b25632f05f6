"""Where a sensor sits on a link."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator

from ..validation import Bounded, NonNegative, Stated


def _not_zero(value: float) -> float:
    if value == 0.0:
        raise ValueError("is 0; a gauge on the neutral fibre shows nothing.")
    return value


class Mount(Stated):
    """The place of a gauge, an accelerometer or a gyroscope on its link."""

    place: NonNegative | None = None
    """m from the link's joint; None: a gauge is at the root, other sensors at the end."""
    distance: Annotated[Bounded, AfterValidator(_not_zero)] | None = None
    """m from the link's neutral fibre to a strain gauge, positive to the left of the link; None:
    not known, so the gauge's gain is estimated."""
