"""FIT per recording and output as bars; validation is hatched."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from core.results import RecordingComparison
from flexgui.views.channel_colours import channel_colour, channel_edge
from flexgui.views.layout import styled
from flexgui.views.names import channel_symbol
from flexgui.views.pooled import VALIDATE


def fit_bars(comparisons: Sequence[RecordingComparison]) -> go.Figure | None:
    """One group of bars per recording, one bar per fitted output; None without a FIT."""
    known = [c for r in comparisons for c in r.channels if c.fitted and np.isfinite(c.fit_percent)]
    names = list(dict.fromkeys(c.channel for c in known))
    if not names:
        return None
    figure = go.Figure()
    for name in names:
        bars = [(r, c) for r in comparisons for c in r.channels if c.fitted and c.channel == name]
        figure.add_bar(
            x=[bar_label(r, comparisons) for r, _ in bars],
            y=[c.fit_percent for _, c in bars],
            name=channel_symbol(name, bars[0][1].unit),
            marker={
                "color": channel_colour(name),
                "line": {"color": channel_edge(name), "width": 1},
                "pattern": {
                    "shape": ["/" if r.role == VALIDATE else "" for r, _ in bars],
                    "fillmode": "overlay",
                },
            },
            hovertemplate="%{x}: %{y:.2f} %",
        )
    figure.update_yaxes(title_text="FIT [%]", range=[0, 100])
    figure.update_xaxes(title_text="recording", type="category", automargin=True)
    text = "FIT = 100 max(1 − ‖measured − model‖ / ‖measured − its mean‖, 0), in per cent."
    if any(r.role == VALIDATE for r in comparisons):
        text += " Hatched: recordings that no fit has seen."
    return styled(figure, 360, text, barmode="group", bargap=0.25)


def bar_label(recording: RecordingComparison, among: Sequence[RecordingComparison]) -> str:
    """The recording's name, with the fit where one recording is compared with several."""
    same = [r for r in among if r.recording == recording.recording]
    if len(same) == 1:
        return recording.recording
    return f"{recording.recording} ({recording.fit_label})"
