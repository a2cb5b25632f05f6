"""Which experiments give the smallest deviation, from their Fisher information.

For white noise of standard deviation s_c on channel c, and least squares that weigh both alike,
cov = I⁺ (Σ_c s_c² I_c) I⁺ with I_c = S_c'S_c and I = Σ_c I_c; the experiments of a plan add up.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..least_squares import pseudo_inverse
from ..montecarlo.estimates import EstimateTable
from ..montecarlo.settings import StudySettings
from ..resumable.journal import Record

RANK = 1e-9
"""Relative eigenvalue of the information below which nothing is known of a direction."""

LENGTHS = (0.5, 1.0, 2.0, 3.0, 6.0, 12.0)
"""Times the length of the study's own experiments."""


@dataclass(frozen=True)
class Experiment:
    """One experiment and what it determines."""

    name: str
    theta2: float
    seconds: float
    information: np.ndarray
    """(channels, P, P) of relative changes, per (rad/s)²."""
    pull: np.ndarray
    """(P,): S' of the linear model's own error."""
    signal_std: np.ndarray
    """(channels,) rad/s"""


@dataclass(frozen=True)
class Expected:
    """What a plan of experiments gives for one target."""

    target: str
    std: float
    """Relative deviation."""
    bias: float
    """Relative bias by the linear model's own error."""

    @property
    def error(self) -> float:
        """Root mean square."""
        return float(np.hypot(self.std, self.bias))


@dataclass(frozen=True)
class PredictedDeviation:
    """Relative deviation of one target in one row of the tables."""

    label: str
    target: str
    predicted: float
    found: float

    @property
    def ratio(self) -> float:
        """Found deviation over predicted one."""
        return self.found / self.predicted


@dataclass(frozen=True)
class Candidate:
    """An experiment that could be made, with what it would give alone."""

    experiment: Experiment
    expected: tuple[Expected, ...]

    @property
    def error(self) -> float:
        """Root mean square over the targets."""
        return float(np.sqrt(np.mean([e.error**2 for e in self.expected])))


@dataclass(frozen=True)
class Planning:
    """Advice on the next experiments."""

    targets: tuple[str, ...]
    noise: np.ndarray
    """(channels,) rad/s, taken for all candidates: that of the study's noisy data, on average."""
    snr_db: float
    candidates: tuple[Candidate, ...]
    """Best first."""
    own: tuple[Expected, ...]
    """What the study's own experiments give together."""
    chosen: tuple[Candidate, ...]
    """As many as the study has, chosen one after the other."""
    best: tuple[Expected, ...]
    """What these give together."""
    lengths: tuple[tuple[float, float], ...]
    """(s per experiment, relative deviation of the first target) with the study's experiments."""
    predicted: tuple[PredictedDeviation, ...]


def planning(
    settings: StudySettings, records: Mapping[str, Record], tables: Sequence[EstimateTable]
) -> Planning | None:
    """None where the study's own experiments are not analysed yet, or no data have noise."""
    answers = {k: r["answer"] for k, r in sorted(records.items()) if r["part"] == "advice"}
    own = answers.get("advice/own")
    snr = settings.noisy_snr
    if own is None or snr is None:
        return None
    goals = _Goals(tuple(own["targets"]), np.array(own["gradients"]))
    experiments = [_experiment(e) for e in own["experiments"]]
    noise = np.mean([e.signal_std for e in experiments], axis=0) * 10.0 ** (-snr / 20.0)
    others = [
        _experiment(e) for k, a in answers.items() if k != "advice/own" for e in a["experiments"]
    ]
    candidates = [Candidate(e, goals.expected([e], noise)) for e in others]
    chosen = goals.choose([c.experiment for c in candidates], noise, len(experiments))
    together = goals.expected(experiments, noise)
    return Planning(
        goals.names, noise, snr, tuple(sorted(candidates, key=lambda c: c.error)), together,
        tuple(candidates[i] for i in chosen),
        goals.expected([candidates[i].experiment for i in chosen], noise) if chosen else (),
        tuple((experiments[0].seconds * f, together[0].std / float(np.sqrt(f))) for f in LENGTHS),
        _predicted(goals, experiments, tables),
    )  # fmt: skip


