"""Numbers over several recordings or fits: pooled errors and the mean of local estimates."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexgui.core.recording.channels import Role, role_of
from flexgui.core.results import ChannelComparison, Estimate, Fit, RecordingComparison

ESTIMATE, VALIDATE = "estimate", "validate"


@dataclass(frozen=True)
class ChannelError:
    """One output over all recordings of a role."""

    channel: str
    unit: str
    fitted: bool
    rms: float
    fit_percent: float
    """Mean over the recordings."""


def with_role(
    comparisons: Iterable[RecordingComparison], role: str
) -> tuple[RecordingComparison, ...]:
    """The comparisons of the recordings with a role."""
    return tuple(c for c in comparisons if c.role == role)


def channels(comparisons: Iterable[RecordingComparison]) -> dict[str, list[ChannelComparison]]:
    """Each output's comparisons by its name, in the order in which the outputs appear."""
    by_channel: dict[str, list[ChannelComparison]] = {}
    for comparison in comparisons:
        for channel in comparison.channels:
            by_channel.setdefault(channel.channel, []).append(channel)
    return by_channel


def channel_errors(comparisons: Iterable[RecordingComparison]) -> tuple[ChannelError, ...]:
    """The error of each output: rms over all samples that count, FIT as a mean."""
    return tuple(_pooled(name, parts) for name, parts in channels(comparisons).items())


def _pooled(name: str, parts: Sequence[ChannelComparison]) -> ChannelError:
    residuals = np.concatenate([part.residual[part.counted] for part in parts])
    return ChannelError(
        channel=name,
        unit=parts[0].unit,
        fitted=any(part.fitted for part in parts),
        rms=float(np.sqrt(np.mean(residuals**2))) if residuals.size else float("nan"),
        fit_percent=mean([part.fit_percent for part in parts]),
    )


def mean(values: Sequence[float]) -> float:
    """The mean of the finite values in their unit, NaN where there is none."""
    finite = [value for value in values if np.isfinite(value)]
    return float(np.mean(finite)) if finite else float("nan")


def tip_rms(comparisons: Iterable[RecordingComparison]) -> float | None:
    """Root mean square distance in m between measured and modelled tip, over all samples."""
    errors = [(c.tip_rms, _samples(c)) for c in comparisons if c.tip_rms is not None]
    if not errors:
        return None
    squares, weights = zip(*((rms**2, n) for rms, n in errors), strict=True)
    return float(np.sqrt(np.average(squares, weights=weights)))


def _samples(comparison: RecordingComparison) -> int:
    """Number of camera samples of a recording, at least 1 because it is a weight."""
    camera = [c for c in comparison.channels if role_of(c.channel) is Role.TIP]
    counts = [int(c.counted.sum()) for c in camera or comparison.channels]
    return max([1, *counts])


def overall_estimates(fits: Sequence[Fit]) -> tuple[Estimate, ...]:
    """The estimates of the one fit, or the mean over several; then derived ones.

    The deviation of the mean of n independent fits is sqrt(sum std^2) / n. Parameters that
    belong to one recording are not averaged.
    """
    everything = [e for fit in fits for e in (*fit.estimates, *fit.derived)]
    if len(fits) <= 1:
        return tuple(everything)
    shared: dict[str, list[Estimate]] = {}
    for estimate in everything:
        if estimate.recording is None:
            shared.setdefault(estimate.name, []).append(estimate)
    own = tuple(e for e in everything if e.recording is not None)
    return tuple(mean_estimate(group) for group in shared.values()) + own


def mean_estimate(group: Sequence[Estimate]) -> Estimate:
    """The mean of one parameter over independent fits."""
    return replace(
        group[0],
        value=float(np.mean([e.value for e in group])),
        std=float(np.sqrt(np.sum([e.std**2 for e in group])) / len(group)),
        identifiable=all(e.identifiable for e in group),
        at_bound=any(e.at_bound for e in group),
    )


def derived_names(fits: Iterable[Fit]) -> frozenset[str]:
    """Names of the quantities that are computed from estimates."""
    return frozenset(e.name for fit in fits for e in fit.derived)
