"""The joint torque that a model lacks, over time and velocity, and the residual over what may
explain it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from flexgui.core.results import ErrorOver, MissingTorque
from flexgui.sentences.written import ShownUnit, shown_unit
from flexgui.views import colours
from flexgui.views.layout import POINTS, Figure, axis, frame, short, styled, title, trace
from flexgui.views.names import channel_symbol
from flexgui.views.over_speed import OverSpeed

HEIGHT_PER_JOINT = 260


def missing_over_time(torques: Sequence[MissingTorque]) -> go.Figure:
    """A row per joint: applied and missing torque over time in s."""
    figure = make_subplots(rows=len(torques), cols=1, shared_xaxes=True, vertical_spacing=0.06)
    for row, torque in enumerate(torques, start=1):
        unit = shown_unit(torque.applied, torque.unit)
        for name, values, line in (
            ("applied", torque.applied, {"color": colours.START, "width": 1.0, "dash": "dot"}),
            ("missing", torque.missing, {"color": colours.MISSING, "width": 1.4}),
        ):
            x, y = trace(torque.time, np.where(torque.counted, values, np.nan) * unit.factor)
            figure.add_scatter(
                x=x,
                y=y,
                mode="lines",
                name=name,
                line=line,
                legendgroup=name,
                showlegend=row == 1,
                hovertemplate=f"%{{y:.4g}} {unit.name}",
                row=row,
                col=1,
            )
        title(figure, row, unit.label(_what(torque)))
    figure.update_xaxes(title_text="time [s]", row=len(torques), col=1)
    text = (
        "Missing: the torque that the drive applies minus the torque that the model needs for the "
        "same motion."
    )
    return styled(figure, _height(torques), text, hovermode="x unified")


def missing_over_velocity(torques: Sequence[MissingTorque]) -> go.Figure:
    """A row per joint: the missing torque as a cloud over the joint's velocity."""
    figure = make_subplots(rows=len(torques), cols=1, vertical_spacing=0.16)
    for row, torque in enumerate(torques, start=1):
        counted = torque.counted & np.isfinite(torque.missing) & np.isfinite(torque.velocity)
        index = _thinned(np.flatnonzero(counted))
        unit = shown_unit(torque.missing[counted], torque.unit)
        speed = shown_unit(torque.velocity[counted], torque.velocity_unit)
        figure.add_scatter(
            x=(torque.velocity[index] * speed.factor).astype(np.float32),
            y=(torque.missing[index] * unit.factor).astype(np.float32),
            mode="markers",
            showlegend=False,
            marker={"color": colours.faded(colours.MISSING, 0.5), "size": 4},
            hovertemplate=f"%{{x:.4g}} {speed.name}, %{{y:.4g}} {unit.name}<extra></extra>",
            row=row,
            col=1,
        )
        title(figure, row, unit.label(_what(torque)))
        title(figure, row, speed.label(f"velocity of joint {torque.joint}"), axis="x")
    text = (
        "The shape shows what is missing: a step at zero velocity is Coulomb friction, a slope "
        "is viscous friction, a cloud without shape is noise."
    )
    return styled(figure, _height(torques), text, hovermode="closest")


def _what(torque: MissingTorque) -> str:
    return f"{'force' if torque.unit == 'N' else 'torque'}, joint {torque.joint}"


