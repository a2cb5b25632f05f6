"""Findings of the check of the recordings, and the fixes that were applied."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flexgui.core.check.finding import Finding
from flexgui.core.errors import InputError
from flexgui.core.scenario.data_folder import ConfinedFolder
from flexgui.core.scenario.schema import Scenario
from flexgui.jobs.file_jobs import run_task
from flexgui.jobs.messages import Task
from flexgui.session.scenario_edits import Edit, ScenarioDict
from flexgui.session.scheduling import LatestRequest
from flexgui.session.state import PagePart, Topic
from flexgui.stages.data.fixes import fixed_columns

if TYPE_CHECKING:
    from flexgui.core.progress import Progress
    from flexgui.session.session import Session

TITLE = "The check of the recordings"


class Check:
    """Findings for the current recordings; changed recordings are checked again."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._findings: tuple[Finding, ...] = ()
        self.checked: Scenario | None = None
        """The scenario whose recordings were looked at."""
        self.running = False
        """Whether they are being looked at."""
        self._worker = LatestRequest(session.faults, PagePart.CHECK)
        self.reset()

    def reset(self) -> None:
        """Clears everything for a new scenario."""
        self.mended: dict[str, tuple[str, ...]] = {}
        """Recording -> lines of the scenario that a person put there to mend it."""

    @property
    def is_checked(self) -> bool:
        """Whether the findings are about the current recordings."""
        checked = self.checked
        return checked is not None and _same_rig(checked, self._session.document.scenario)

    def findings_of(self, recording: str) -> tuple[Finding, ...]:
        """Findings about one recording; none before the check."""
        findings = self._findings if self.is_checked else ()
        return tuple(finding for finding in findings if finding.recording == recording)

    def was_checked(self, recording: str) -> bool:
        """Whether the last check included the recording."""
        looked = () if self.checked is None else _to_check(self.checked).recordings
        return recording in {spec.name for spec in looked}

    def start(self) -> None:
        """Checks all recordings in a worker and notifies the page; not by an arm that is only an
        example, which they would contradict."""
        is_example = self._session.recordings.rig.is_asked
        self.running = bool(self._session.document.scenario.recordings) and not is_example
        self._session.notify(Topic.RECORDINGS)
        if self.running:
            self._worker.request(self._look)

    def mend(self, finding: Finding) -> bool:
        """Applies the fix of a finding to the scenario, and checks again."""
        names = [spec.name for spec in self._session.document.scenario.recordings]
        if finding.fix is None or finding.recording not in names:
            return False
        try:
            line = tomllib.loads(finding.fix)
        except tomllib.TOMLDecodeError:
            return self._session.refuse(f"{finding.recording}: no button can fix this.")
        if not self._session.document.change(_merged(names.index(finding.recording), line)):
            return False
        with self._session.lock:
            mends = self.mended.get(finding.recording, ())
            self.mended = {**self.mended, finding.recording: (*mends, finding.fix)}
        self.start()
        return True

    def dismiss(self, finding: Finding) -> bool:
        """States in the scenario that what was found is right as it is."""
        names = [spec.name for spec in self._session.document.scenario.recordings]
        if finding.recording not in names:
            return False
        index, checked = names.index(finding.recording), self.is_checked

        def edit(document: ScenarioDict) -> None:
            table = document["recordings"][index]
            table["dismissed"] = [*table.get("dismissed", ()), finding.key]

        if not self._session.document.change(edit):
            return False
        if checked:  # nothing else has changed
            with self._session.changing(Topic.RECORDINGS):
                self._findings = tuple(f for f in self._findings if f is not finding)
                self.checked = self._session.document.scenario
        return True

    def close(self) -> None:
        """Stops the checks."""
        self._worker.close()

    def _look(self) -> None:
        scenario = self._session.document.scenario
        arguments = {"folder": str(self._session.folder), "scenario": _to_check(scenario)}
        try:
            task = Task.of(findings, TITLE, **arguments)
            found: tuple[Finding, ...] = run_task(self._session.key, task)
        except InputError as error:
            found = ()
            self._session.show_message(str(error), bad=True)
        with self._session.changing(Topic.RECORDINGS):
            self._findings, self.checked, self.running = found, scenario, False


def _to_check(scenario: Scenario) -> Scenario:
    """The scenario with recordings from files only, if there are any."""
    files = tuple(spec for spec in scenario.recordings if spec.file is not None)
    return scenario.model_copy(update={"recordings": files}) if files else scenario


def _same_rig(a: Scenario, b: Scenario) -> bool:
    """Whether the check gives the same findings for both."""
    return (a.recordings, a.arm, a.drive, a.model, a.sensors) == (
        b.recordings, b.arm, b.drive, b.model, b.sensors,
    )  # fmt: skip


def _merged(index: int, line: dict[str, Any]) -> Edit:
    """Merges the settings of a fix into the table of a recording."""

    def edit(document: ScenarioDict) -> None:
        table = document["recordings"][index]
        for key, value in line.items():
            if key == "columns":
                value = fixed_columns(table.get(key, {}), value)
            elif isinstance(value, dict):
                value = {**table.get(key, {}), **value}
            table[key] = value

    return edit


def findings(folder: str, scenario: Scenario, *, progress: Progress) -> tuple[Finding, ...]:
    """Findings in the order of the recordings; InputError if a file is not a table."""
    from flexgui.core.check.run_checks import check_scenario

    return tuple(check_scenario(scenario, ConfinedFolder(Path(folder)), None, progress))
