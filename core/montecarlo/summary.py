"""All that the finished cases of a study say, in numbers; an unfinished part is missing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..montecarlo.estimates import EstimateTable, ValleyPrior, estimate_tables, valley_prior
from ..montecarlo.planning import Planning, planning
from ..montecarlo.rig import Rig
from ..montecarlo.settings import StudySettings
from ..montecarlo.study import study_cases
from ..resumable.journal import Record


@dataclass(frozen=True)
class BaselineRow:
    """One method on one set of data."""

    snr_db: float | None
    points: int
    method: str
    fit: Mapping[str, float]
    """% at identified and unseen working points and on sweeps, mean over recordings and outputs."""
    pole_error: float
    """Mean relative distance of the poles over theta2."""
    pole_errors: np.ndarray
    """Over the range of theta2."""
    parameters: int
    seconds: float
    found: Mapping[str, Any]
    """What it is about: 'EI', N m² of each segment; or 'order' and 'degree' in cos theta2."""


def _baseline_rows(records: Mapping[str, Record]) -> tuple[BaselineRow, ...]:
    """By number of points, then ratio in the order of the cases, then method."""
    answers = [r["answer"] for r in records.values() if r["part"] == "baselines"]
    return tuple(
        BaselineRow(
            snr_db=answer["snr_db"],
            points=answer["points"],
            method=entry["method"],
            fit=dict(entry["fit"]),
            pole_error=entry["pole_error"],
            pole_errors=np.array(entry["pole_errors"]),
            parameters=entry["parameters"],
            seconds=entry["seconds"],
            found=dict(entry["about"]),
        )
        for answer in answers
        for entry in answer["methods"]
    )


LEVELS = {"lpv": "LPV", "rigid": "rigid arm", "nonlinear": "non-linear"}
"""level -> how it is called."""


@dataclass(frozen=True)
class Validation:
    """The sweeps of a study; fits[level] is (sweeps, 2) in %."""

    sweeps: tuple[int, ...]
    snr_db: float | None
    """Of the data that the estimates come from; the sweeps themselves have no noise."""
    fits: Mapping[str, np.ndarray]
    time: np.ndarray
    """s, of the first sweep's path."""
    theta2: np.ndarray
    """rad"""

    def mean(self, level: str) -> tuple[float, float]:
        """Average FIT of both velocities."""
        first, second = self.fits[level].mean(axis=0)
        return float(first), float(second)


def _validation(records: Mapping[str, Record]) -> Validation | None:
    """None where no sweep is finished."""
    answers = [r["answer"] for key, r in sorted(records.items()) if r["part"] == "sweeps"]
    if not answers:
        return None
    return Validation(
        tuple(a["sweep"] for a in answers),
        answers[0]["snr_db"],
        {level: np.array([a["fit"][level] for a in answers]) for level in LEVELS},
        np.array(answers[0]["time"]),
        np.array(answers[0]["theta2"]),
    )


@dataclass(frozen=True)
class BiasSource:
    """Relative bias of EI without noise, for one excitation and one way to take J."""

    excitation: str
    rates: str
    """'tip', 'encoders' or 'working point': at which angles J is taken."""
    local: np.ndarray
    """(draws, points)"""
    glocal: np.ndarray
    """(draws,)"""
    wander: np.ndarray
    """(draws, points) rad: the range of theta2 in each experiment."""

    @property
    def rms(self) -> np.ndarray:
        """(points,)"""
        return np.sqrt(np.mean(self.local**2, axis=0))

    @property
    def glocal_rms(self) -> float:
        """Root mean square of the glocal estimates' bias."""
        return float(np.sqrt(np.mean(self.glocal**2)))


def _bias_sources(records: Mapping[str, Record]) -> tuple[BiasSource, ...]:
    """In the order in which they were computed; empty where none is finished."""
    answers = [r["answer"] for key, r in sorted(records.items()) if r["part"] == "bias"]
    if not answers:
        return ()
    sources = []
    for k, first in enumerate(answers[0]["sources"]):
        answers_of_source = [a["sources"][k] for a in answers]
        sources.append(
            BiasSource(
                first["excitation"],
                first["rates"],
                np.array([s["local"] for s in answers_of_source]),
                np.array([s["glocal"] for s in answers_of_source]),
                np.array([s["wander"] for s in answers_of_source]),
            )
        )
    return tuple(sources)


@dataclass(frozen=True)
class Summary:
    """Tables and figures in numbers; views turn them into something to see."""

    title: str
    settings: StudySettings
    tables: tuple[EstimateTable, ...]
    prior: ValleyPrior | None
    validation: Validation | None
    baselines: tuple[BaselineRow, ...]
    bias: tuple[BiasSource, ...]
    planning: Planning | None
    stiffness: tuple[float, ...]
    """True EI in N m², as many as the tables have."""

    @property
    def true_EI(self) -> float:
        """N m², of the first segment."""
        return self.stiffness[0]


def summarise(settings: StudySettings, records: Mapping[str, Record]) -> Summary:
    """From records in any order; the same records give the same summary."""
    records = {c.key: records[c.key] for c in study_cases(settings) if c.key in records}
    tables = estimate_tables(settings, records)
    stiffness = tuple(Rig(settings).stiffness({}))
    return Summary(
        settings.scenario.title, settings, tables, valley_prior(records, stiffness[0]),
        _validation(records), _baseline_rows(records), _bias_sources(records),
        planning(settings, records, tables), stiffness,
    )  # fmt: skip
