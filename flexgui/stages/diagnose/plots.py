"""What an effect does: in its own output with and without it, and in a small picture of its law."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from markupsafe import Markup

from flexgui.core.results import MissingTorque
from flexgui.sentences.written import ShownUnit, channel_symbol, format_number, shown_unit
from flexgui.views import colours
from flexgui.views.layout import Figure, Pane, axis, headline, line, number, panes, trace
from flexgui.views.missing_torque import OverSpeed, missing_cloud
from flexgui.views.names import output_title, typeset
from flexgui.views.sketch import PANEL_POINTS, Curve, sketch
from flexgui.views.sketch import POINTS as SKETCHED

if TYPE_CHECKING:
    from flexgui.stages.diagnose.model_versions import Demonstration

PALE = colours.faded(colours.MEASURED, 0.45)
"""Measured lies below the line that is to meet it."""


def demonstration(shown: Demonstration) -> Figure:
    """Two rows: the output; its residual without the effect and the change by the effect."""
    change, measured_change = shown.with_it - shown.without, shown.measured - shown.without
    symbol = channel_symbol(shown.channel, shown.unit)
    signal = shown_unit(shown.without, shown.unit)
    small = shown_unit(np.concatenate([change, measured_change]), shown.unit)

    def drawn(name: str, values: np.ndarray, colour: str, unit: ShownUnit, width: float) -> Figure:
        x, y = trace(shown.time, values * unit.factor, PANEL_POINTS)
        hover = f"{name} %{{y:.4g}} {unit.name}<extra></extra>"
        return line(x, y, name, colour, hover, width=width)

    outputs = [
        drawn("measured", shown.measured, PALE, signal, 4.0),
        drawn("without it", shown.without, colours.START, signal, 1.4),
        drawn("with it", shown.with_it, colours.ADDED, signal, 1.6),
    ]
    changes = [
        drawn("residual", measured_change, colours.RESIDUAL, small, 1.0),
        drawn("what it changes", change, colours.ADDED, small, 1.8),
    ]
    parts = [
        Pane(outputs, axis(signal.label(symbol))),
        Pane(changes, axis(small.label(f"Δ{symbol}"))),
    ]
    return panes(parts, axis("time [s]"), gap=0.06, hovermode="x unified")


def demonstration_summary(shown: Demonstration) -> Markup:
    """'With f_c1 = 1.2 N m: joint angle θ₁ in recording th3, where it changes most.'"""
    texts: list[Markup] = []
    for p in shown.sizes:
        unit = shown_unit(p.value, p.unit)
        number = f"{format_number(p.value * unit.factor, 3)} {unit.name}".strip()
        texts.append(Markup("{} = {}").format(typeset(p.symbol, p.name), number))
    size = Markup("With {}").format(Markup(", ").join(texts)) if texts else "With it"
    output = output_title(shown.channel, shown.unit)
    return Markup("{}: {} in {}, the recording with the largest change.").format(
        size, output, shown.recording
    )


SIZE = (120, 28)
"""px"""

NOISY = 3.0
"""Floors that the picture spans at least on either side, or noise would look large."""


@dataclass(frozen=True)
class Glimpse:
    """A stretch of one output of one recording."""

    recording: str
    channel: str
    seconds: float
    actual: np.ndarray
    """(rows,) in floors; NaN: no sample."""
    predicted: np.ndarray
    """(rows,) in floors; NaN: no sample."""

    @property
    def caption(self) -> str:
        """'θ₂ in recording th3, 0.17 s'"""
        at = format_number(self.seconds, 2)
        return f"{channel_symbol(self.channel)} in recording {self.recording}, {at} s"


def glimpse(
    recordings: Sequence[str],
    channels: Sequence[Sequence[str]],
    dt: Sequence[float],
    residual: Sequence[np.ndarray],
    predicted: Sequence[np.ndarray],
) -> Glimpse | None:
    """The stretch where the effect predicts most; None where it predicts nothing anywhere."""
    best, place = 0.0, (0, 0, 0)
    for r, block in enumerate(predicted):
        rows = min(SKETCHED, len(block))
        square = np.nan_to_num(block.astype(float)) ** 2
        energy = np.cumsum(np.vstack([np.zeros(block.shape[1]), square]), axis=0)
        window = energy[rows:] - energy[: len(energy) - rows]
        at, k = divmod(int(np.argmax(window)), window.shape[1])
        if window[at, k] > best:
            best, place = float(window[at, k]), (r, at, k)
    if best <= 0.0 or not len(residual):
        return None
    r, at, k = place
    part = slice(at, at + SKETCHED)
    return Glimpse(
        recordings[r], channels[r][k], dt[r] * min(SKETCHED, len(residual[r])),
        residual[r][part, k], predicted[r][part, k],
    )  # fmt: skip


def picture(seen: Glimpse) -> Markup:
    """As SVG."""
    both = (seen.actual, seen.predicted)
    top = max(NOISY, *(float(np.nanmax(np.abs(values), initial=0.0)) for values in both))
    x = np.arange(len(seen.actual), dtype=float)
    curves = [
        Curve(x, 0.0 * x, colours.GRID, 1.0),
        Curve(x, seen.actual, colours.RESIDUAL, 2.2),
        Curve(x, seen.predicted, colours.ADDED),
    ]
    return sketch(curves, (-top, top), SIZE, "predicted over actual residual", "glimpse")


MORPH = {"morph": True}
RESIDUAL_MARGIN = 0.08
"""Of the span of a residual, above and below it."""
BESIDE, TICKS = 2, 5
"""Joints side by side, and ticks of their axes: more do not fit a panel of 320 px."""
ROW_HEIGHT = 84.0
"""px of an output's row: so many ticks need it; with fewer an axis may be left with its zero."""
LEAST_SPAN = 2.0
"""Times the noise floor that an axis shows at least, on either side."""


