"""How the poles wander while one joint goes through its range."""

from __future__ import annotations

import numpy as np

from flexgui.views import colours
from flexgui.views.live import Figure
from flexgui.views.names import channel_symbol
from flexgui.views.poles import IMAGINARY, REAL, window
from flexgui.views.small import small_axis, small_figure

SCALE = [[0.0, "#3d7fd1"], [0.5, "#a06cd5"], [1.0, "#d64545"]]
"""From the least to the greatest angle."""


def pole_locus(
    places: np.ndarray, locus: np.ndarray, now: np.ndarray | None = None, joint: int = 1
) -> Figure:
    """Poles locus (k, nx) in 1/s over joint positions places (k,) in rad, upper half plane.

    `now` (nx,) are those of the present posture; joints count from 0.
    """
    left, top, _ = window(locus.ravel())
    shown = (locus.imag >= 0.0) & (locus.real >= left)
    degrees = np.degrees(np.broadcast_to(places[:, None], locus.shape))
    name = channel_symbol(f"theta{joint + 1}")
    traces = [_wander(locus[shown], degrees[shown], name)]
    if now is not None:
        traces.append(_present(now[(now.imag >= 0.0) & (now.real >= left)]))
    return small_figure(
        traces,
        small_axis(REAL, range=[left, -0.06 * left], zeroline=True, zerolinecolor=colours.AXIS),
        small_axis(IMAGINARY, range=[-0.04 * top, top]),
        f"Each dot is a pole at one {name}, coloured by the angle; cross: at the present one.",
        hovermode="closest",
        showlegend=False,
    )


def _wander(poles: np.ndarray, degrees: np.ndarray, name: str) -> dict[str, object]:
    return {
        "type": "scatter",
        "x": poles.real,
        "y": poles.imag,
        "mode": "markers",
        "marker": {
            "size": 5,
            "color": degrees,
            "colorscale": SCALE,
            "colorbar": {
                "title": {"text": f"{name} [°]", "side": "right"},
                "thickness": 10,
                "outlinewidth": 0,
                "x": 1.01,
            },
        },
        "customdata": degrees,
        "hovertemplate": f"{name} = %{{customdata:.0f}}°<br>s = %{{x:.4g}} + %{{y:.4g}} i"
        "<extra></extra>",
    }


def _present(poles: np.ndarray) -> dict[str, object]:
    return {
        "type": "scatter",
        "x": poles.real,
        "y": poles.imag,
        "mode": "markers",
        "marker": {"symbol": "x-thin", "size": 10, "line": {"width": 2.2, "color": colours.MODEL}},
        "hoverinfo": "skip",
    }
