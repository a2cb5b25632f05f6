"""Whether the remaining error is within the noise floor."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..results import ABOVE, ABOVE_IN_ONE, Remains

if TYPE_CHECKING:
    from ..diagnose.fit_problem import Data, Hypothesis
    from ..identify.prepared_recording import Prepared


def within_noise(data: Data, errors: Sequence[np.ndarray]) -> bool:
    """Whether errors (M, k) per recording, in noise floors, are within noise: over all channels and
    in each. The idealised laws of the model's effects may miss a stated share.

    With a virtual servo, encoder noise excites the links. A sharper limit than the verdict's would
    find effects that imitate it: damped links follow noise less.
    """
    from ..least_squares import cost_of

    share = ABOVE**2 if data.rig.servo else 1.0
    each = _by_channel(data.experiments, errors)
    missed = sum(data.law_errors.get(n, 0.0) * len(x) for n, x in each.items())
    if not cost_of(errors) <= share * data.count + missed:
        return False
    return all(np.mean(x) <= ABOVE_IN_ONE**2 + data.law_errors.get(n, 0.0) for n, x in each.items())


def _by_channel(
    experiments: Sequence[Prepared], errors: Sequence[np.ndarray]
) -> dict[str, np.ndarray]:
    """channel -> its squared errors in noise floors, at the samples that count."""
    squares: dict[str, list[np.ndarray]] = {}
    for e, r in zip(experiments, errors, strict=True):
        for k, (name, _) in enumerate(e.channels):
            if e.counted[:, k].any():
                squares.setdefault(name, []).append(r[e.counted[:, k], k] ** 2)
    return {name: np.concatenate(parts) for name, parts in squares.items()}


def channel_rms(experiments: Sequence[Prepared], errors: Sequence[np.ndarray]) -> dict[str, float]:
    """channel -> rms of errors (M, k) per recording, at the samples that count."""
    squares = _by_channel(experiments, errors)
    return {name: float(np.sqrt(np.mean(x))) for name, x in squares.items()}


def remaining_error(
    data: Data, errors: Sequence[np.ndarray], fitted: Hypothesis | None = None
) -> Remains:
    """The remaining error of a fitted model, from weighted errors (M, k) per recording."""
    from ..diagnose.vibration_lines import unexplained_line

    squares = _by_channel(data.experiments, errors)
    by_channel = {name: float(np.sqrt(np.mean(x))) for name, x in squares.items()}
    factors = {name: data.floor_uncertainty.get(name, 1.0) for name in squares}
    line = None
    if max(by_channel.values()) >= ABOVE:
        unexplained = unexplained_line(data.experiments, errors, fitted, ABOVE)
        line = None if unexplained is None else (unexplained.channel, unexplained.line.hz)
    idealised = {name: data.law_errors.get(name, 0.0) for name in squares}
    return Remains(
        _rms(squares), by_channel, line, factors,
        _rms({n: np.full(len(x), factors[n] ** 2) for n, x in squares.items()}), idealised,
        _rms({n: np.full(len(x), idealised[n]) for n, x in squares.items()}) ** 2,
    )  # fmt: skip


def _rms(squares: Mapping[str, np.ndarray]) -> float:
    """rms over all channels."""
    return float(np.sqrt(np.mean(np.concatenate(list(squares.values())))))
