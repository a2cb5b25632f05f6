"""FIT per recording and output as bars, for a panel; validation is hatched."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from core.results import RecordingComparison
from flexgui.views.channel_colours import channel_colour, channel_edge
from flexgui.views.fit_bars import bar_label
from flexgui.views.live import Figure, ax, figure
from flexgui.views.names import channel_symbol
from flexgui.views.pooled import VALIDATE

ROOM = 118.0
"""%, of the axis: above a bar that is full its output is written."""


def live_fit(comparisons: Sequence[RecordingComparison]) -> Figure | None:
    """None where nothing has a FIT."""
    known = [c for r in comparisons for c in r.channels if c.fitted and np.isfinite(c.fit_percent)]
    names = list(dict.fromkeys(c.channel for c in known))
    if not names:
        return None
    traces = [_bars(name, comparisons) for name in names]
    return figure(
        traces, ax("", type="category", tickangle=0 if len(comparisons) < 10 else 45),
        ax("FIT [%]", range=[0.0, ROOM], tickvals=[0, 50, 100]), "FIT (hatched: validation)",
        barmode="group", bargap=0.25,
    )  # fmt: skip


def _bars(name: str, comparisons: Sequence[RecordingComparison]) -> Figure:
    bars = [(r, c) for r in comparisons for c in r.channels if c.fitted and c.channel == name]
    hatch = ["/" if r.role == VALIDATE else "" for r, _ in bars]
    return {
        "type": "bar", "name": channel_symbol(name, bars[0][1].unit),
        "x": [bar_label(r, comparisons).removeprefix("θ2 = ") for r, _ in bars],
        "text": [channel_symbol(name, bars[0][1].unit)] * len(bars), "textposition": "outside",
        "textangle": 0, "cliponaxis": False,
        "y": [round(c.fit_percent, 3) if np.isfinite(c.fit_percent) else None for _, c in bars],
        "marker": {
            "color": channel_colour(name), "line": {"color": channel_edge(name), "width": 1},
            "pattern": {"shape": hatch, "fillmode": "overlay"},
        },
        "hovertemplate": "%{x}: %{y:.2f} %<extra></extra>",
    }  # fmt: skip
