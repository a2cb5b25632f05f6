"""Estimates of a study: local and glocal ones of one run at one signal-to-noise ratio (Tables I and
II), their validation on sweeps of the second joint (Fig. 2), and what the search does by itself.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...arm.slots import STIFFNESS, slot
from ...identify.fit import Fitted, identify
from ...identify.fit_starts import evolve
from ...identify.unknowns import collect_unknowns
from ...montecarlo.rig import Rig, fit_percent, noisy, outputs
from ...montecarlo.settings import StudySettings, seeds, snr_code, snr_name
from ...montecarlo.study import Answer, Case, Part
from ...progress import Silent
from ...recording.recording import Recording
from ...scenario.schema import IdentifySpec

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
            start = time.perf_counter()
            fitted = evolve_fit(rig, label, group, population_seed(rig.settings, snr, run, number))
            took = time.perf_counter() - start
            fits.append({**estimate(rig, fitted), "seconds": took})
        return {"snr_db": snr, "run": run, "fits": fits}


def run_data(rig: Rig, snr_db: float | None, run: int) -> list[Recording]:
    """The experiments of one run: the same motion, fresh noise of `snr_db` in dB."""
    return [
        noisy(r, snr_db, seeds(rig.settings, NOISE, run, snr_code(snr_db), k))
        for k, r in enumerate(rig.experiments())
    ]


def population_seed(settings: StudySettings, snr_db: float | None, run: int, number: int) -> int:
    """Of the number-th fit of a run (locals from 0, then glocal) at `snr_db` in dB."""
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
    """The glocal estimate of a run at `snr_db` in dB, computed again wherever it is needed."""
    recordings = run_data(rig, snr_db, run)
    seed = population_seed(rig.settings, snr_db, run, len(recordings))
    return shared(evolve_fit(rig, GLOCAL, recordings, seed))


SHOWN = 200
"""Points of the path that are kept for its figure."""


class Sweeps(Part):
    """Each with the glocal estimate of another run on noisy data; the sweep itself is clean."""

    kind = "sweeps"
    title = "Validation sweeps"
    order = 2

    def cases(self, settings: StudySettings) -> tuple[Case, ...]:
        numbers = range(1, settings.sweeps + 1)
        return tuple(Case(self.kind, f"sweeps/{k:03d}", {"sweep": k}) for k in numbers)

    def run(self, rig: Rig, options: Mapping[str, Any]) -> Answer:
        number, settings = options["sweep"], rig.settings
        run = number  # runs are seeded one by one, so there is a run of every number
        snr = settings.noisy_snr
        values = glocal_values(rig, snr, run)
        recording = rig.recording(settings.sweep(number), f"sweep {number}")
        y = outputs(recording)
        models = {"lpv": rig.model, "rigid": rig.rigid, "nonlinear": rig.truth}
        fits = {}
        for name, model in models.items():
            own_values = {k: v for k, v in values.items() if k in model.parameters}
            fits[name] = fit_percent(y, rig.predict(model, [recording], own_values)[0])
        stride = max(len(y) // SHOWN, 1)
        return {
            "sweep": number,
            "run": run,
            "snr_db": snr,
            "EI": rig.stiffness(values),
            "fit": fits,
            "time": recording.time[::stride].tolist(),
            "theta2": recording["theta2"][::stride].tolist(),
        }


VALLEY = ("epsilon", "d")
"""Parameters that only their product EI shows."""

CASES, DRAWS = 10, 20
FIT_SEED = 6
"""First number of the seeds."""


class Prior(Part):
    """What prior and search alone make of epsilon and d: no arm, no data, only their product known.

    Evolution compares costs and nothing else, and the arm's cost rises with the distance of EI from
    the truth; so any cost that does so takes it through the same generations. Where a run ends
    along the valley epsilon d^4 = const is then decided by the first population and the search.
    """

    kind = "prior"
    title = "Prior and search alone"
    order = 5

    def cases(self, settings: StudySettings) -> tuple[Case, ...]:
        if set(settings.scenario.identify.parameters) != set(VALLEY):
            return ()
        numbers = range(1, CASES + 1)
        return tuple(Case(self.kind, f"prior/{k:02d}", {"number": k}) for k in numbers)

    def run(self, rig: Rig, options: Mapping[str, Any]) -> Answer:
        number = options["number"]
        ends = [_search(rig, DRAWS * (number - 1) + k) for k in range(DRAWS)]
        names = rig.settings.scenario.identify.parameters
        bounds = {name: list(rig.bounds[name]) for name in names}
        return {"ends": [dict(zip(names, end, strict=True)) for end in ends], "bounds": bounds}


def _search(rig: Rig, draw: int) -> list[float]:
    spec = rig.settings.scenario.identify
    names = list(spec.parameters)
    true = rig.stiffness({})[0]

    def costs(points: np.ndarray) -> np.ndarray:
        EI = rig.model.arm_vectors(names, points)[:, slot(0, STIFFNESS)]
        return np.log(EI / true) ** 2

    low, high = np.array([rig.bounds[n] for n in names]).T
    seed = int(seeds(rig.settings, FIT_SEED, draw).generate_state(1)[0])
    best = evolve(costs, low, high, spec.population, spec.generations, seed, lambda _: False)
    return [float(v) for v in best.vector]
