"""Tables I and II: means and deviations over the runs, what they should have been, and what the
prior says along the valley ε d⁴ = const, with and without the search.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..montecarlo.paper_values import (
    WORKING_POINTS,
    Numbers,
    caption_deviation,
    deviation_of_mean,
    printed,
    stiffness,
)
from ..montecarlo.settings import StudySettings
from ..resumable.journal import Record

LOCAL_MEAN, GLOCAL = "local mean", "glocal"


@dataclass(frozen=True)
class Spread:
    """Mean and standard deviation (n - 1) over the runs; NaN where one run is all there is."""

    mean: float
    std: float


@dataclass(frozen=True)
class EstimateRow:
    """One fit of the study over its runs."""

    label: str
    theta2: float | None
    """rad; None where several working points are fitted at once or averaged."""
    values: Mapping[str, Spread]
    """By parameter, SI."""
    EI: tuple[Spread, ...]
    """N m², over the runs' own products."""
    EI_of_means: float
    """N m² of the mean parameters, as a printed table lets a reader compute it (first segment)."""
    pairs: tuple[Mapping[str, float], ...]
    """What each run found."""


@dataclass(frozen=True)
class MeanDeviation:
    """The deviation of the mean of the local estimates, in three ways."""

    name: str
    of_mean: float
    """sqrt(sum std²) / n"""
    caption: float
    """sqrt(sum std² / n)"""
    found: float
    """Over the runs' own means."""


@dataclass(frozen=True)
class EstimateTable:
    """All fits at one signal-to-noise ratio."""

    snr_db: float | None
    runs: int
    rows: tuple[EstimateRow, ...]
    """Locals, local mean, glocal."""
    deviations: tuple[MeanDeviation, ...]

    @property
    def locals(self) -> tuple[EstimateRow, ...]:
        """The rows of the local fits."""
        return tuple(r for r in self.rows if r.label not in (LOCAL_MEAN, GLOCAL))

    def row(self, label: str) -> EstimateRow:
        """The row of that label."""
        return next(r for r in self.rows if r.label == label)


def estimate_tables(
    settings: StudySettings, records: Mapping[str, Record]
) -> tuple[EstimateTable, ...]:
    """One per ratio that has a finished run, in the order of the settings."""
    answers = [r["answer"] for r in records.values() if r["part"] == "fits"]
    tables = []
    for snr in settings.snr_db:
        runs = sorted((a for a in answers if a["snr_db"] == snr), key=lambda a: a["run"])
        if runs:
            tables.append(_table(settings, snr, runs))
    return tuple(tables)


def _table(
    settings: StudySettings, snr: float | None, runs: Sequence[Mapping[str, Any]]
) -> EstimateTable:
    count = len(settings.points)
    fits = [[run["fits"][k] for run in runs] for k in range(count + 1)]
    rows = [
        _row(f"local {k + 1}", settings.points[k], fits[k], settings) for k in range(count)
    ]  # fmt: skip
    means = [_mean_fit([run["fits"][k] for k in range(count)]) for run in runs]
    rows.append(_row(LOCAL_MEAN, None, means, settings))
    rows.append(_row(GLOCAL, None, fits[count], settings))
    return EstimateTable(snr, len(runs), tuple(rows), _deviations(rows[:count], rows[count]))