def _thinned(index: np.ndarray) -> np.ndarray:
    """About POINTS of the samples, evenly spread: a cloud has no extremes to keep."""
    return index[:: max(1, -(-index.size // POINTS))]


def _height(torques: Sequence[MissingTorque]) -> int:
    return HEIGHT_OF_FRAME + HEIGHT_PER_JOINT * len(torques)


HEIGHT_PER_ROW, HEIGHT_OF_FRAME = 230, 100

DIRECTIONS = (("forwards", colours.RESIDUAL), ("backwards", colours.BACKWARDS))


def residual_over(found: Sequence[ErrorOver]) -> go.Figure | None:
    """A row each: the mean error of each direction with the spread around it; None without any."""
    if not found:
        return None
    count = len(found)
    figure = make_subplots(rows=count, cols=1, vertical_spacing=min(0.12, 0.5 / count))
    for row, one in enumerate(found, start=1):
        unit, across = shown_unit(one.rms, one.unit), shown_unit(one.edges, one.quantity_unit)
        for k in range(len(DIRECTIONS)):
            for line in _direction(one, k, unit, across, row == 1):
                figure.add_trace(line, row=row, col=1)
        title(figure, row, unit.label(f"Δ{channel_symbol(one.channel, one.unit)}"))
        title(figure, row, across.label(quantity_title(one)), axis="x")
    text = (
        "Mean error (measured minus model) in bins of the motion, forwards and backwards apart; "
        "the band is one standard deviation. A step between the directions points to dry friction, "
        "a slope over the speed to viscous friction, one over the acceleration to a wrong inertia, "
        "one over the deflection to a wrong stiffness."
    )
    return styled(figure, HEIGHT_OF_FRAME + HEIGHT_PER_ROW * count, text, hovermode="closest")


def quantity_title(one: ErrorOver) -> str:
    """'velocity of joint 1'"""
    part = "segment" if one.quantity == "deflection" else "joint"
    return f"{one.quantity} of {part} {one.joint}"


def _direction(
    one: ErrorOver, k: int, unit: ShownUnit, across: ShownUnit, legend: bool
) -> list[go.Scatter]:
    """Mean line and band of one direction of motion."""
    name, colour = DIRECTIONS[k]
    known = np.isfinite(one.mean[k])
    if not known.any():
        return []
    x = (0.5 * (one.edges[:-1] + one.edges[1:]) * across.factor)[known]
    mean = (one.mean[k] * unit.factor)[known]
    spread = np.sqrt(np.maximum(one.rms[k] ** 2 - one.mean[k] ** 2, 0.0))[known] * unit.factor
    band = go.Scatter(
        x=np.concatenate([x, x[::-1]]), y=np.concatenate([mean + spread, (mean - spread)[::-1]]),
        fill="toself", fillcolor=colours.faded(colour, 0.16), line={"width": 0},
        hoverinfo="skip", showlegend=False, legendgroup=name, mode="lines",
    )  # fmt: skip
    line = go.Scatter(
        x=x, y=mean, mode="lines+markers", name=name, legendgroup=name, showlegend=legend,
        line={"color": colour, "width": 1.8}, marker={"size": 5},
        hovertemplate=f"{name}: %{{y:.4g}} {unit.name} at %{{x:.4g}} {across.name}<extra></extra>",
    )  # fmt: skip
    return [band, line]


SMALL_POINTS = 600
MARGIN = 0.06
"""Of the span of a cloud, above and below it."""


def missing_curve(torques: Sequence[MissingTorque]) -> Figure:
    """A row per joint over a shared time axis in s."""
    layout = _frame(torques)
    layout["xaxis"] = axis("time [s]") | {"anchor": f"y{_number(len(torques) - 1)}"}
    data = []
    for k, one in enumerate(torques):
        unit = shown_unit(one.missing[one.counted], one.unit)
        x, y = trace(
            one.time, np.where(one.counted, one.missing, np.nan) * unit.factor, SMALL_POINTS
        )
        layout[f"yaxis{_number(k)}"] |= axis(unit.label(_small_what(one)))
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
        keep = keep[:: max(1, -(-keep.size // SMALL_POINTS))]
        before = scaled.get(one.joint, one)
        unit = shown_unit(before.missing[before.counted], one.unit)
        speed = shown_unit(one.velocity[keep], one.velocity_unit)
        number = _number(k)
        layout[f"yaxis{number}"] |= axis(unit.label(_small_what(one))) | {"anchor": f"x{number}"}
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
    margin = MARGIN * (high - low) or 1.0
    return [low - margin, high + margin]


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
    height = 1.0 / len(torques)
    for k in range(len(torques)):
        top = 1.0 - k * height
        layout[f"yaxis{_number(k)}"] = {"anchor": "x", "domain": [top - height + gap, top]}
    return layout


def _number(k: int) -> str:
    return "" if k == 0 else str(k + 1)


def _small_what(one: MissingTorque) -> str:
    return f"{'force' if one.unit == 'N' else 'torque'} {one.joint}"
