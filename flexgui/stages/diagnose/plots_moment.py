"""What a diagnosis tries at this moment, and what it would do to the residual."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexgui.core.results import MissingTorque
from flexgui.views import colours
from flexgui.views.layout import Figure, axis, frame, short
from flexgui.views.missing_torque import missing_cloud
from flexgui.views.names import channel_symbol, output_title
from flexgui.views.over_speed import OverSpeed

MORPH = {"morph": True}
MARGIN = 0.08
"""Of the span of a residual, above and below it."""
BESIDE, GAP, TICKS = 2, 0.17, 5
"""Joints that stand beside one another, the share of the width between them, and how many numbers
their axes have: more do not fit into a panel of 320 px."""
LEAST_SPAN = 2.0
"""Times the noise floor that an axis shows at least, on either side."""


def moment_cloud(
    torques: Sequence[MissingTorque], laws: Sequence[OverSpeed], effect: str,
    first: Sequence[MissingTorque],
) -> Figure:  # fmt: skip
    """The missing torque over the speed with the law of `effect` through it, on the axes of the
    first look."""
    figure = missing_cloud(torques, laws, effect, first)
    layout = figure["layout"]
    layout["meta"] = MORPH
    if len(torques) <= BESIDE:
        _side_by_side(layout, len(torques))
    return figure


def _side_by_side(layout: Figure, count: int) -> None:
    """A column per joint: low enough to be seen together with the ladder."""
    width = (1.0 - GAP * (count - 1)) / count
    for k in range(count):
        number = "" if k == 0 else str(k + 1)
        left = k * (width + GAP)
        layout[f"xaxis{number}"]["domain"] = [left, left + width]
        layout[f"xaxis{number}"]["nticks"] = TICKS
        layout[f"yaxis{number}"]["domain"] = [0.0, 1.0]


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
    layout["yaxis"] |= {"range": [-most, most]}
    layout["yaxis"]["title"] = {
        "text": f"Δ{channel_symbol(channel, unit)} [× noise floor]",
        "standoff": 8,
    }
    return figure


def worst_channel(residual: np.ndarray) -> int:
    """The column of (N, channels) in noise floors that fails most."""
    return int(np.argmax(np.nan_to_num(np.nanmean(np.square(residual), axis=0))))


def cloud_caption(torques: Sequence[MissingTorque], first: Sequence[MissingTorque]) -> str:
    """'joint 1: 0.9 N m rms, joint 2: 0.3 N m rms', after a step with what it was before."""
    before = {one.joint: rms(one) for one in first}
    parts = []
    for one in torques:
        now, was = rms(one), before.get(one.joint, rms(one))
        change = f"{was:.2g} → " if abs(now - was) > 0.01 * was else ""
        parts.append(f"joint {one.joint}: {change}{now:.2g} {one.unit}")
    return ", ".join(parts)


def rms(one: MissingTorque) -> float:
    """Of the samples that count, in the unit of the torque."""
    seen = one.missing[one.counted & np.isfinite(one.missing)]
    return float(np.sqrt(np.mean(np.square(seen)))) if seen.size else 0.0


def residual_caption(channel: str, unit: str, residual: np.ndarray, first: np.ndarray) -> str:
    """'tip position z₁: 18 times the noise floor', after a step with what it was before."""
    now, was = (float(np.sqrt(np.nanmean(np.square(each)))) for each in (residual, first))
    change = f"{was:.2g} → " if abs(now - was) > 0.01 * was else ""
    return f"{output_title(channel, unit)}: {change}{now:.2g} times the noise floor (rms)"


def live_prediction(
    channels: Sequence[str],
    dt: float,
    residual: np.ndarray,
    predicted: np.ndarray | None,
    effect: str,
    title: str,
) -> Figure:
    """A row per output, (rows, channels) in floors; the band is one floor wide each way."""
    count = len(channels)
    layout: Figure = frame(400, "") | {"hovermode": "x unified"}
    layout["font"] = {**layout["font"], "size": 11}
    layout["title"] = {
        "text": title, "x": 0.01, "xanchor": "left", "y": 0.985, "yanchor": "top",
        "font": {"size": 12},
    }  # fmt: skip
    layout["xaxis"] = axis("time [s]") | {"anchor": f"y{count if count > 1 else ''}"}
    time = dt * np.arange(len(residual))
    data: list[Figure] = []
    for k, name in enumerate(channels):
        number = "" if k == 0 else str(k + 1)
        top = 1.0 - k / count
        layout[f"yaxis{number}"] = axis(f"Δ{channel_symbol(name)}") | {
            "anchor": "x", "domain": [top - 1.0 / count + 0.03, top],
        }  # fmt: skip
        data.append(_line(time, residual[:, k], "residual", colours.RESIDUAL, 1.0, number))
        if predicted is not None:
            data.append(_line(time, predicted[:, k], effect, colours.ADDED, 1.6, number, "dash"))
    layout["shapes"] = [_band(k) for k in range(count)]
    return {"data": data, "layout": layout}


def _line(
    x: np.ndarray,
    y: np.ndarray,
    name: str,
    colour: str,
    width: float,
    number: str,
    dash: str = "solid",
) -> Figure:
    return {
        "type": "scatter", "mode": "lines", "x": short(x), "y": short(y), "name": name,
        "xaxis": "x", "yaxis": f"y{number}", "legendgroup": name, "showlegend": number == "",
        "line": {"color": colour, "width": width, "dash": dash},
        "hovertemplate": f"{name} %{{y:.3g}} × noise floor<extra></extra>",
    }  # fmt: skip


def _band(k: int) -> Figure:
    number = "" if k == 0 else str(k + 1)
    return {
        "type": "rect", "xref": "paper", "yref": f"y{number}", "x0": 0, "x1": 1, "y0": -1, "y1": 1,
        "fillcolor": colours.faded(colours.START, 0.22), "line": {"width": 0}, "layer": "below",
    }  # fmt: skip
