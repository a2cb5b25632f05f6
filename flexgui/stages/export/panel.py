"""Sixth stage: take the work away, and plan what to record next within the limits of the rig."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from flexgui.core.errors import InputError
from flexgui.export.folder import zipped
from flexgui.export.formats import model_formats
from flexgui.export.model_format import ModelFormat
from flexgui.jobs.messages import Task
from flexgui.page.panel import PageContext, Panel, Piece
from flexgui.page.widgets import Words, button, number, paragraph, words_of
from flexgui.session.session import Session
from flexgui.session.state import Topic
from flexgui.stages.data.uploads import (
    diagnosed_file,
    recordings_of,
    safe_name,
    scenario_file,
    zipped_folder,
)
from flexgui.stages.export.task import model_files, playback_page
from flexgui.views.summary import summary
from flexgui.views.table import html_equations

WORDS = words_of("export")
EVERYTHING = (
    "Report, tables, model and your recordings; simulated ones lie in the tables only. The 3-D "
    "playback is a file of its own, and in the report where it stays below 4 MB."
)


class ExportPanel(Panel):
    """Buttons that download, on the right; a summary of what is in the files on the left."""

    kind = "Export"
    topics = frozenset({Topic.OUTCOME, Topic.RUN, Topic.SCENARIO, Topic.DIAGNOSIS})

    def build_controls(self) -> None:
        context = self.context
        self._lead = Words(self.gui)
        report = button(context, "Report (HTML)", partial(self._from_export, "report.html"), True)
        button(
            context, "Scenario file", self._save_scenario,
            hint="What `flexgui export` runs; with your recordings in one zip.",
        )  # fmt: skip
        self._diagnosed = button(
            context, "Scenario with what was found", self._save_diagnosed,
            hint="Runs again to the same error; with your recordings in one zip.",
        )  # fmt: skip
        wishes: tuple[tuple[str, Callable[[], object], str], ...] = (
            ("All tables (zip)", partial(self._from_export, "tables"), "Every sample as CSV."),
            ("Everything (zip)", partial(self._from_export, ""), EVERYTHING),
            ("3-D playback (HTML)", self._save_playback, "The recording under the cursor."),
            *((one.label, partial(self._save_model, one), one.hint) for one in model_formats()),
        )
        made = [button(context, label, action, hint=hint) for label, action, hint in wishes]
        self._need_result = [report, *made]
        self._next = NextExperiment(context)
        self._bar = self.gui.add_progress_bar(100.0, visible=False, animated=True)

    def build_plots(self) -> None:
        self._about = Words(self.gui)

    def refresh(self) -> None:
        run, outcome = self.session.run, self.session.diagnosis.whole
        self.enable(outcome is not None and not run.busy, *self._need_result)
        self._diagnosed.visible = outcome is not None and outcome.diagnosis is not None
        self.enable(not run.busy, self._diagnosed)
        self._bar.visible = run.state.busy
        writing = run.state.busy and run.state.kind == "report"
        fitted = self.session.identification.outcome is not None
        self._lead.show(WORDS.lead(writing, fitted))
        self._next.refresh()
        found = () if outcome is None else (summary(outcome), html_equations(outcome.equations))
        self._about.show(WORDS.result(outcome, *found))

    def _name(self, ending: str) -> str:
        outcome = self.session.identification.outcome
        title = (self.session.document.scenario if outcome is None else outcome).title
        return f"{safe_name(title).replace(' ', '_')}{ending}"

    def _save_scenario(self) -> None:
        session = self.session
        scenario = session.identification.outcome_of or session.document.scenario
        try:
            self.send(*scenario_file(scenario, session.folder))
        except InputError as error:
            session.refuse(error)

    def _save_diagnosed(self) -> None:
        session = self.session
        outcome, scenario = session.diagnosis.whole, session.identification.outcome_of
        if outcome is None or outcome.diagnosis is None or scenario is None:
            return
        try:
            self.send(*diagnosed_file(scenario, outcome.diagnosis, session.folder))
        except InputError as error:
            session.refuse(error)

    def _from_export(self, what: str) -> None:
        self.session.export.report(partial(self._written, what))

    def _written(self, what: str, folder: Path) -> None:
        """Sends a file of the export, or a folder of it with all that is in there."""
        path = folder / what
        if not path.is_dir():
            self.send(self._name(f"_{what}"), path.read_bytes())
        elif what:
            self.send(self._name(f"_{what}.zip"), zipped_folder(path))
        else:
            beside, without = recordings_of_session(self.session)
            self.send(self._name(".zip"), zipped_folder(path, beside), without)

    def _save_model(self, one: ModelFormat) -> None:
        outcome = self.session.identification.outcome
        if outcome is None:
            return
        if refusal := one.unable(outcome):
            self.session.refuse(refusal)
            return
        task = Task.of(model_files, one.label, outcome=outcome, kind=one.kind)
        self.session.run.make(task, self._send_model)

    def _send_model(self, files: dict[str, bytes]) -> None:
        first = Path(next(iter(files)))
        if len(files) == 1:
            self.send(self._name(f"_{first.name}"), files[str(first)])
        else:
            self.send(self._name(f"_{first.parent}.zip"), zipped(files))

    def _save_playback(self) -> None:
        session = self.session
        shown, factor = session.playback.motion, session.document.live.exaggeration
        if shown is None:
            session.refuse("There is no recording to play; choose one first.")
            return
        task = Task.of(playback_page, "3-D playback", shown=shown, exaggeration=factor)
        name = self._name("_playback.html")
        session.run.make(task, lambda page: self.send(name, page.encode()))


def recordings_of_session(session: Session) -> tuple[dict[str, bytes], str]:
    """The files of its recordings, to lie beside the scenarios, which name them without a folder;
    and why there are none: all else is still worth taking away."""
    scenario = session.identification.outcome_of or session.document.scenario
    try:
        return recordings_of(scenario, session.folder), ""
    except InputError as error:
        return {}, str(error)


TITLE = "Next experiment"
SECONDS = (1.0, 3600.0, None)
LIMITS = {
    "speed": ("Speed limits", "Per joint, by commas: 0.5, 0.8 rad/s (m/s on a slide)."),
    "torque": ("Torque limits", "Per joint, by commas: 40, 20 N m (N on a slide)."),
}


class NextExperiment(Piece):
    """A folder of the controls."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self._seconds = 60.0
        with self.gui.add_folder(TITLE, expand_by_default=False):
            Words(self.gui, WORDS.next_experiment())
            number(
                context, "Time (s)", SECONDS, lambda: self._seconds, self._wait,
                "That you have, for all experiments together.",
            )  # fmt: skip
            self._fields: dict[str, Any] = {
                key: self.gui.add_text(label, "", hint=hint)
                for key, (label, hint) in LIMITS.items()
            }
            self._button = button(context, "Plan and download (zip)", self._plan)
            self._words = Words(self.gui)

    def refresh(self) -> None:
        """As the session stands."""
        able = bool(self.session.document.scenario.recordings) and not self.session.run.busy
        self.enable(able, self._button)
        self._words.show(*map(paragraph, self.session.export.planned))

    def _wait(self, seconds: float) -> None:
        self._seconds = float(seconds)

    def _plan(self) -> None:
        texts = {key: field.value for key, field in self._fields.items() if field.value.strip()}
        try:
            limits = {key: _numbers(LIMITS[key][0], text) for key, text in texts.items()}
        except InputError as error:
            self.session.refuse(error)
            return
        self.session.export.plan(self._seconds, limits, self._download)

    def _download(self, folder: Path) -> None:
        beside, without = recordings_of_session(self.session)
        self.send("next_experiment.zip", zipped_folder(folder, beside), without)


def _numbers(label: str, text: str) -> list[float]:
    try:
        return [float(part) for part in text.replace(";", ",").split(",") if part.strip()]
    except ValueError:
        message = f"{label}: write a number per joint, by commas: 0.5, 0.8."
        raise InputError(message) from None
