"""What a session knows of its study: what was chosen, how far it is, what is shown."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from markupsafe import Markup

from flexgui.core.errors import InputError
from flexgui.core.montecarlo.settings import StudySettings, make_settings
from flexgui.core.resumable.journal import Record
from flexgui.core.scenario.schema import Scenario
from flexgui.stages.study.plots_estimates import parameter_table, snr, stiffness_table
from flexgui.views.layout import Figure
from flexgui.views.table import Table, html_table

if TYPE_CHECKING:
    from flexgui.core.montecarlo.summary import Summary

IDLE, RUNNING, STOPPING = "idle", "running", "stopping"
STOPPED, DONE, FAILED = "stopped", "done", "failed"


@dataclass(frozen=True)
class StudyState:
    """One study of the session."""

    phase: str = IDLE
    settings: StudySettings | None = None
    """What is studied; None: nothing yet."""
    parts: tuple[str, ...] = ()
    done: int = 0
    total: int = 0
    before: int = 0
    """Of `done`, what was known when it began."""
    remaining_seconds: float | None = None
    """None where nobody knows."""
    sentence: str = ""
    """Why it failed."""
    sections: tuple[ShownSection, ...] = ()
    """What has been drawn of its results; a moment behind `done`."""

    @property
    def busy(self) -> bool:
        """Whether the study runs or is being stopped."""
        return self.phase in (RUNNING, STOPPING)

    @property
    def share(self) -> float:
        """Of the cases that are done, 0 to 1."""
        return self.done / self.total if self.total else 0.0


def remaining(
    records: Mapping[str, Record], new: Iterable[str], open_parts: Iterable[str], elapsed: float
) -> float | None:
    """s for the cases `open_parts`, named by their parts, if the cases with the keys `new` took
    `elapsed` s; None where `new` is empty.

    The parts differ by a factor of a hundred, so each is expected to go on as it has begun.
    """
    work = sum(records[key]["seconds"] for key in new)
    if not work or elapsed <= 0.0:
        return None
    each: dict[str, list[float]] = defaultdict(list)
    for record in records.values():
        each[record["part"]].append(record["seconds"])
    mean = {part: sum(values) / len(values) for part, values in each.items()}
    usual = sum(mean.values()) / len(mean)
    return sum(mean.get(part, usual) for part in open_parts) * elapsed / work


FEW, PAPER = 5, 20
"""Runs: for a look in front of a class, and as in the paper."""

MOST_RUNS, MOST_AT_ONCE = 500, 4

NOTHING_TO_DO = "The chosen parts have nothing to compute here; choose Estimates as well."


@dataclass(frozen=True)
class StudyChoice:
    """The first one takes seconds."""

    runs: int = FEW
    parts: tuple[str, ...] = ("fits",)
    at_once: int = 2
    """Cases under way at a time, where the workers are free."""


def asked(scenario: Scenario, choice: StudyChoice) -> StudySettings:
    """InputError, one sentence, where there is no such study."""
    from flexgui.core.montecarlo.rig import Rig
    from flexgui.core.montecarlo.study import study_cases

    if not choice.parts:
        raise InputError("No part of the study is chosen; choose Estimates at least.")
    settings = make_settings(scenario, runs=choice.runs)
    _ = Rig(settings).truth  # an arm of another kind is refused here, not in a worker
    if not study_cases(settings, choice.parts):
        raise InputError(NOTHING_TO_DO)
    return settings


def refusal_of(scenario: Scenario) -> str:
    """Why no study can be made of a scenario, in one sentence; empty where one can."""
    try:
        asked(scenario, StudyChoice())
    except InputError as error:
        return str(error)
    return ""


FINDINGS = "Conclusions"
TITLED, PARAGRAPH = Markup("<h4>{}</h4>{}"), Markup("<h4>{}</h4><p>{}</p>")


@dataclass(frozen=True)
class ShownSection:
    """Figures, and tables or paragraphs below them."""

    title: str
    figures: tuple[Figure, ...]
    words: Markup


def shown(summary: Summary) -> tuple[ShownSection, ...]:
    """The report's sections as far as there are results, and its findings."""
    from flexgui.stages.study.findings import findings
    from flexgui.stages.study.report import sections

    parts = []
    for section in sections(summary):
        tables = _short_tables(summary) if section.id == "estimates" else ()
        own = section.tables[2:] if tables else section.tables
        words = Markup("").join(TITLED.format(t, html_table(table)) for t, table in (*tables, *own))
        parts.append(ShownSection(section.title, section.figures, words))
    paragraphs = [PARAGRAPH.format(heading, text) for heading, text in findings(summary)]
    if paragraphs:
        parts.append(ShownSection(FINDINGS, (), Markup("").join(paragraphs)))
    return tuple(parts)


def _short_tables(summary: Summary) -> Iterator[tuple[str, Table]]:
    """The two wide tables of the report ratio by ratio: a page has half its width."""
    for table in summary.tables:
        yield f"Estimates at {snr(table.snr_db)}", parameter_table([table])
    for table in summary.tables:
        yield f"EI at {snr(table.snr_db)}", stiffness_table([table], summary.stiffness)
