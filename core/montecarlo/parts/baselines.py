"""Four ways from the same data to a model of the arm at every posture, compared."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...identify.fit import identify
from ...identify.unknowns import collect_unknowns
from ...model import Model
from ...montecarlo.interpolated import Interpolated, identify_interpolated
from ...montecarlo.parts.fits import evolve_fit, shared
from ...montecarlo.rig import Rig, fit_percent, noisy, outputs
from ...montecarlo.settings import StudySettings, seeds, snr_code, snr_name
from ...montecarlo.study import Answer, Case, Part
from ...progress import Silent
from ...recording.recording import Recording
from ...simulate.posture import integrators, posture

SLOWEST, FASTEST = 1e-6, 1000.0
"""rad/s: poles compared. Those above are a third of the sampling's Nyquist rate and more; no
method sees them in samples of 1 kHz."""


class Contender(ABC):
    """An identified model, whatever it is made of."""

    parameters: int

    @abstractmethod
    def predict(self, recording: Recording) -> np.ndarray:
        """ydot (N, 2) at the recording's working point, or along its theta2 where it moves."""

    @abstractmethod
    def poles(self, theta2: float) -> np.ndarray:
        """(n,) complex, 1/s, of the linear model from references to ydot at `theta2` in rad."""

    @abstractmethod
    def result(self) -> Answer:
        """What was found: stiffnesses, or the size of a black box."""


@dataclass
class Physical(Contender):
    """The arm's own equations with estimated parameters."""

    rig: Rig
    model: Model
    values: Mapping[str, float]

    @property
    def parameters(self) -> int:  # type: ignore[override]
        """Number of estimated parameters."""
        return len(self.values)

    def predict(self, recording: Recording) -> np.ndarray:
        return self.rig.predict(self.model, [recording], dict(self.values))[0]

    def poles(self, theta2: float) -> np.ndarray:
        joints = np.array([0.0, theta2])
        poles = posture(self.model, joints, self.model.numbers(self.values)).poles
        return np.asarray(poles[~integrators(poles)])

    def result(self) -> Answer:
        return {"EI": self.rig.stiffness(dict(self.values))}


@dataclass
class BlackBox(Contender):
    """Local models of the black-box kind, interpolated."""

    model: Interpolated
    sample_time: float

    @property
    def parameters(self) -> int:  # type: ignore[override]
        """Number of estimated parameters."""
        return self.model.numbers

    def predict(self, recording: Recording) -> np.ndarray:
        u = references(recording)
        if recording.theta2 is not None:
            return self.model.at(recording.theta2).respond(u)
        return self.model.respond(u, recording["theta2"])

    def poles(self, theta2: float) -> np.ndarray:
        values = np.linalg.eigvals(self.model.at(theta2).A).astype(complex)
        return np.asarray(np.log(np.where(values == 0.0, 1e-300, values)) / self.sample_time)

    def result(self) -> Answer:
        return {"order": self.model.order, "degree": self.model.degree}


def references(recording: Recording) -> np.ndarray:
    """(N, 2) rad/s"""
    return np.column_stack([recording["dtheta1_ref"], recording["dtheta2_ref"]])


def pole_error(estimated: np.ndarray, true: np.ndarray) -> float:
    """Mean relative distance of each relevant pole in `true` (n,) to its pole in `estimated` (m,).
    Each estimated pole is used once; a true pole without one counts as 1."""
    from scipy.optimize import linear_sum_assignment

    relevant = true[(np.abs(true) > SLOWEST) & (np.abs(true) < FASTEST)]
    apart = np.abs(estimated[:, None] - relevant[None]) / np.abs(relevant)[None]
    apart = np.minimum(np.where(np.isfinite(apart), apart, 1.0), 1.0)
    rows, columns = linear_sum_assignment(apart)
    return float((apart[rows, columns].sum() + len(relevant) - len(columns)) / len(relevant))


NOISE_SEED, POPULATION_SEED, START_SEED = 3, 4, 5
"""First number of the seeds of each."""

ESTIMATION_SEED, VALIDATION_SEED = 1001, 2001
"""Of the excitation at the k-th point: seed + k."""

SWEEPS = 2
UNSEEN = 6
"""Points between the identified ones that are looked at, at most."""

GRID = 25
"""Postures over which poles are compared."""


class Baselines(Part):
    """All methods on the same data, for each noise and each number of working points."""

    kind = "baselines"
    title = "Baselines"
    order = 6

    def cases(self, settings: StudySettings) -> tuple[Case, ...]:
        return tuple(
            Case(
                self.kind,
                f"baselines/{count:02d}/{snr_name(snr)}",
                {"snr_db": snr, "points": count},
            )
            for count in settings.baseline_points
            for snr in settings.baseline_snr_db
        )

    def run(self, rig: Rig, options: Mapping[str, Any]) -> Answer:
        snr, count = options["snr_db"], options["points"]
        points = spread(rig.settings, count)
        data = _estimation(rig, points, snr)
        tests = _tests(rig, points)
        results = []
        for name, method in METHODS.items():
            start = time.perf_counter()
            contender = method(rig, data, (count, snr_code(snr)))
            seconds = time.perf_counter() - start
            results.append({"method": name, "seconds": seconds, **_judged(rig, contender, tests)})
        return {"snr_db": snr, "points": count, "methods": results}


