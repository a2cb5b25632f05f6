"""The one picture of a diagnosis: what the model lacks, and the first candidate in it.

Both kinds keep the axes of the first look, so that what an added effect explains is seen to go.
`meta.morph` lets the page move the dots or the line from where they were to where they are.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from core.effects.over_speed import OverSpeed
from core.results import MissingTorque
from flexgui.views.live import Figure
from flexgui.views.live_missing import missing_cloud
from flexgui.views.live_prediction import live_prediction
from flexgui.views.names import channel_symbol, output_title

MORPH = {"morph": True}
ROOM = 0.08
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
    most = max(float(np.nanmax(np.abs(first), initial=0.0)), LEAST_SPAN) * (1.0 + ROOM)
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
