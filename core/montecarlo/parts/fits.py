"""Local and glocal estimates of one run at one signal-to-noise ratio (Tables I and II)."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import Any

from core.identify.fit import Fitted, identify
from core.identify.unknowns import collect_unknowns
from core.montecarlo.rig import Rig, noisy
from core.montecarlo.settings import StudySettings, seeds, snr_code, snr_name
from core.montecarlo.study import Answer, Case, Part
from core.progress import Silent
from core.recording.recording import Recording
from core.scenario.schema import IdentifySpec

NOISE, POPULATION = 1, 2
"""First number of the seeds of either."""

GLOCAL = "glocal"


class Fits(Part):
    """Every working point by itself, then all at once, on the same data."""

    kind = "fits"
    title = "Estimates"
    order = 1

    def cases(self, settings: StudySettings) -> tuple[Case, ...]:
        return tuple(
            Case(self.kind, f"fits/{snr_name(snr)}/{run:04d}", {"snr_db": snr, "run": run})
            for run in range(1, settings.runs + 1)
            for snr in settings.snr_db
        )

    def run(self, rig: Rig, options: Mapping[str, Any]) -> Answer:
        snr, run = options["snr_db"], options["run"]
        recordings = run_data(rig, snr, run)
        groups = [(f"local {k}", [r]) for k, r in enumerate(recordings, start=1)]
        groups.append((GLOCAL, recordings))
        fits = []
        for number, (label, group) in enumerate(groups):
            begun = time.perf_counter()
            fitted = evolve_fit(rig, label, group, population_seed(rig.settings, snr, run, number))
            took = time.perf_counter() - begun
            fits.append({**estimate(rig, fitted), "seconds": took})
        return {"snr_db": snr, "run": run, "fits": fits}


def run_data(rig: Rig, snr_db: float | None, run: int) -> list[Recording]:
    """The experiments of one run: the same motion, fresh noise."""
    return [
        noisy(r, snr_db, seeds(rig.settings, NOISE, run, snr_code(snr_db), k))
        for k, r in enumerate(rig.experiments())
    ]


def population_seed(settings: StudySettings, snr_db: float | None, run: int, number: int) -> int:
    """Of the number-th fit of a run (locals from 0, then glocal)."""
    stream = seeds(settings, POPULATION, run, snr_code(snr_db), number)
    return int(stream.generate_state(1)[0])


def evolve_fit(rig: Rig, label: str, recordings: Sequence[Recording], seed: int) -> Fitted:
    """By differential evolution over the LPV model."""
    return fit(rig, label, recordings, rig.settings.identify(rig.bounds, seed))


def fit(rig: Rig, label: str, recordings: Sequence[Recording], spec: IdentifySpec) -> Fitted:
    """The LPV model fitted as `spec` says."""
    unknowns = collect_unknowns(rig.model, spec, recordings)
    experiments = [rig.prepared(r) for r in recordings]
    return identify(label, experiments, unknowns, spec, {}, Silent())


def shared(fitted: Fitted) -> dict[str, float]:
    """name -> value of the estimates."""
    return {e.name: e.value for e in fitted.fit.estimates}


def estimate(rig: Rig, fitted: Fitted) -> Answer:
    """The values found and the stiffnesses that follow."""
    values = shared(fitted)
    stiffness = rig.stiffness(values)
    label = fitted.fit.label
    return {"label": label, "values": values, "EI": stiffness, "cost": fitted.fit.cost}


def glocal_values(rig: Rig, snr_db: float | None, run: int) -> dict[str, float]:
    """The glocal estimate of a run, computed anew wherever it is needed."""
    recordings = run_data(rig, snr_db, run)
    seed = population_seed(rig.settings, snr_db, run, len(recordings))
    return shared(evolve_fit(rig, GLOCAL, recordings, seed))