def _experiment(entry: Mapping[str, Any]) -> Experiment:
    return Experiment(
        entry["name"], float(entry["theta2"]), float(entry["seconds"]),
        np.array(entry["information"]), np.array(entry["pull"]), np.array(entry["signal_std"]),
    )  # fmt: skip


@dataclass(frozen=True)
class _Goals:
    """What is to be known: names, and their relative change per change of the parameters."""

    names: tuple[str, ...]
    gradients: np.ndarray

    def expected(
        self, plan: Sequence[Experiment], noise: np.ndarray | Sequence[np.ndarray]
    ) -> tuple[Expected, ...]:
        """`noise` (channels,) for all, or one per experiment."""
        levels = np.broadcast_to(np.asarray(noise), (len(plan), len(plan[0].signal_std)))
        inverse = pseudo_inverse(sum(e.information.sum(axis=0) for e in plan), RANK)
        meat = sum(
            np.tensordot(s**2, e.information, axes=1) for s, e in zip(levels, plan, strict=True)
        )
        covariance = inverse @ meat @ inverse
        shift = inverse @ sum(e.pull for e in plan)
        return tuple(
            Expected(name, float(np.sqrt(max(g @ covariance @ g, 0.0))), float(g @ shift))
            for name, g in zip(self.names, self.gradients, strict=True)
        )

    def choose(self, offered: Sequence[Experiment], noise: np.ndarray, count: int) -> list[int]:
        """Indices, one after the other, each the best beside those before; each at most once."""
        chosen: list[int] = []
        for _ in range(min(count, len(offered))):
            left = [i for i in range(len(offered)) if i not in chosen]
            chosen.append(min(left, key=lambda i: self._error(offered, [*chosen, i], noise)))
        return chosen

    def _error(self, offered: Sequence[Experiment], plan: list[int], noise: np.ndarray) -> float:
        deviations = self.expected([offered[i] for i in plan], noise)
        return float(np.mean([e.error**2 for e in deviations]))


def _predicted(
    goals: _Goals, own: Sequence[Experiment], tables: Sequence[EstimateTable]
) -> tuple[PredictedDeviation, ...]:
    """Predicted against found at each noisy ratio, with every experiment's own noise."""
    comparisons: list[PredictedDeviation] = []
    for table in tables:
        if table.snr_db is not None:
            ratio = 10.0 ** (-table.snr_db / 20.0)
            comparisons += _at_ratio(goals, own, [e.signal_std * ratio for e in own], table)
    return tuple(comparisons)


def _at_ratio(
    goals: _Goals, own: Sequence[Experiment], noise: Sequence[np.ndarray], table: EstimateTable
) -> list[PredictedDeviation]:
    """Each stiffness: every experiment alone, the mean of these, all together."""
    comparisons = []
    stiff = [k for k, name in enumerate(goals.names) if name.startswith("EI")]
    alone = [goals.expected([e], [s]) for e, s in zip(own, noise, strict=True)]
    together = goals.expected(own, noise)
    for segment, k in enumerate(stiff if len(stiff) == len(table.rows[0].EI) else []):
        deviations = [expected_alone[k].std for expected_alone in alone]
        mean = float(np.sqrt(np.sum(np.square(deviations))) / len(deviations))
        for row, expected in zip(table.rows, [*deviations, mean, together[k].std], strict=True):
            actual = row.EI[segment].std / row.EI[segment].mean
            label = f"{row.label}, {table.snr_db:g} dB"
            comparisons.append(PredictedDeviation(label, goals.names[k], expected, actual))
    return comparisons
