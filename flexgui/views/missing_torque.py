"""The torque that the model lacks, over time and over joint velocity."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from core.results import MissingTorque
from core.written import shown_unit
from flexgui.views import colours
from flexgui.views.decimate import POINTS, trace
from flexgui.views.layout import styled, title

HEIGHT_PER_JOINT, HEIGHT_OF_FRAME = 260, 100


def missing_over_time(torques: Sequence[MissingTorque]) -> go.Figure:
    """A row per joint: recorded and missing torque over time in s."""
    figure = make_subplots(rows=len(torques), cols=1, shared_xaxes=True, vertical_spacing=0.06)
    for row, torque in enumerate(torques, start=1):
        unit = shown_unit(torque.recorded, torque.unit)
        for name, values, line in (
            ("recorded", torque.recorded, {"color": colours.START, "width": 1.0, "dash": "dot"}),
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
    text = "Missing: recorded torque minus the torque that the model needs for the same motion."
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
