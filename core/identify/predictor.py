"""Predictions of a set of recordings from a parameter vector."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np

from core.identify.prepared import Prepared
from core.identify.unknowns import Unknowns
from core.model import Numbers
from core.simulate.linear import respond
from core.simulate.nonlinear import simulate, simulate_fixed
from core.trajectory import Trajectory

WORKERS = 2
"""Compiled simulation holds no lock, so recordings run on threads; machines have two cores."""


@dataclass
class Predictor:
    """Simulates prepared recordings at the level of their model."""

    experiments: Sequence[Prepared]
    unknowns: Unknowns
    fixed: Mapping[str, float] = field(default_factory=dict)
    substeps: dict[str, int] = field(default_factory=dict)
    errors: dict[str, float] = field(default_factory=dict)
    """Estimated simulation error per recording in m or rad, non-linear level only."""

    def values(self, experiment: Prepared, vector: np.ndarray) -> dict[str, float]:
        own = self.unknowns.values_for(experiment.recording.name, vector)
        return {**self.fixed, **own}

    def trajectories(
        self, vector: np.ndarray, which: Sequence[int] | None = None
    ) -> list[tuple[Trajectory, Numbers, dict[str, float]]]:
        """Motion, numbers and values of the chosen experiments (all where none are named)."""
        chosen = [self.experiments[i] for i in self._chosen(which)]
        values = [self.values(e, vector) for e in chosen]
        numbers = [e.model.numbers(v) for e, v in zip(chosen, values, strict=True)]
        motions = self._simulate(chosen, numbers, values)
        return list(zip(motions, numbers, values, strict=True))

    def predict(self, vector: np.ndarray, which: Sequence[int] | None = None) -> list[np.ndarray]:
        """(M_i, k) of the chosen experiments."""
        found = self.trajectories(vector, which)
        chosen = [self.experiments[i] for i in self._chosen(which)]
        return [e.predicted(*parts) for e, parts in zip(chosen, found, strict=True)]

    def _chosen(self, which: Sequence[int] | None) -> Sequence[int]:
        return range(len(self.experiments)) if which is None else which

    def _simulate(
        self,
        chosen: Sequence[Prepared],
        numbers: Sequence[Numbers],
        values: Sequence[Mapping[str, float]],
    ) -> list[Trajectory]:
        tasks = [e.task_at(v) for e, v in zip(chosen, values, strict=True)]
        if not chosen:
            return []
        if chosen[0].model.level == "lpv":
            return respond(chosen[0].model, numbers, tasks)

        def one(i: int) -> Trajectory:
            experiment, name = chosen[i], chosen[i].recording.name
            if name in self.substeps:
                steps = self.substeps[name]
                return simulate_fixed(experiment.model, numbers[i], tasks[i], steps)
            result = simulate(experiment.model, numbers[i], tasks[i])
            self.substeps[name], self.errors[name] = result.substeps, result.error
            return result.trajectory

        with ThreadPoolExecutor(WORKERS) as pool:
            return list(pool.map(one, range(len(chosen))))
