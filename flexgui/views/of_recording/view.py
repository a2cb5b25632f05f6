"""The contract of a view of a recording's error."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import plotly.graph_objects as go

from core.results import ErrorMaps, RecordingComparison


@dataclass(frozen=True)
class Seen:
    """What a view may draw."""

    current: RecordingComparison
    """The recording under the cursor."""
    comparisons: tuple[RecordingComparison, ...]
    """All recordings, by the same fit."""
    maps: ErrorMaps
    """Their errors beside the floors."""


class RecordingView(ABC):
    """One view: measured against modelled in, a figure out. It keeps nothing between calls."""

    kind: str = ""
    """The id by which a script names it."""
    title: str = ""
    """What the page offers."""
    about: str = ""
    """A line above the figure."""
    nothing: str = "There is nothing to show here."
    """The line where `draw` gives None."""
    place: int = 100
    """Where it stands in the list; equal places stand in the order of their titles."""

    @abstractmethod
    def draw(self, seen: Seen) -> go.Figure | None:
        """Draw the figure; None where there is nothing to show."""
