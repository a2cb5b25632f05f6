"""Measured and modelled outputs of one recording with their residuals, large and small."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from flexgui.core.results import ChannelComparison, RecordingComparison
from flexgui.sentences.written import channel_symbol, shown_unit
from flexgui.views import colours
from flexgui.views.layout import MOST_POINTS, Figure, Pane, axis, band, headline, line, panes, trace
from flexgui.views.names import output_title

HEIGHT_PER_CHANNEL, HEIGHT_OF_FRAME = 330, 100
SIGNAL_SHARE, RESIDUAL_SHARE = 0.64, 0.36
PANE_GAP = 0.05
"""Below each pane, as a share of an output's height."""
TICKS = (5, 5)
"""Numbers on the axes of a signal and of its error, at most: more overlap in a low row."""

GIVEN = colours.faded(colours.START, 0.45)


def comparison(
    recording: RecordingComparison,
    channels: Sequence[ChannelComparison] | None = None,
    before: RecordingComparison | None = None,
    points: int = MOST_POINTS,
    floors: Mapping[str, float] | None = None,
    beside: tuple[str, RecordingComparison] | None = None,
) -> Figure:
    """Two rows per output (signal and residual) over a shared time axis in s; `before`: what the
    model as given left, pale beside the residual; `points`: of each line at the most; `floors`: of
    the noise, a band around the zero of the residual; `beside`: title and comparison of another
    model."""
    shown = recording.channels if channels is None else tuple(channels)
    bands = floors or {}
    title, other = ("", None) if beside is None else beside
    parts = [
        part
        for c in shown
        for part in _parts(
            c, _of(before, c), points, bands.get(c.channel, 0.0), title, _of(other, c)
        )
    ]
    text = "Residual: measured minus model, in the samples that are compared."
    if any(channel.time.size > points for channel in shown):
        text += (
            f" Long traces show about {points} points: minimum and maximum of each interval. The "
            f"tables hold every sample."
        )
    height = HEIGHT_OF_FRAME + HEIGHT_PER_CHANNEL * len(shown)
    gap = PANE_GAP / max(len(shown), 1)
    return panes(parts, axis("time [s]"), text, height, gap, hovermode="x unified")


def _of(
    recording: RecordingComparison | None, channel: ChannelComparison
) -> ChannelComparison | None:
    """The same channel by another model, where it has the same samples."""
    channels = () if recording is None else recording.channels
    found = next((c for c in channels if c.channel == channel.channel), None)
    same = found is not None and found.time.shape == channel.time.shape
    return found if same else None


def _parts(
    channel: ChannelComparison,
    before: ChannelComparison | None,
    points: int,
    floor: float,
    title: str,
    other: ChannelComparison | None,
) -> Iterator[Pane]:
    """The signal, and the residual; `other`: the same by a model of that title."""
    symbol = channel_symbol(channel.channel, channel.unit)
    signal = shown_unit(np.concatenate([channel.measured, channel.model]), channel.unit)
    counted = np.where(channel.counted, channel.residual, np.nan)
    small = shown_unit(counted, channel.unit)

    def drawn(name: str, values: np.ndarray, colour: str, unit=signal, **look) -> Figure:  # type: ignore[no-untyped-def]
        x, y = trace(channel.time, values * unit.factor, points)
        return line(x, y, name, colour, f"{symbol} %{{y:.4g}} {unit.name}", **look)

    measured = drawn("measured", channel.measured, colours.MEASURED)
    model = drawn("model", channel.model, colours.MODEL, width=1.4, dash="dash")
    residual = [drawn("residual", counted, colours.RESIDUAL, small, width=1.0)]
    signals = [measured, model]
    if other is not None:
        left = np.where(other.counted, other.residual, np.nan)
        signals.append(drawn(title, other.model, colours.BESIDE, width=1.4, dash="dot"))
        residual.append(drawn(title, left, colours.BESIDE, small, width=1.0, dash="dot"))
    if before is not None:
        was = np.where(before.counted, before.residual, np.nan)
        residual.insert(0, drawn("residual as given", was, GIVEN, small, width=1.0))
    if floor > 0.0:
        ends, size = channel.time[[0, -1]], np.full(2, floor * small.factor)
        residual.insert(0, band((ends, size), (ends, -size), "± noise floor", colours.FLOOR))
    first, second = signal.label(symbol), small.label(f"Δ{symbol}")
    yield Pane(signals, axis(first, nticks=TICKS[0]), share=SIGNAL_SHARE)
    yield Pane(residual, axis(second, nticks=TICKS[1]), share=RESIDUAL_SHARE)


SMALL_POINTS = 500


def live_worst(recordings: Sequence[RecordingComparison]) -> Figure | None:
    """Measured and modelled: the fitted output with the largest error; None if none is counted."""
    fitted = [c for r in recordings[:1] for c in r.channels if c.fitted]
    compared = [c for c in fitted if np.isfinite(c.normalised_error)]
    if not compared:
        return None
    worst = max(compared, key=lambda c: c.normalised_error)
    title = f"{recordings[0].recording}: {output_title(worst.channel, worst.unit)}"
    drawn = live_comparison(recordings[0], [worst.channel])
    return {**drawn, "layout": drawn["layout"] | {"title": headline(title)}}


def live_comparison(
    recording: RecordingComparison,
    names: Sequence[str],
    floors: Mapping[str, float] | None = None,
    beside: tuple[str, RecordingComparison] | None = None,
) -> Figure:
    """The same with fewer points, for a panel; `beside`: title and comparison of another model."""
    shown = [c for c in recording.channels if c.channel in names]
    return comparison(recording, shown, points=SMALL_POINTS, floors=floors, beside=beside)