def spread(settings: StudySettings, count: int) -> list[float]:
    """`count` working points over the range of the study's own, rad."""
    low, high = min(settings.points), max(settings.points)
    return [float(p) for p in np.linspace(low, high, count)]


def _at(rig: Rig, theta2: float, seed: int) -> Recording:
    """The study's kind of experiment at another working point."""
    like = rig.settings.experiments[0].simulate
    assert like is not None
    spec = like.model_copy(update={"theta2": theta2, "seed": seed})
    return rig.recording(spec, f"theta2 = {theta2:.4f}")


def _estimation(rig: Rig, points: Sequence[float], snr_db: float | None) -> list[Recording]:
    return [
        noisy(
            _at(rig, p, ESTIMATION_SEED + k),
            snr_db,
            seeds(rig.settings, NOISE_SEED, len(points), snr_code(snr_db), k),
        )
        for k, p in enumerate(points)
    ]


def _tests(rig: Rig, points: Sequence[float]) -> dict[str, list[Recording]]:
    """Noise-free recordings that no method has seen."""
    between = [0.5 * (a + b) for a, b in zip(points, points[1:], strict=False)]
    chosen = np.unique(np.linspace(0, len(between) - 1, UNSEEN).round().astype(int))
    identified = np.unique(np.linspace(0, len(points) - 1, UNSEEN + 1).round().astype(int))
    sweeps = range(1, SWEEPS + 1)
    return {
        "identified": [_at(rig, points[k], VALIDATION_SEED + int(k)) for k in identified],
        "unseen": [_at(rig, between[k], VALIDATION_SEED + 100 + int(k)) for k in chosen],
        "sweeps": [rig.recording(rig.settings.sweep(k), f"sweep {k}") for k in sweeps],
    }


def _judged(rig: Rig, contender: Contender, tests: Mapping[str, Sequence[Recording]]) -> Answer:
    """FIT by kind of test, mean over recordings and outputs; what is unstable has none."""
    fits = {}
    for kind, recordings in tests.items():
        with np.errstate(all="ignore"):
            percents = [fit_percent(outputs(r), contender.predict(r)) for r in recordings]
        fits[kind] = float(np.mean(np.nan_to_num(percents)))
    places = np.linspace(min(rig.settings.points), max(rig.settings.points), GRID)
    errors = [pole_error(contender.poles(float(p)), _true_poles(rig, float(p))) for p in places]
    return {
        "fit": fits,
        "pole_error": float(np.mean(errors)),
        "pole_errors": errors,
        "parameters": contender.parameters,
        "about": contender.result(),
    }


def _true_poles(rig: Rig, theta2: float) -> np.ndarray:
    poles = posture(rig.model, np.array([0.0, theta2])).poles
    return np.asarray(poles[~integrators(poles)])


Method = Callable[[Rig, Sequence[Recording], tuple[int, ...]], Contender]


def _mean_of_locals(rig: Rig, data: Sequence[Recording], seed: tuple[int, ...]) -> Contender:
    fits = [evolve_fit(rig, "local", [r], _seed(rig, seed, k)) for k, r in enumerate(data)]
    values_of_fits = [shared(f) for f in fits]
    values = {name: float(np.mean([v[name] for v in values_of_fits])) for name in values_of_fits[0]}
    return Physical(rig, rig.model, values)


def _glocal(rig: Rig, data: Sequence[Recording], seed: tuple[int, ...]) -> Contender:
    fitted = evolve_fit(rig, "glocal", data, _seed(rig, seed, len(data)))
    return Physical(rig, rig.model, shared(fitted))


def _black_box(rig: Rig, data: Sequence[Recording], seed: tuple[int, ...]) -> Contender:
    order = len(_true_poles(rig, float(data[0].theta2 or 0.0)))
    pairs = [(references(r), outputs(r)) for r in data]
    points = [float(r.theta2 or 0.0) for r in data]
    return BlackBox(identify_interpolated(pairs, points, order), data[0].sample_time)


def _nonlinear(rig: Rig, data: Sequence[Recording], seed: tuple[int, ...]) -> Contender:
    """Output error of the non-linear model, descended from a random place within the bounds."""
    rng = np.random.default_rng(seeds(rig.settings, START_SEED, *seed))
    start = {n: float(rng.uniform(*ends)) for n, ends in rig.bounds.items()}
    spec = rig.settings.identify(rig.bounds, 1)
    spec = spec.model_copy(update={"start": start, "generations": 0, "refine": True})
    unknowns = collect_unknowns(rig.truth, spec, data)
    experiments = [rig.prepared(r, rig.truth) for r in data]
    fitted = identify("non-linear", experiments, unknowns, spec, {}, Silent())
    return Physical(rig, rig.truth, shared(fitted))


def _seed(rig: Rig, seed: tuple[int, ...], number: int) -> int:
    stream = seeds(rig.settings, POPULATION_SEED, *seed, number)
    return int(stream.generate_state(1)[0])


METHODS: dict[str, Method] = {
    "mean of locals": _mean_of_locals,
    "interpolated black box": _black_box,
    "non-linear output error": _nonlinear,
    "glocal": _glocal,
}
