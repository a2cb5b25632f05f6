"""Residual analysis: is what a model leaves white, and does it no longer follow the inputs?

Autocorrelation of the residual and its correlation with each input, beside the bands in which they
lie where the model is complete (Ljung 1999, System Identification, 16.6); and the frequency
response that the measurements show, beside that of the model's outputs by the same estimate (Welch
1967; for several inputs Bendat and Piersol 2010, Random Data, 7.2).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from .results import ChannelComparison, RecordingComparison


@dataclass(frozen=True)
class ResidualCorrelation:
    """Correlation of one residual with itself or with an input."""

    recording: str
    channel: str
    input: str
    """Channel of the input; empty: with itself."""
    lag: np.ndarray
    """(L,) s, by which the input, or the earlier residual, comes before"""
    value: np.ndarray
    """(L,) between -1 and 1, no unit"""
    band: np.ndarray
    """(L,) around zero, in which it lies with the stated probability where the model is complete"""

    @property
    def outside(self) -> float:
        """Share of the lags that lie outside the band."""
        return float(np.mean(np.abs(self.value) > self.band))

    @property
    def worst(self) -> int:
        """Index of the lag that lies furthest outside the band, or least inside."""
        return int(np.argmax(np.abs(self.value) / self.band))


@dataclass(frozen=True)
class MeasuredResponse:
    """Frequency response from one input to one output, measured and modelled."""

    recording: str
    channel: str
    unit: str
    input: str
    input_unit: str
    frequency: np.ndarray
    """(F,) Hz"""
    measured: np.ndarray
    """(F,) complex, in `unit` per `input_unit`"""
    model: np.ndarray
    """(F,) complex: of the modelled output, estimated in the same way"""
    coherence: np.ndarray
    """(F,) share of the measured output's power that follows the inputs"""


@dataclass(frozen=True)
class ResidualAnalysis:
    """What the residuals of some recordings show."""

    level: float
    """Probability with which a correlation lies in its band where the model is complete."""
    correlations: tuple[ResidualCorrelation, ...]
    responses: tuple[MeasuredResponse, ...]


def residual_analysis(
    comparisons: Sequence[RecordingComparison],
    lags: int = 25,
    level: float = 0.99,
    segments: int = 4,
) -> ResidualAnalysis:
    """Analyse what is left of every fitted output.

    Args:
        comparisons: Measured against modelled, by recording.
        lags: Of each correlation, in samples of the output.
        level: Probability of the bands.
        segments: Of a recording, per input, that the spectra are means of: more are less noisy,
            fewer resolve more. They overlap by half.
    """
    width = NormalDist().inv_cdf(0.5 + level / 2.0)
    correlations: list[ResidualCorrelation] = []
    responses: list[MeasuredResponse] = []
    for recording in comparisons:
        for channel in (c for c in recording.channels if c.fitted):
            rows = _rows(channel, lags)
            if rows is not None:
                correlations += _correlations(recording, channel, rows, lags, width)
                responses += _responses(recording, channel, rows, segments)
    return ResidualAnalysis(level, tuple(correlations), tuple(responses))


def _rows(channel: ChannelComparison, lags: int) -> slice | None:
    """The samples at the output's own rate, as a camera may give only every tenth; None where they
    are too few for that many lags."""
    index = np.flatnonzero(channel.counted & np.isfinite(channel.residual))
    if index.size <= 2 * lags:
        return None
    return slice(index[0], index[-1] + 1, max(int(np.median(np.diff(index))), 1))


def _correlations(
    recording: RecordingComparison, channel: ChannelComparison, rows: slice, lags: int, width: float
) -> list[ResidualCorrelation]:
    there = channel.counted[rows] & np.isfinite(channel.residual[rows])
    e = np.where(there, channel.residual[rows], 0.0)
    own, pairs = _products(e, e), _products(there, there)
    step = float(np.median(np.diff(channel.time[rows])))
    at = slice(1, lags + 1)
    with np.errstate(invalid="ignore", divide="ignore"):
        value = np.nan_to_num(own[at] / pairs[at] / (own[0] / pairs[0]))
        band = width / np.sqrt(np.maximum(pairs[at], 1.0))
    lag = step * np.arange(lags + 1)
    found = [ResidualCorrelation(recording.recording, channel.channel, "", lag[at], value, band)]
    for signal in recording.inputs:
        u = signal.values[rows] - np.mean(signal.values[rows])
        power = _products(u, u)
        size = np.sqrt(own[0] * power[0] * pairs[0] / len(u))
        if size == 0.0:
            continue
        # Of two that are independent the product's variance is the sum of both correlations'.
        spread = own[0] * power[0] + 2.0 * float(own[1:] @ power[1:])
        edge = width * np.sqrt(max(spread, 0.0) / len(u)) / size
        value, band = _products(u, e)[: lags + 1] / size, np.full(lags + 1, edge)
        found.append(
            ResidualCorrelation(
                recording.recording, channel.channel, signal.channel, lag, value, band
            )
        )
    return found


def _products(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(N,) sums over t of a(t) b(t + k), for each k from 0."""
    length = 2 * len(a)
    return np.fft.irfft(np.conj(np.fft.rfft(a, length)) * np.fft.rfft(b, length), length)[: len(a)]


def _responses(
    recording: RecordingComparison, channel: ChannelComparison, rows: slice, segments: int
) -> list[MeasuredResponse]:
    """From every input; none where samples are missing or the inputs are not independent."""
    inputs = [s for s in recording.inputs if np.ptp(s.values[rows]) > 0.0]
    u = np.column_stack([s.values[rows] for s in inputs]) if inputs else np.zeros((0, 0))
    outputs = np.column_stack([channel.measured[rows], channel.model[rows]])
    k = len(inputs)
    length = len(outputs) // (segments * max(k, 1))
    if not inputs or length < segments or not np.isfinite(outputs).all():
        return []
    spectra = _spectra(np.hstack([u, outputs]), length)
    cross, own = spectra[:, k:, :k], spectra[:, :k, :k]
    if np.linalg.matrix_rank(own, hermitian=True).min() < k:
        return []
    gains = np.linalg.solve(own.transpose(0, 2, 1), cross.transpose(0, 2, 1)).transpose(0, 2, 1)
    explained = np.einsum("fi,fi->f", gains[:, 0], np.conj(cross[:, 0])).real
    coherence = explained / spectra[:, k, k].real
    step = float(np.median(np.diff(channel.time[rows])))
    frequency = np.fft.rfftfreq(length, step)[1:-1]
    return [
        MeasuredResponse(
            recording.recording, channel.channel, channel.unit, signal.channel, signal.unit,
            frequency, gains[:, 0, i], gains[:, 1, i], coherence,
        )
        for i, signal in enumerate(inputs)
    ]  # fmt: skip


def _spectra(x: np.ndarray, length: int) -> np.ndarray:
    """(F, k, k) mean products of x (N, k) over segments that overlap by half, without both ends of
    the band; Hann's window."""
    window = np.hanning(length + 1)[:-1, None]
    starts = range(0, len(x) - length + 1, length // 2)
    parts = np.stack([x[a : a + length] for a in starts])
    parts = (parts - parts.mean(axis=1, keepdims=True)) * window
    f = np.fft.rfft(parts, axis=1)[:, 1:-1]
    return np.einsum("sfi,sfj->fij", f, np.conj(f)) / len(parts)
