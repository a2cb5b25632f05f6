"""A panel of lines that follows a slider: only the numbers are sent and drawn anew."""

from __future__ import annotations

from typing import Any, cast

import numpy as np

from flexgui.panels.page_context import PageContext
from flexgui.views.chart import chart
from flexgui.views.layout import Figure

PADDING = (6, 12, 0, 0)
"""px: above, right, below, left."""


class Lines:
    """One chart; hidden until there is something to draw."""

    def __init__(self, desk: PageContext, height: int, title: str) -> None:
        """`height` in px, without title and legend."""
        self._theme = desk.theme
        self._shown: Figure | None = None
        desk.theme.followers.append(self._recolour)
        nothing = np.array([0.0, 1.0])
        self._look: dict[str, Any] = {}
        self._handle = desk.gui.add_uplot(
            (nothing, nothing), ({}, {}), title=title, height=height, padding=PADDING, visible=False
        )

    def show(self, figure: Figure) -> None:
        """Draws a figure of lines over one common axis; one without any line hides the chart."""
        self._shown = figure
        if not figure["data"]:
            self._handle.visible = False
            return
        found = chart(figure, self._theme.dark)
        self._handle.data = found.data
        if found.look != self._look:
            self._look = found.look
            self._handle.series = cast(Any, found.look["series"])
            self._handle.scales = cast(Any, found.look["scales"])
            self._handle.axes = cast(Any, found.look["axes"])
        self._handle.visible = True

    def _recolour(self, dark: bool) -> None:
        """Text on a canvas follows no style sheet."""
        if self._shown is not None:
            self.show(self._shown)
