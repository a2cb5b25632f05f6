"""All that the finished cases of a study say; a part that is not finished yet is missing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from core.montecarlo.comparison import (
    BaselineRow,
    BiasSource,
    Validation,
    baseline_rows,
    bias_sources,
    validation,
)
from core.montecarlo.estimates import EstimateTable, estimate_tables
from core.montecarlo.findings import findings
from core.montecarlo.planning import Planning, planning
from core.montecarlo.rig import Rig
from core.montecarlo.settings import StudySettings
from core.montecarlo.study import study_cases
from core.montecarlo.valley import ValleyPrior, valley_prior
from core.resumable.journal import Record


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
    findings: tuple[tuple[str, str], ...]
    """(heading, paragraph)"""
    stiffness: tuple[float, ...]
    """True EI in N m², as many as the tables have."""

    @property
    def true_EI(self) -> float:
        """N m², of the first segment."""
        return self.stiffness[0]


def summarise(settings: StudySettings, records: Mapping[str, Record]) -> Summary:
    """From records in any order; the same records give the same summary."""
    records = {c.key: records[c.key] for c in study_cases(settings) if c.key in records}
    stiffness = tuple(Rig(settings).stiffness({}))
    EI = stiffness[0]
    tables = estimate_tables(settings, records)
    prior = valley_prior(records, EI)
    checked = validation(records)
    rows = baseline_rows(records)
    sources = bias_sources(records)
    plan = planning(settings, records, tables)
    return Summary(
        settings.scenario.title, settings, tables, prior, checked, rows, sources, plan,
        findings(tables, prior, checked, rows, sources, plan, EI), stiffness,
    )  # fmt: skip