def torque_cloud(
    torques: Sequence[MissingTorque], laws: Sequence[OverSpeed], effect: str,
    first: Sequence[MissingTorque],
) -> Figure:  # fmt: skip
    """Missing torque over speed with the law of `effect`, on the first version's axes."""
    beside = len(torques) <= BESIDE
    figure = missing_cloud(torques, laws, effect, first, beside)
    layout = figure["layout"]
    layout["meta"] = MORPH
    for k in range(len(torques) if beside else 0):
        layout[f"xaxis{number(k)}"]["nticks"] = TICKS
    return figure


def residual_figure(
    channel: str, dt: float, residual: np.ndarray, predicted: np.ndarray | None, effect: str,
    first: np.ndarray, unit: str = "",
) -> Figure:  # fmt: skip
    """Residual (N,) in noise floors, every `dt` s, and `predicted` (N,), on the axes of the first
    version's residual `first` (N,)."""
    shown = None if predicted is None else predicted[:, None]
    figure = live_prediction((channel,), dt, residual[:, None], shown, effect, "")
    layout = figure["layout"]
    layout.pop("title")
    layout["meta"] = MORPH
    most = _span(first)
    text = f"Δ{channel_symbol(channel, unit)} [× noise floor]"
    layout["yaxis"] |= {"range": [-most, most], "title": axis(text)["title"]}
    return figure


def _span(residual: np.ndarray) -> float:
    """Half the range of an axis for residuals (N,): of these alone, since a linear prediction may
    leave any range."""
    return max(float(np.nanmax(np.abs(residual), initial=0.0)), LEAST_SPAN) * (
        1.0 + RESIDUAL_MARGIN
    )


def worst_channel(residual: np.ndarray) -> int:
    """The column of a residual (N, channels) in noise floors that fails most."""
    count = np.isfinite(residual).sum(axis=0)
    return int(np.argmax(np.nansum(np.square(residual), axis=0) / np.maximum(count, 1)))


def cloud_caption(torques: Sequence[MissingTorque], first: Sequence[MissingTorque]) -> str:
    """'joint 1: 0.9 N m rms, joint 2: 0.3 N m rms', after a step with what it was before."""
    before = {t.joint: rms(t) for t in first}
    return ", ".join(
        f"joint {t.joint}: {_changed(before.get(t.joint, rms(t)), rms(t))} {t.unit}"
        for t in torques
    )


def residual_caption(channel: str, unit: str, residual: np.ndarray, first: np.ndarray) -> str:
    """'tip position z₁, in this recording alone: rms 18 × its noise floor', of a residual (N,) in
    noise floors, after a step with what it was before, of `first` (N,)."""
    current, was = (float(np.sqrt(np.nanmean(np.square(each)))) for each in (residual, first))
    size = f"rms {_changed(was, current)} × its noise floor"
    return f"{output_title(channel, unit)}, in this recording alone: {size}"


def _changed(was: float, now: float) -> str:
    """'2 → 0.1', or '2' where it is the same."""
    before, after = format_number(was, 2), format_number(now, 2)
    return f"{before} → {after}" if abs(now - was) > 0.01 * was else after


def rms(torque: MissingTorque) -> float:
    """Of the samples that count, in the unit of the torque."""
    seen = torque.missing[torque.counted & np.isfinite(torque.missing)]
    return float(np.sqrt(np.mean(np.square(seen)))) if seen.size else 0.0


def live_prediction(
    channels: Sequence[str],
    dt: float,
    residual: np.ndarray,
    predicted: np.ndarray | None,
    effect: str,
    title: str,
) -> Figure:
    """A row per output, of `residual` and `predicted` (N, channels) in floors, every `dt` s, NaN
    where it has no sample; the band is one floor wide each way."""
    time, parts, bands = dt * np.arange(len(residual)), [], []
    for k, name in enumerate(channels):
        hover = "%{y:.3g} × noise floor<extra></extra>"
        lines = [
            line(
                *trace(time, residual[:, k]), "residual", colours.RESIDUAL, f"residual {hover}",
                width=1.0,
            )
        ]  # fmt: skip
        if predicted is not None:
            shown = f"{effect} {hover}"
            drawn = trace(time, predicted[:, k])
            lines.append(line(*drawn, effect, colours.ADDED, shown, dash="dash"))
        most = _span(residual[:, k])
        label = f"Δ{channel_symbol(name)}"
        parts.append(Pane(lines, axis(label, nticks=TICKS, range=[-most, most])))
        bands.append(
            {
                "type": "rect", "xref": "paper", "yref": f"y{number(k)}", "x0": 0, "x1": 1,
                "y0": -1, "y1": 1, "fillcolor": colours.faded(colours.FLOOR, 0.22),
                "line": {"width": 0}, "layer": "below",
            }
        )  # fmt: skip
    return panes(
        parts, axis("time [s]"), gap=0.03, hovermode="x unified", title=headline(title),
        shapes=bands,
    )  # fmt: skip
