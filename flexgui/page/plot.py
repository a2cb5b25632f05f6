"""A Plotly panel that is cheap to update."""

from __future__ import annotations

import json
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Protocol

from viser import _messages

from flexgui.views.layout import Figure, figure_json, headline, plain

if TYPE_CHECKING:
    import plotly.graph_objects as go

    from flexgui.page.panel import PageContext

PLOT_MARGIN = {"l": 68, "r": 10, "t": 28, "b": 46}
CONFIG = {"displayModeBar": False}
FONT_SIZE = 12
USUAL_HEIGHT, MOST_STRETCH = 900.0, 1.6
"""px of a window, and how much higher figures become in a high one that has two columns."""
PANEL_WIDTH = 540.0
"""px of the panel on the left."""


class Fitted(Protocol):
    """What follows the size of the area."""

    def fit(self) -> None:
        """Takes the size of the area."""


class PlotArea:
    """The size of the figures of one page; in a narrower panel they keep their height in px, in a
    high window they are higher."""

    def __init__(self) -> None:
        self.width, self.columns, self.stretch = PANEL_WIDTH, 1, 1.0
        self.plots: list[Fitted] = []

    def resize(self, width: float, columns: int, height: float = USUAL_HEIGHT) -> None:
        """Sets the width in px, the number of columns and the height of the window in px; all
        figures follow."""
        stretch = min(max(height / USUAL_HEIGHT, 1.0), MOST_STRETCH) if columns > 1 else 1.0
        if (width, columns, stretch) != (self.width, self.columns, self.stretch):
            self.width, self.columns, self.stretch = width, columns, stretch
            for plot in self.plots:
                plot.fit()

    def figure_width(self, wide: bool) -> float:
        """px of one figure, which is as wide as the area or as one of its columns."""
        return self.width if wide else self.width / self.columns


BLANK: Any = SimpleNamespace(to_json=lambda: '{"data":[],"layout":{}}')
"""The part of a figure that viser needs: Plotly's own class is slow to make."""


class Plot:
    """One figure; hidden if there is nothing to draw."""

    def __init__(
        self, context: PageContext, aspect: float, title: str = "", wide: bool = False
    ) -> None:
        """`aspect` is height over width in a usual window; `title` for figures that have none;
        `wide`: over all columns."""
        self._context, self._title, self._height = context, title, aspect * PANEL_WIDTH
        self._wide = wide
        if wide:
            context.gui.add_html("<span class='fx-wide'></span>")
        self._handle = context.gui.add_plotly(BLANK, aspect=aspect, visible=False)
        context.plot_area.plots.append(self)
        self.fit()
        self._sent = 0

    def show(self, figure: Figure | None, begins: float | None = None, height: float = 0.0) -> None:
        """Draws a figure; None hides the plot. `begins`: where on its axis the recording begins, s;
        None: it has no cursor. `height` in px, 0: as high as it was."""
        if figure is None:
            self._handle.visible = False
            return
        self._height = height or self._height
        self.fit()
        layout = dict(figure["layout"])
        font = {**layout.get("font", {}), "size": FONT_SIZE}
        layout |= {"margin": PLOT_MARGIN, "height": None, "template": {}, "font": font}
        if self._title:
            layout |= titled(self._title, layout)
        self._sent += 1
        meta = {"cursor": self._key, "at": self._at(begins), "begins": begins}
        layout["meta"] = {**layout.get("meta", {}), **meta}
        drawn = {"data": figure["data"], "config": CONFIG, "layout": layout}
        self._handle._plotly_json_str = figure_json(drawn)
        self._handle.visible = True

    def show_whole(self, figure: Figure | go.Figure | None) -> None:
        """Draws one of the report's figures, as high as it wants to be."""
        drawn = None if figure is None else plain(figure)
        height = 0.0 if drawn is None else float(drawn["layout"].get("height") or PANEL_WIDTH / 2)
        self.show(drawn, height=height)

    def fit(self) -> None:
        """Keeps the height in px in a panel of another width."""
        if not self._handle._impl.removed:
            area = self._context.plot_area
            self._handle.aspect = self._height * area.stretch / area.figure_width(self._wide)

    @property
    def _key(self) -> str:
        """The key of the figure as it was drawn last, for the browser."""
        return f"{self._handle._impl.uuid}-{self._sent}"

    def _at(self, begins: float | None) -> float | None:
        """Where the time-line's cursor stands on the axis, s."""
        return None if begins is None else begins + self._context.session.playback.cursor.time

    def move_cursor(self, begins: float | None) -> None:
        """Moves the cursor to where the time-line stands, in the browser only: sending the figure
        again would need 400 KB a second while a recording plays. `begins` in s as in `show`."""
        key, at = json.dumps(self._key), json.dumps(self._at(begins))
        message = _messages.RunJavascriptMessage(f"window.fxCursor && window.fxCursor({key}, {at})")
        self._context.gui._websock_interface.queue_message(message)


def titled(title: str, layout: dict[str, Any]) -> dict[str, Any]:
    """The title on the left, the legend on the right of one line (left of a note there)."""
    beside: dict[str, Any] = {"x": 1.0, "xanchor": "right", "font": {"size": 10}}
    if layout.get("annotations"):
        beside |= {"x": 0.0, "xanchor": "left"}
    return {"title": headline(title), "legend": layout.get("legend", {}) | beside}
