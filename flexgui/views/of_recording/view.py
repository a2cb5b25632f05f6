"""The contract of a view of a recording's error."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from flexgui.core.recording.channels import Role, role_of
from flexgui.core.results import ErrorMaps, RecordingComparison
from flexgui.views.layout import Figure

if TYPE_CHECKING:
    import plotly.graph_objects as go


@dataclass(frozen=True)
class Seen:
    """Input of a view."""

    current: RecordingComparison
    """The recording under the cursor."""
    comparisons: tuple[RecordingComparison, ...]
    """All recordings, by the same fit."""
    maps: ErrorMaps
    """Their errors beside the floors."""
    dark: bool = False
    """Whether the ground of the page is dark."""


def believable_floors(comparisons: Sequence[RecordingComparison]) -> dict[str, float]:
    """Plausible noise floors without a diagnosis, by channel in its unit.

    Of what was fitted and of the encoders; what is computed from other channels has no noise of
    its own. As in a diagnosis a small modelling tolerance is part of them: no model is good for
    the last thousandth of what a channel does.
    """
    from flexgui.core.diagnose.search_options import FIDELITY  # late: it loads all of a diagnosis
    from flexgui.core.error_maps import noise_floors

    spread: dict[str, list[float]] = {}
    for r in comparisons:
        for c in r.channels:
            if c.counted.any() and (c.fitted or role_of(c.channel) is Role.PLACE):
                spread.setdefault(c.channel, []).append(float(np.std(c.measured[c.counted])))
    noise = noise_floors(comparisons)
    floors = {
        name: float(np.hypot(noise.get(name, 0.0), FIDELITY * np.median(sizes)))
        for name, sizes in spread.items()
    }
    return {name: floor for name, floor in floors.items() if floor > 0.0}


class RecordingView(ABC):
    """One view: comparisons in, a figure out. It keeps no state."""

    kind: str = ""
    """The id by which a script names it."""
    title: str = ""
    """What the page offers."""
    about: str = ""
    """A line above the figure."""
    nothing: str = "There is nothing to show here."
    """The line where `draw` gives None."""
    in_report: bool = False
    """Whether reports show it too, of the first recording."""
    place: int = 100
    """Where it stands in the list; equal places stand in the order of their titles."""

    @abstractmethod
    def draw(self, seen: Seen) -> Figure | go.Figure | None:
        """Draw the figure, plain or an object of Plotly; None where there is nothing to show."""
