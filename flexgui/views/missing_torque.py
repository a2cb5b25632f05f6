"""Missing joint torque over time and speed, and the residual over the motion."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from flexgui.core.results import ErrorOver, MissingTorque
from flexgui.sentences.written import ShownUnit, channel_symbol, shown_unit
from flexgui.views import colours
from flexgui.views.layout import MOST_POINTS, Figure, Pane, axis, band, dots, line, panes, trace
from flexgui.views.over_speed import OverSpeed

HEIGHT_OF_FRAME, HEIGHT_PER_JOINT, HEIGHT_PER_ROW = 100, 260, 230
DIRECTIONS = (("forwards", colours.RESIDUAL), ("backwards", colours.BACKWARDS))
SMALL_POINTS = 600
CLOUD_MARGIN = 0.06
"""Of the span of a cloud, above and below it."""


def missing_over_time(torques: Sequence[MissingTorque], points: int = MOST_POINTS) -> Figure:
    """A row per joint: applied and missing torque over time in s."""
    text = "Missing torque: applied by the drive minus needed by the model for the same motion."
    return panes(
        [_over_time(torque, points, with_applied=True) for torque in torques], axis("time [s]"),
        text, _height(torques), 0.06, hovermode="x unified",
    )  # fmt: skip


def missing_curve(torques: Sequence[MissingTorque]) -> Figure:
    """The missing torque alone, for a panel."""
    return panes([_over_time(torque, SMALL_POINTS) for torque in torques], axis("time [s]"))


def _over_time(torque: MissingTorque, points: int, with_applied: bool = False) -> Pane:
    shown = torque.applied if with_applied else torque.missing[torque.counted]
    unit = shown_unit(shown, torque.unit)
    hover = f"%{{y:.4g}} {unit.name}"

    def drawn(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return trace(torque.time, np.where(torque.counted, values, np.nan) * unit.factor, points)

    lines = [line(*drawn(torque.missing), "missing", colours.MISSING, hover, width=1.4)]
    if with_applied:
        style = {"width": 1.0, "dash": "dot"}
        lines.insert(0, line(*drawn(torque.applied), "applied", colours.REFERENCE, hover, **style))
    else:
        lines[0] |= {"showlegend": False}
    return Pane(lines, axis(unit.label(_what(torque))))


def missing_over_velocity(torques: Sequence[MissingTorque], points: int = MOST_POINTS) -> Figure:
    """A row per joint: the missing torque as a cloud over the joint's velocity."""
    parts = []
    for torque in torques:
        unit = shown_unit(torque.missing[_known(torque)], torque.unit)
        speed = shown_unit(torque.velocity[_known(torque)], torque.velocity_unit)
        index = _thinned(torque, points)
        cloud = dots(
            torque.velocity[index] * speed.factor, torque.missing[index] * unit.factor, "",
            colours.faded(colours.MISSING, 0.5), _hover(unit, speed), size=4,
        )  # fmt: skip
        parts.append(Pane([cloud], axis(unit.label(_what(torque))), _speed_axis(torque, speed)))
    text = (
        "A step at zero velocity is Coulomb friction. A slope is viscous friction. A cloud "
        "without shape is noise."
    )
    return panes(parts, None, text, _height(torques), 0.16, hovermode="closest")


def missing_cloud(
    torques: Sequence[MissingTorque],
    laws: Sequence[OverSpeed] = (),
    effect: str = "",
    scale: Sequence[MissingTorque] = (),
    beside: bool = False,
) -> Figure:
    """A pane per joint over its own velocity, both directions in their colours; in it what the
    drive would spend on an effect with these laws. The axes are those of `scale`, so that what an
    effect has explained is seen to be gone."""
    scaled = {torque.joint: torque for torque in scale}
    parts = []
    for torque in torques:
        keep = _thinned(torque, SMALL_POINTS)
        before = scaled.get(torque.joint, torque)
        unit = shown_unit(before.missing[before.counted], torque.unit)
        speed = shown_unit(torque.velocity[keep], torque.velocity_unit)
        traces = []
        for sign, symbol, (name, colour) in zip(
            (1.0, -1.0), ("circle", "x-thin-open"), DIRECTIONS, strict=True
        ):
            chosen = keep[sign * torque.velocity[keep] >= 0.0]
            x, y = torque.velocity[chosen] * speed.factor, torque.missing[chosen] * unit.factor
            style = {"size": 4, "symbol": symbol}
            colour = colours.faded(colour, 0.6)
            traces.append(dots(x, y, name, colour, _hover(unit, speed), **style))
        traces += [_law(law, unit, speed, effect) for law in laws if law.joint == torque.joint]
        limits = {"range": _span(before, unit)} if scale else {}
        y_axis = axis(unit.label(_what(torque)), **limits)
        parts.append(Pane(traces, y_axis, _speed_axis(torque, speed)))
    columns = len(parts) if beside else 1
    return panes(parts, None, gap=0.17, columns=columns, hovermode="closest")