def _mean_fit(fits: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """The mean of the local estimates of one run; EI is averaged too, not recomputed."""
    names = fits[0]["values"]
    values = {n: float(np.mean([f["values"][n] for f in fits])) for n in names}
    return {"values": values, "EI": np.mean([f["EI"] for f in fits], axis=0).tolist()}


def _row(
    label: str,
    theta2: float | None,
    fits: Sequence[Mapping[str, Any]],
    settings: StudySettings,
) -> EstimateRow:
    names = settings.scenario.identify.parameters
    values = {n: spread([f["values"][n] for f in fits]) for n in names}
    EI = [spread([f["EI"][k] for f in fits]) for k in range(len(fits[0]["EI"]))]
    pairs = tuple(dict(f["values"]) for f in fits)
    return EstimateRow(label, theta2, values, tuple(EI), _product(values), pairs)


def _product(values: Mapping[str, Spread]) -> float:
    """EI of a square section with the mean ε and d; NaN where they are not the parameters."""
    if not {"epsilon", "d"} <= values.keys():
        return float("nan")
    return values["epsilon"].mean * values["d"].mean ** 4 / 12.0


def _deviations(rows: Sequence[EstimateRow], mean: EstimateRow) -> tuple[MeanDeviation, ...]:
    deviations = []
    for name in mean.values:
        stds = [row.values[name].std for row in rows]
        deviations.append(
            MeanDeviation(
                name, deviation_of_mean(stds), caption_deviation(stds), mean.values[name].std
            )
        )
    stds = [row.EI[0].std for row in rows]
    both = deviation_of_mean(stds), caption_deviation(stds)
    return (*deviations, MeanDeviation("EI", *both, mean.EI[0].std))


def spread(values: Sequence[float]) -> Spread:
    """Over some runs."""
    array = np.asarray(values, dtype=float)
    std = float(array.std(ddof=1)) if len(array) > 1 else float("nan")
    return Spread(float(array.mean()), std)


SAME_POINT = 1e-3
"""rad: working points that are the paper's to the digits that a scenario gives."""

GIGA, MILLI = 1e-9, 1e3


@dataclass(frozen=True)
class Agreement:
    """One mean of ours beside the paper's."""

    snr_db: float | None
    label: str
    name: str
    ours: float
    paper: float
    deviation: float
    """The paper's; ours and the paper's in GPa or mm."""

    @property
    def within(self) -> bool:
        """Whether the two agree within one deviation."""
        return abs(self.ours - self.paper) <= self.deviation


def comparable(table: EstimateTable) -> tuple[Numbers, ...] | None:
    """The paper's table where ours has its experiments and parameters."""
    published = printed(table.snr_db)
    points = [row.theta2 or 0.0 for row in table.locals]
    if published is None or len(points) != len(WORKING_POINTS):
        return None
    same_size = np.allclose(points, WORKING_POINTS, rtol=0.0, atol=SAME_POINT)
    same_parameters = {"epsilon", "d"} == set(table.rows[0].values)
    return published if same_size and same_parameters else None


def agreements(tables: Sequence[EstimateTable]) -> tuple[Agreement, ...]:
    """Every mean of ε and d that the paper prints."""
    agreements = []
    for table in tables:
        for row, numbers in zip(table.rows, comparable(table) or (), strict=False):
            for name, factor, at in (("epsilon", GIGA, 0), ("d", MILLI, 2)):
                ours = row.values[name].mean * factor
                agreements.append(
                    Agreement(table.snr_db, row.label, name, ours, numbers[at], numbers[at + 1])
                )
    return tuple(agreements)


def implied_bias(numbers: Numbers, EI: float) -> float:
    """Relative, of the EI that printed means imply, against `EI` in N m²."""
    return stiffness(numbers[0], numbers[2]) / EI - 1.0


def least_scatter(numbers: Numbers) -> float:
    """Relative: EI = ε d⁴ / 12 scatters at least by |4 std(d)/d - std(ε)/ε|, which is zero where
    all runs lie on one valley."""
    epsilon, epsilon_std, d, d_std = numbers
    return abs(4.0 * d_std / d - epsilon_std / epsilon)


VALLEY_STEPS = 20001
"""Of the integral over the valley; its error is far below a digit that is shown."""

WITHIN = 0.25
"""Share by which a deviation found over 20 runs may differ from the one expected: two and a half
standard errors of a deviation over 20 draws of a flat distribution."""


@dataclass(frozen=True)
class ValleyPrior:
    """Expected deviations of ε and d along the valley."""

    bounds: Mapping[str, tuple[float, float]]
    EI: float
    """N m², of the valley."""
    flat: Mapping[str, Spread]
    """The uniform prior, given EI: where a search would end that does not move along it."""
    searched: Mapping[str, Spread]
    """The same prior after the search (differential evolution draws together along a bent
    valley)."""
    draws: int


@dataclass(frozen=True)
class Explained:
    """One deviation found at SNR ∞ against the one expected."""

    label: str
    name: str
    found: float
    expected: float

    @property
    def ratio(self) -> float:
        """Ratio of the found spread to the expected one."""
        return self.found / self.expected

    @property
    def good(self) -> bool:
        """Whether the valley explains the spread."""
        return abs(self.ratio - 1.0) <= WITHIN


def valley_prior(records: Mapping[str, Record], EI: float) -> ValleyPrior | None:
    """The valley of `EI` in N m²; None where the part `prior` has no result yet."""
    answers = [r["answer"] for key, r in sorted(records.items()) if r["part"] == "prior"]
    if not answers:
        return None
    bounds = {n: (float(b[0]), float(b[1])) for n, b in answers[0]["bounds"].items()}
    ends = [end for a in answers for end in a["ends"]]
    searched = {n: spread([end[n] for end in ends]) for n in bounds}
    return ValleyPrior(bounds, EI, flat_prior(bounds, EI), searched, len(ends))


def flat_prior(bounds: Mapping[str, tuple[float, float]], EI: float) -> dict[str, Spread]:
    """Mean and deviation of ε and d, uniform in a box, given ε d⁴ / 12 = EI in N m².

    With (ε, EI) instead of (ε, d) the density is |dd/dEI| = d / (4 EI), so ∝ d along the valley.
    """
    epsilon = np.linspace(*bounds["epsilon"], VALLEY_STEPS)
    d = (12.0 * EI / epsilon) ** 0.25
    low, high = bounds["d"]
    weight = np.where((d >= low) & (d <= high), d, 0.0)
    spreads = {}
    for name, values in (("epsilon", epsilon), ("d", d)):
        mean = float(np.average(values, weights=weight))
        std = float(np.sqrt(np.average((values - mean) ** 2, weights=weight)))
        spreads[name] = Spread(mean, std)
    return spreads


def explained(table: EstimateTable, prior: ValleyPrior) -> tuple[Explained, ...]:
    """Every fit's deviations of ε and d; the mean of n locals is expected to scatter less."""
    rows = []
    shrink = {"local mean": len(table.locals) ** -0.5}
    for row in table.rows:
        for name in prior.bounds:
            expected = prior.searched[name].std * shrink.get(row.label, 1.0)
            rows.append(Explained(row.label, name, row.values[name].std, expected))
    return tuple(rows)


def pooled(table: EstimateTable, prior: ValleyPrior) -> tuple[Explained, ...]:
    """All single fits together: the root mean square of their deviations."""
    single = [*table.locals, table.row("glocal")]
    rows = []
    for name in prior.bounds:
        rms = float(np.sqrt(np.mean([row.values[name].std ** 2 for row in single])))
        rows.append(Explained("all fits", name, rms, prior.searched[name].std))
    return tuple(rows)
