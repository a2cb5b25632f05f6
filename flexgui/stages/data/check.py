"""What the check says of the recordings, and what was mended."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flexgui.core.check.finding import Finding, fixed_columns
from flexgui.core.errors import InputError
from flexgui.core.scenario.schema import Scenario
from flexgui.jobs.file_jobs import run_task
from flexgui.jobs.messages import Task
from flexgui.session.scenario_edits import Edit, ScenarioDict
from flexgui.session.scheduling import LatestRequest
from flexgui.session.state import PagePart, Topic

if TYPE_CHECKING:
    from flexgui.core.check.finding import Finding
    from flexgui.core.progress import Progress
    from flexgui.core.scenario.schema import Scenario
    from flexgui.session.session import Session

TITLE = "The check of the recordings"


class Check:
    """Findings hold for the recordings that were looked at: other ones are looked at anew."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._findings: tuple[Finding, ...] = ()
        self._checked: Scenario | None = None
        """The scenario whose recordings were looked at."""
        self.running = False
        """Whether they are being looked at."""
        self._worker = LatestRequest(session.faults, PagePart.CHECK)
        self.reset()

    def reset(self) -> None:
        """Another scenario follows."""
        self.mended: dict[str, tuple[str, ...]] = {}
        """Recording -> lines of the scenario that a person put there to mend it."""

    @property
    def is_checked(self) -> bool:
        """Whether what the check says is about the recordings as they are now."""
        checked = self._checked
        return checked is not None and _same_rig(checked, self._session.document.scenario)

    def findings_of(self, recording: str) -> tuple[Finding, ...]:
        """What the check says of a recording; nothing before it was looked at."""
        found = self._findings if self.is_checked else ()
        return tuple(one for one in found if one.recording == recording)

    def was_looked_at(self, recording: str) -> bool:
        """Whether the last check took it in."""
        looked = () if self._checked is None else _looked_at(self._checked).recordings
        return recording in {spec.name for spec in looked}

    def start(self) -> None:
        """Looks for faults in all recordings, soon and in a worker; the page hears of it."""
        self.running = bool(self._session.document.scenario.recordings)
        self._session.notify(Topic.RECORDINGS)
        if self.running:
            self._worker.request(self._look)

    def mend(self, one: Finding) -> bool:
        """Puts the line that mends a finding into the scenario, and looks again."""
        names = [spec.name for spec in self._session.document.scenario.recordings]
        if one.mend is None or one.recording not in names:
            return False
        try:
            line = tomllib.loads(one.mend)
        except tomllib.TOMLDecodeError:
            return self._session.refuse(f"{one.recording}: no button can fix this.")
        if not self._session.document.change(_laid_over(names.index(one.recording), line)):
            return False
        with self._session.lock:
            mends = self.mended.get(one.recording, ())
            self.mended = {**self.mended, one.recording: (*mends, one.mend)}
        self.start()
        return True

    def close(self) -> None:
        """Nothing more is looked at."""
        self._worker.close()

    def _look(self) -> None:
        scenario = self._session.document.scenario
        arguments = {"folder": str(self._session.folder), "scenario": _looked_at(scenario)}
        try:
            task = Task.of(findings, TITLE, **arguments)
            found: tuple[Finding, ...] = run_task(self._session.key, task)
        except InputError as error:
            found = ()
            self._session.show_message(str(error), bad=True)
        with self._session.lock:
            self._findings, self._checked, self.running = found, scenario, False
        self._session.notify(Topic.RECORDINGS)


def _looked_at(scenario: Scenario) -> Scenario:
    """Without what was simulated, unless nothing else is there: the model made it."""
    files = tuple(spec for spec in scenario.recordings if spec.file is not None)
    return scenario.model_copy(update={"recordings": files}) if files else scenario


def _same_rig(a: Scenario, b: Scenario) -> bool:
    """Whether the check would say the same of both."""
    return (a.recordings, a.arm, a.drive, a.model, a.sensors) == (
        b.recordings, b.arm, b.drive, b.model, b.sensors,
    )  # fmt: skip


def _laid_over(index: int, line: dict[str, Any]) -> Edit:
    """Puts the settings of a line into the table of a recording, beside what stands there."""

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
    """In the order of the recordings; InputError where one is no table of measurements. Files are
    those of the folder and no others."""
    from flexgui.core.check.run_checks import check_scenario
    from flexgui.core.scenario.data_folder import Within

    return tuple(check_scenario(scenario, Within(Path(folder)), None, progress))
