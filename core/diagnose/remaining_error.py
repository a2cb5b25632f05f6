"""Whether the remaining error is within the noise floor, and whether that says anything."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ..estimate.problem import FitData, Problem
from ..noise.noise_floor import UNCERTAINTY, Floor, spreads, squares_by_channel
from ..results import (
    ABOVE,
    ABOVE_IN_ONE,
    ChannelError,
    Doubt,
    DoubtReason,
    Remains,
)
from ..vibration_lines import unexplained_line

FARTHEST = UNCERTAINTY * ABOVE_IN_ONE
"""Floors: an error on unseen recordings that is larger is no noise, however well this is known."""


def remaining_error(
    data: FitData, errors: Sequence[np.ndarray], fitted: Problem | None = None
) -> Remains:
    """The remaining error of a fitted model, from weighted errors (M, k) per recording."""
    squares = squares_by_channel(data.experiments, errors)
    by_channel = {name: float(np.sqrt(np.mean(x))) for name, x in squares.items()}
    factors = {name: data.floor_uncertainty.get(name, 1.0) for name in squares}
    line = None
    if max(by_channel.values()) >= ABOVE:
        unexplained = unexplained_line(data.experiments, errors, fitted, ABOVE)
        line = None if unexplained is None else (unexplained.channel, unexplained.line.hz)
    idealised, tolerated = (
        {name: allowed.get(name, 0.0) for name in squares}
        for allowed in (data.law_errors, data.tolerances)
    )
    return Remains(
        _rms(squares), by_channel, line, factors,
        _rms({n: np.full(len(x), factors[n] ** 2) for n, x in squares.items()}), idealised,
        _rms({n: np.full(len(x), idealised[n]) for n, x in squares.items()}) ** 2,
        tolerated, _rms({n: np.full(len(x), tolerated[n]) for n, x in squares.items()}) ** 2,
    )  # fmt: skip


def doubts(
    data: FitData, by_channel: Sequence[ChannelError], floors: Mapping[str, Floor]
) -> Iterator[Doubt]:
    """Why the errors of a model, within the noise, do not show that nothing is missing. `floors`:
    of the noise as that model shows it.

    A noise floor is worth what it can refute: not one that the model's own error refutes, or one
    above all that a channel shows. And unseen recordings have the last word.
    """
    spread = spreads(data.experiments)
    for e in by_channel:
        refuted = floors[e.channel].refuted
        if refuted is not None:
            yield Doubt(DoubtReason.REFUTED_NOISE, e.channel, e.unit, refuted, e.rms)
        elif e.floor > ABOVE_IN_ONE * spread[e.channel]:
            reason = DoubtReason.FLOOR_ABOVE_SPREAD
            yield Doubt(reason, e.channel, e.unit, e.floor, spread[e.channel])
        # Idealised laws of the model's effects may miss a stated share.
        allowed = data.law_errors.get(e.channel, 0.0) + data.tolerances.get(e.channel, 0.0)
        if e.validation_rms > FARTHEST * e.floor * np.sqrt(1.0 + allowed):
            yield Doubt(DoubtReason.UNSEEN, e.channel, e.unit, e.floor, e.validation_rms)


def _rms(squares: Mapping[str, np.ndarray]) -> float:
    """rms over all channels."""
    return float(np.sqrt(np.mean(np.concatenate(list(squares.values())))))
