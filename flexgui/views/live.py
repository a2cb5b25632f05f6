"""Small figures as plain dictionaries: cheap enough to be drawn at every move of a slider."""

from __future__ import annotations

from typing import Any

import numpy as np

from flexgui.views.layout import axis, frame

Figure = dict[str, Any]


def figure(traces: list[Figure], x: Figure, y: Figure, title: str = "", **layout: Any) -> Figure:
    """A figure in the house's look with one pair of axes."""
    base = frame(260, "") | {"xaxis": x, "yaxis": y, "font": {**frame(0, "")["font"], "size": 11}}
    if title:
        base["title"] = {
            "text": title, "x": 0.01, "xanchor": "left", "y": 0.985, "yanchor": "top",
            "font": {"size": 12},
        }  # fmt: skip
    return {"data": traces, "layout": base | layout}


def ax(text: str, **more: Any) -> Figure:
    """One axis."""
    return axis(text) | {"title": {"text": text, "standoff": 4}} | more


def line(x: np.ndarray, y: np.ndarray, name: str, colour: str, **more: Any) -> Figure:
    """A line through points."""
    width, dash = more.pop("width", 1.6), more.pop("dash", "solid")
    return {
        "type": "scatter", "mode": "lines", "x": short(x), "y": short(y), "name": name,
        "line": {"color": colour, "width": width, "dash": dash},
    } | more  # fmt: skip


def dots(x: np.ndarray, y: np.ndarray, name: str, colour: str, **marker: Any) -> Figure:
    """Points."""
    return {
        "type": "scatter", "mode": "markers", "x": short(x), "y": short(y), "name": name,
        "marker": {"color": colour, "size": 7} | marker,
    }  # fmt: skip


def short(values: np.ndarray) -> np.ndarray:
    """As exact as a pixel can show; what is not finite is a gap."""
    found = np.asarray(values, dtype=np.float32)
    return np.where(np.isfinite(found), found, np.float32(np.nan))