def _law(law: OverSpeed, unit: ShownUnit, speed: ShownUnit, effect: str) -> Figure:
    """With the opposite sign: the drive supplies the torque that the effect takes."""
    x, y = law.speed * speed.factor, -law.torque * unit.factor
    hover = f"{effect}: {_hover(unit, speed)}"
    if law.line:
        return line(x, y, effect, colours.ADDED, hover, width=2.6)
    return dots(x, y, effect, colours.ADDED, hover, size=3)


def _hover(unit: ShownUnit, speed: ShownUnit) -> str:
    return f"%{{x:.4g}} {speed.name}, %{{y:.4g}} {unit.name}<extra></extra>"


def _span(torque: MissingTorque, unit: ShownUnit) -> list[float]:
    """The range of a cloud's axis, with a margin."""
    values = torque.missing[torque.counted & np.isfinite(torque.missing)] * unit.factor
    if not values.size:
        return [-1.0, 1.0]
    low, high = float(values.min()), float(values.max())
    margin = CLOUD_MARGIN * (high - low) or 1.0
    return [low - margin, high + margin]


def _known(torque: MissingTorque) -> np.ndarray:
    return torque.counted & np.isfinite(torque.missing) & np.isfinite(torque.velocity)


def _thinned(torque: MissingTorque, points: int) -> np.ndarray:
    """Indices of about `points` samples, evenly spread."""
    index = np.flatnonzero(_known(torque))
    return index[:: max(1, -(-index.size // points))]


def _what(torque: MissingTorque) -> str:
    return f"{'force' if torque.unit == 'N' else 'torque'} {torque.joint}"


def _speed_axis(torque: MissingTorque, speed: ShownUnit) -> Figure:
    return axis(speed.label(f"velocity of joint {torque.joint}"))


def _height(torques: Sequence[MissingTorque]) -> int:
    return HEIGHT_OF_FRAME + HEIGHT_PER_JOINT * len(torques)


def residual_over(errors: Sequence[ErrorOver]) -> Figure | None:
    """A row each: mean error per direction and its spread; None without any."""
    if not errors:
        return None
    parts = []
    for error in errors:
        unit = shown_unit(error.rms, error.unit)
        across = shown_unit(error.edges, error.quantity_unit)
        traces = [t for k in range(len(DIRECTIONS)) for t in _direction(error, k, unit, across)]
        y = axis(unit.label(f"Δ{channel_symbol(error.channel, error.unit)}"))
        part = "segment" if error.quantity == "deflection" else "joint"
        x = axis(across.label(f"{error.quantity} of {part} {error.joint}"))
        parts.append(Pane(traces, y, x))
    text = (
        "Mean error (measured minus model) in bins of the motion, per direction; band: one "
        "standard deviation. Step between the directions: dry friction. Slope over speed: "
        "viscous friction. Slope over acceleration: wrong inertia. Slope over deflection: wrong "
        "stiffness."
    )
    gap = min(0.12, 0.5 / len(parts))
    height = HEIGHT_OF_FRAME + HEIGHT_PER_ROW * len(parts)
    return panes(parts, None, text, height, gap, hovermode="closest")


def _direction(error: ErrorOver, k: int, unit: ShownUnit, across: ShownUnit) -> Iterator[Figure]:
    """Band and mean line of one direction of motion."""
    name, colour = DIRECTIONS[k]
    finite = np.isfinite(error.mean[k])
    if not finite.any():
        return
    x = (0.5 * (error.edges[:-1] + error.edges[1:]) * across.factor)[finite]
    mean = (error.mean[k] * unit.factor)[finite]
    spread = np.sqrt(np.maximum(error.rms[k] ** 2 - error.mean[k] ** 2, 0.0))[finite] * unit.factor
    yield band((x, mean + spread), (x, mean - spread), "", colour, 0.16, legendgroup=name)
    hover = f"{name}: %{{y:.4g}} {unit.name} at %{{x:.4g}} {across.name}<extra></extra>"
    points = {"mode": "lines+markers", "marker": {"size": 5}}
    yield line(x, mean, name, colour, hover, width=1.8, **points)
