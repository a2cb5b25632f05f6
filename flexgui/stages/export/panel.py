"""Sixth stage: take the work away, and plan what to record next within the limits of the rig."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

from flexgui.core.errors import InputError
from flexgui.export.folder import zipped
from flexgui.export.formats import model_formats
from flexgui.export.model_format import ModelFormat
from flexgui.jobs.task import Task
from flexgui.page import widgets
from flexgui.page.panel import PageContext, Panel
from flexgui.page.widgets import Words, joined, paragraph
from flexgui.session import Topic
from flexgui.stages.data.uploads import (
    diagnosed_file,
    recordings_of,
    safe_name,
    scenario_file,
    zipped_folder,
)
from flexgui.stages.export.task import model_files, playback_page
from flexgui.views.html import html_equations
from flexgui.views.summary import summary

ALWAYS = "The scenario can be saved at any time; everything else needs a result: identify first."
READY = "All files belong to the last result, including the scenario that led to it."
EVERYTHING = (
    "Report, tables, model and your recordings; simulated ones lie in the tables only. The 3-D "
    "playback is a file of its own, and in the report where it stays below 4 MB."
)
EMPTY = "After an identification this shows what the report says, and the equations of its model."


class ExportPanel(Panel):
    """Buttons that download, on the right; a summary of what is in the files on the left."""

    kind: ClassVar[str] = "Export"
    topics: ClassVar[frozenset[Topic]] = frozenset(
        {Topic.OUTCOME, Topic.RUN, Topic.SCENARIO, Topic.DIAGNOSIS}
    )

    def build_controls(self) -> None:
        context = self.context
        self._lead = Words(context.gui)
        self._report = widgets.button(
            context, "Report (HTML)", lambda: self._from_export("report.html"), prominent=True
        )
        self._needs: list[Any] = [self._report]
        self._scenario = widgets.button(
            context, "Scenario file", self._save_scenario,
            hint="What `flexgui export` runs; with your recordings in one zip.",
        )  # fmt: skip
        self._diagnosed = widgets.button(
            context, "Scenario with what was found", self._save_diagnosed,
            hint="Runs again to the same error; with your recordings in one zip.",
        )  # fmt: skip
        wishes: dict[str, tuple[Callable[[], object], str]] = {
            "All tables (zip)": (lambda: self._from_export("tables"), "Every sample as CSV."),
            "Everything (zip)": (lambda: self._from_export(""), EVERYTHING),
            "3-D playback (HTML)": (self._save_playback, "The recording under the cursor."),
        }
        for label, (action, hint) in wishes.items():
            self._needs.append(widgets.button(context, label, action, hint=hint))
        for one in model_formats():
            action = partial(self._save_model, one)
            self._needs.append(widgets.button(context, one.label, action, hint=one.hint))
        self._next = NextExperiment(context, self._send)
        self._bar = context.gui.add_progress_bar(100.0, visible=False, animated=True)

    def build_plots(self) -> None:
        self._about = Words(self.context.gui)

    def refresh(self) -> None:
        session = self.context.session
        outcome, run = session.diagnosis.whole, session.run.state
        for each in self._needs:
            each.disabled = outcome is None or session.run.busy or self.context.read_only
        self._diagnosed.visible = outcome is not None and outcome.diagnosis is not None
        self._diagnosed.disabled = session.run.busy or self.context.read_only
        self._bar.visible = run.busy
        writing = run.busy and run.kind == "report"
        self._lead.show(paragraph(self._sentence(writing), "soft"))
        self._next.refresh()
        if outcome is None:
            self._about.show(paragraph(EMPTY, "soft"))
            return
        texts = (paragraph(text) for text in summary(outcome))
        head = paragraph(outcome.title, "lead")
        self._about.show(joined(head, *texts, html_equations(outcome.equations)))

    def _sentence(self, writing: bool) -> str:
        if writing:
            return "Writing …"
        return ALWAYS if self.context.session.identification.outcome is None else READY

    def _name(self, ending: str) -> str:
        outcome = self.context.session.identification.outcome
        title = (
            outcome.title if outcome is not None else self.context.session.document.scenario.title
        )
        return f"{safe_name(title).replace(' ', '_')}{ending}"

    def _send(self, name: str, content: bytes, without: str = "") -> None:
        self.context.client.send_file_download(name, content, save_immediately=True)
        sentence = f"{name} was sent to your browser{without and ', without recordings: '}{without}"
        self.context.session.show_message(sentence.rstrip(".") + ".", bad=bool(without))

    def _save_scenario(self) -> None:
        session = self.context.session
        scenario = (
            session.identification.outcome_of
            if session.identification.outcome is not None
            else session.document.scenario
        )
        try:
            self._send(*scenario_file(scenario or session.document.scenario, session.folder))
        except InputError as error:
            session.show_message(str(error), bad=True)

    def _save_diagnosed(self) -> None:
        session = self.context.session
        outcome, scenario = session.diagnosis.whole, session.identification.outcome_of
        if outcome is None or outcome.diagnosis is None or scenario is None:
            return
        try:
            self._send(*diagnosed_file(scenario, outcome.diagnosis, session.folder))
        except InputError as error:
            session.show_message(str(error), bad=True)

    def _from_export(self, what: str) -> None:
        def written(folder: Path) -> None:
            path = folder / what
            if path.is_dir():
                ending = f"_{what}.zip" if what else ".zip"
                beside, without = ({}, "") if what else recordings_of_session(self.context)
                self._send(self._name(ending), zipped_folder(path, beside), without)
            else:
                self._send(self._name(f"_{what}"), path.read_bytes())

        self.context.session.export.report(written)

    def _save_model(self, one: ModelFormat) -> None:
        session = self.context.session
        outcome = session.identification.outcome
        if outcome is None:
            return
        if refusal := one.unable(outcome):
            session.show_message(refusal, bad=True)
            return
        task = Task.of(model_files, one.label, outcome=outcome, kind=one.kind)
        session.run.make(task, self._send_model)

    def _send_model(self, files: dict[str, bytes]) -> None:
        first = Path(next(iter(files)))
        if len(files) == 1:
            self._send(self._name(f"_{first.name}"), files[str(first)])
        else:
            self._send(self._name(f"_{first.parent}.zip"), zipped(files))

    def _save_playback(self) -> None:
        session = self.context.session
        shown = session.playback.motion
        if shown is None:
            session.show_message("There is no recording to play; choose one first.", bad=True)
            return
        factor = session.document.live.exaggeration
        task = Task.of(playback_page, "3-D playback", shown=shown, exaggeration=factor)
        name = self._name("_playback.html")
        session.run.make(task, lambda page: self._send(name, page.encode()))


def recordings_of_session(context: PageContext) -> tuple[dict[str, bytes], str]:
    """The files of its recordings, to lie beside the scenarios, which name them without a folder;
    and why there are none: all else is still worth taking away."""
    session = context.session
    try:
        return recordings_of(
            session.identification.outcome_of or session.document.scenario, session.folder
        ), ""
    except InputError as error:
        return {}, str(error)


TITLE = "Next experiment"
ABOUT = (
    "References that the rig can play within its limits, chosen so that the parameters become "
    "known best. Leave a limit empty to stay within what was recorded."
)
SECONDS = (1.0, 3600.0)

LIMITS = {
    "speed": ("Speed limits", "Per joint, by commas: 0.5, 0.8 rad/s (m/s on a slide)."),
    "torque": ("Torque limits", "Per joint, by commas: 40, 20 N m (N on a slide)."),
}


class NextExperiment:
    """A folder of the controls."""

    def __init__(self, context: PageContext, send: Callable[[str, bytes, str], None]) -> None:
        self._context, self._send, self._seconds = context, send, 60.0
        with context.gui.add_folder(TITLE, expand_by_default=False):
            Words(context.gui).show(paragraph(ABOUT, "soft"))
            widgets.number(
                context, "Time (s)", lambda: self._seconds, self._wait, *SECONDS,
                hint="That you have, for all experiments together.",
            )  # fmt: skip
            self._fields = {
                key: context.gui.add_text(label, "", hint=hint)
                for key, (label, hint) in LIMITS.items()
            }
            self._button = widgets.button(context, "Plan and download (zip)", self._plan)
            self._words = Words(context.gui)

    def refresh(self) -> None:
        """As the session stands."""
        session = self._context.session
        able = bool(session.document.scenario.recordings) and not session.run.busy
        self._button.disabled = not able or self._context.read_only
        for field in self._fields.values():
            field.disabled = self._context.read_only
        self._words.show(joined(*(paragraph(text) for text in session.export.planned)))

    def _wait(self, seconds: float) -> None:
        self._seconds = float(seconds)

    def _plan(self) -> None:
        session = self._context.session
        try:
            limits = {
                key: _numbers(LIMITS[key][0], field.value)
                for key, field in self._fields.items()
                if field.value.strip()
            }
        except InputError as error:
            session.show_message(str(error), bad=True)
            return
        session.export.plan(self._seconds, limits, self._download)

    def _download(self, folder: Path) -> None:
        beside, without = recordings_of_session(self._context)
        self._send("next_experiment.zip", zipped_folder(folder, beside), without)


def _numbers(label: str, text: str) -> list[float]:
    try:
        return [float(part) for part in text.replace(";", ",").split(",") if part.strip()]
    except ValueError:
        message = f"{label}: write a number per joint, by commas: 0.5, 0.8."
        raise InputError(message) from None
