"""The missing joint torque of one recording, small enough to stand beside the playing arm."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from core.effects.over_speed import OverSpeed
from core.results import MissingTorque
from core.written import ShownUnit, shown_unit
from flexgui.views import colours
from flexgui.views.decimate import trace
from flexgui.views.layout import axis, frame
from flexgui.views.live import Figure, short
from flexgui.views.residual_over import DIRECTIONS

POINTS = 600
ROOM = 0.06
"""Of the span of a cloud, above and below it."""


def missing_curve(torques: Sequence[MissingTorque]) -> Figure:
    """A row per joint over a shared time axis in s."""
    layout = _frame(torques)
    layout["xaxis"] = axis("time [s]") | {"anchor": f"y{_number(len(torques) - 1)}"}
    data = []
    for k, one in enumerate(torques):
        unit = shown_unit(one.missing[one.counted], one.unit)
        x, y = trace(one.time, np.where(one.counted, one.missing, np.nan) * unit.factor, POINTS)
        layout[f"yaxis{_number(k)}"] |= axis(unit.label(_what(one)))
        data.append(
            {
                "type": "scatter", "mode": "lines", "x": short(x), "y": short(y),
                "xaxis": "x", "yaxis": f"y{_number(k)}", "showlegend": False,
                "line": {"color": colours.MISSING, "width": 1.4},
                "hovertemplate": f"%{{y:.4g}} {unit.name}<extra></extra>",
            }
        )  # fmt: skip
    return {"data": data, "layout": layout}


def missing_cloud(
    torques: Sequence[MissingTorque],
    laws: Sequence[OverSpeed] = (),
    effect: str = "",
    scale: Sequence[MissingTorque] = (),
) -> Figure:
    """A row per joint over its own velocity, both directions in their colours; in it what the
    drive would spend on an effect with these laws. The axes are those of `scale`, so that what an
    effect has explained is seen to be gone."""
    scaled = {one.joint: one for one in scale}
    layout = _frame(torques, 0.17)
    data = []
    for k, one in enumerate(torques):
        keep = np.flatnonzero(one.counted & np.isfinite(one.missing) & np.isfinite(one.velocity))
        keep = keep[:: max(1, -(-keep.size // POINTS))]
        before = scaled.get(one.joint, one)
        unit = shown_unit(before.missing[before.counted], one.unit)
        speed = shown_unit(one.velocity[keep], one.velocity_unit)
        number = _number(k)
        layout[f"yaxis{number}"] |= axis(unit.label(_what(one))) | {"anchor": f"x{number}"}
        if scale:
            layout[f"yaxis{number}"]["range"] = _span(before, unit)
        layout[f"xaxis{number}"] = axis(speed.label(f"velocity of joint {one.joint}")) | {
            "anchor": f"y{number}"
        }
        for sign, symbol, (name, colour) in zip(
            (1.0, -1.0), ("circle", "x-thin-open"), DIRECTIONS, strict=True
        ):
            some = keep[sign * one.velocity[keep] >= 0.0]
            data.append(
                {
                    "type": "scatter", "mode": "markers", "name": name, "legendgroup": name,
                    "x": short(one.velocity[some] * speed.factor),
                    "y": short(one.missing[some] * unit.factor),
                    "xaxis": f"x{number}", "yaxis": f"y{number}", "showlegend": k == 0,
                    "marker": {"color": colours.faded(colour, 0.6), "size": 4, "symbol": symbol},
                    "hovertemplate": f"%{{x:.3g}} {speed.name}, %{{y:.4g}} {unit.name}"
                    "<extra></extra>",
                }
            )  # fmt: skip
        data += [_law(law, unit, speed, k, effect) for law in laws if law.joint == one.joint]
    return {"data": data, "layout": layout}


def _span(one: MissingTorque, unit: ShownUnit) -> list[float]:
    """The axis of a cloud, with a little room."""
    seen = one.missing[one.counted & np.isfinite(one.missing)] * unit.factor
    if not seen.size:
        return [-1.0, 1.0]
    low, high = float(seen.min()), float(seen.max())
    room = ROOM * (high - low) or 1.0
    return [low - room, high + room]


def _law(law: OverSpeed, unit: ShownUnit, speed: ShownUnit, k: int, effect: str) -> Figure:
    """Turned round: the drive spends what the effect takes."""
    number = _number(k)
    how: Figure = (
        {"mode": "lines", "line": {"color": colours.ADDED, "width": 2.6}}
        if law.line
        else {"mode": "markers", "marker": {"color": colours.ADDED, "size": 3}}
    )
    return how | {
        "type": "scatter", "name": effect, "legendgroup": effect, "showlegend": k == 0,
        "x": short(law.speed * speed.factor), "y": short(-law.torque * unit.factor),
        "xaxis": f"x{number}", "yaxis": f"y{number}",
        "hovertemplate": f"{effect}: %{{x:.3g}} {speed.name}, %{{y:.4g}} {unit.name}"
        "<extra></extra>",
    }  # fmt: skip


def _frame(torques: Sequence[MissingTorque], gap: float = 0.05) -> Figure:
    layout: Figure = frame(400, "") | {"hovermode": "closest"}
    layout["font"] = {**layout["font"], "size": 11}
    room = 1.0 / len(torques)
    for k in range(len(torques)):
        top = 1.0 - k * room
        layout[f"yaxis{_number(k)}"] = {"anchor": "x", "domain": [top - room + gap, top]}
    return layout


def _number(k: int) -> str:
    return "" if k == 0 else str(k + 1)


def _what(one: MissingTorque) -> str:
    return f"{'force' if one.unit == 'N' else 'torque'} {one.joint}"
