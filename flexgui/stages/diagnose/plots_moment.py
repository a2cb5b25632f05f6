"""What a diagnosis tries at this moment, and what it would do to the residual."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexgui.core.results import MissingTorque
from flexgui.sentences.written import channel_symbol
from flexgui.views import colours
from flexgui.views.layout import Figure, Pane, axis, headline, line, number, panes
from flexgui.views.missing_torque import missing_cloud
from flexgui.views.names import output_title
from flexgui.views.over_speed import OverSpeed

MORPH = {"morph": True}
MARGIN = 0.08
"""Of the span of a residual, above and below it."""
BESIDE, TICKS = 2, 5
"""Joints that stand beside one another, and how many numbers their axes have: more do not fit into
a panel of 320 px."""
LEAST_SPAN = 2.0
"""Times the noise floor that an axis shows at least, on either side."""


def moment_cloud(
    torques: Sequence[MissingTorque], laws: Sequence[OverSpeed], effect: str,
    first: Sequence[MissingTorque],
) -> Figure:  # fmt: skip
    """The missing torque over the speed with the law of `effect` through it, on the axes of the
    first look; beside one another joints are low enough to be seen together with the ladder."""
    beside = len(torques) <= BESIDE
    figure = missing_cloud(torques, laws, effect, first, beside)
    layout = figure["layout"]
    layout["meta"] = MORPH
    for k in range(len(torques) if beside else 0):
        layout[f"xaxis{number(k)}"]["nticks"] = TICKS
    return figure


def moment_residual(
    channel: str, dt: float, residual: np.ndarray, predicted: np.ndarray | None, effect: str,
    first: np.ndarray, unit: str = "",
) -> Figure:  # fmt: skip
    """The residual (N,) of one output in noise floors with what `effect` predicts of it (N,), on
    the axis of the first look's residual."""
    shown = None if predicted is None else predicted[:, None]
    figure = live_prediction((channel,), dt, residual[:, None], shown, effect, "")
    layout = figure["layout"]
    layout.pop("title")
    layout["meta"] = MORPH
    most = max(float(np.nanmax(np.abs(first), initial=0.0)), LEAST_SPAN) * (1.0 + MARGIN)
    text = f"Δ{channel_symbol(channel, unit)} [× noise floor]"
    layout["yaxis"] |= {"range": [-most, most], "title": axis(text)["title"]}
    return figure


def worst_channel(residual: np.ndarray) -> int:
    """The column of (N, channels) in noise floors that fails most."""
    return int(np.argmax(np.nan_to_num(np.nanmean(np.square(residual), axis=0))))


def cloud_caption(torques: Sequence[MissingTorque], first: Sequence[MissingTorque]) -> str:
    """'joint 1: 0.9 N m rms, joint 2: 0.3 N m rms', after a step with what it was before."""
    before = {one.joint: rms(one) for one in first}
    return ", ".join(
        f"joint {one.joint}: {_changed(before.get(one.joint, rms(one)), rms(one))} {one.unit}"
        for one in torques
    )


def residual_caption(channel: str, unit: str, residual: np.ndarray, first: np.ndarray) -> str:
    """'tip position z₁: 18 times the noise floor', after a step with what it was before."""
    now, was = (float(np.sqrt(np.nanmean(np.square(each)))) for each in (residual, first))
    return f"{output_title(channel, unit)}: {_changed(was, now)} times the noise floor (rms)"


def _changed(was: float, now: float) -> str:
    """'2 → 0.1', or '2' where it is the same."""
    return f"{was:.2g} → {now:.2g}" if abs(now - was) > 0.01 * was else f"{now:.2g}"


def rms(one: MissingTorque) -> float:
    """Of the samples that count, in the unit of the torque."""
    seen = one.missing[one.counted & np.isfinite(one.missing)]
    return float(np.sqrt(np.mean(np.square(seen)))) if seen.size else 0.0


def live_prediction(
    channels: Sequence[str],
    dt: float,
    residual: np.ndarray,
    predicted: np.ndarray | None,
    effect: str,
    title: str,
) -> Figure:
    """A row per output, (rows, channels) in floors; the band is one floor wide each way."""
    time, parts, bands = dt * np.arange(len(residual)), [], []
    for k, name in enumerate(channels):
        hover = "%{y:.3g} × noise floor<extra></extra>"
        lines = [
            line(time, residual[:, k], "residual", colours.RESIDUAL, f"residual {hover}", width=1.0)
        ]
        if predicted is not None:
            shown = f"{effect} {hover}"
            lines.append(line(time, predicted[:, k], effect, colours.ADDED, shown, dash="dash"))
        parts.append(Pane(lines, axis(f"Δ{channel_symbol(name)}")))
        bands.append(
            {
                "type": "rect", "xref": "paper", "yref": f"y{number(k)}", "x0": 0, "x1": 1,
                "y0": -1, "y1": 1, "fillcolor": colours.faded(colours.START, 0.22),
                "line": {"width": 0}, "layer": "below",
            }
        )  # fmt: skip
    return panes(
        parts, axis("time [s]"), gap=0.03, hovermode="x unified", title=headline(title),
        shapes=bands,
    )  # fmt: skip
