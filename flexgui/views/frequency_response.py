"""Frequency response: how strongly and how late each frequency of a reference comes out."""

from __future__ import annotations

import numpy as np

from core.simulate.response import FrequencyResponse
from core.written import ShownUnit
from flexgui.views.live import Figure
from flexgui.views.names import channel_symbol
from flexgui.views.pairs import NEGLIGIBLE, pair_lines, per_reference
from flexgui.views.small import small_axis, small_figure

DECADES = 4.0
"""Shown below the largest gain; less than that nobody hears."""


def frequency_response(response: FrequencyResponse) -> Figure:
    """Magnitude over frequency in Hz, both logarithmic."""
    gain = np.abs(response.gain)
    symbol = ", ".join(channel_symbol(port.name, port.unit) for port in response.outputs)
    unit = ShownUnit(1.0, response.outputs[0].unit or "–")
    top = float(np.log10(gain.max(initial=1e-12) * 2.0))
    least = float(np.log10(max(gain[gain > 0.0].min(initial=1e12), 1e-12)))
    traces = pair_lines(response.frequency, gain, response.outputs, response.references, "%{y:.3g}")
    return small_figure(
        traces,
        _frequencies(response),
        small_axis(
            f"|{symbol}| [{per_reference(unit, response.references)}]",
            type="log",
            range=[max(top - DECADES, least), top],
            dtick=1,
            exponentformat="power",
        ),
        "Magnitude of the response from each reference to each output.",
        hovermode="x unified",
    )


def phase_response(response: FrequencyResponse) -> Figure:
    """Phase in degrees over frequency in Hz, without jumps of 360°; a coupling that is none (see
    `pair_lines`) has no phase."""
    gain = response.gain
    coupled = np.abs(gain).max(axis=0) > NEGLIGIBLE * np.abs(gain).max(initial=0.0)
    phase = np.where(coupled, np.rad2deg(np.unwrap(np.angle(gain), axis=0)), 0.0)
    traces = pair_lines(
        response.frequency, phase, response.outputs, response.references, "%{y:.0f}°"
    )
    symbol = ", ".join(channel_symbol(port.name, port.unit) for port in response.outputs)
    return small_figure(
        traces,
        _frequencies(response),
        small_axis(f"arg {symbol} [deg]", dtick=90),
        "Phase of the response from each reference to each output.",
        hovermode="x unified",
    )


def _frequencies(response: FrequencyResponse) -> Figure:
    ends = [float(np.log10(f)) for f in (response.frequency[0], response.frequency[-1])]
    return small_axis("frequency [Hz]", type="log", range=ends, dtick=1)
