"""Sixth stage: take the work away, and plan what to record next within the limits of the rig."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from flexgui.core.errors import InputError
from flexgui.export.folder import zipped
from flexgui.export.formats import model_formats
from flexgui.export.model_format import ModelFormat
from flexgui.jobs.messages import Task
from flexgui.page.actions import press
from flexgui.page.earlier_work import FIT, other_settings
from flexgui.page.job_status import JobStatus
from flexgui.page.panel import PageContext, PageElement, Panel
from flexgui.page.plot import Plot
from flexgui.page.widgets import HtmlBlock, button, number, paragraph, stage_macros
from flexgui.session.session import Session
from flexgui.session.state import Topic
from flexgui.stages.data.uploads import (
    found_file,
    recordings_of,
    safe_name,
    scenario_file,
    zipped_folder,
)
from flexgui.stages.export.task import Planned, model_files, playback_page
from flexgui.views.preview import planned
from flexgui.views.summary import summary
from flexgui.views.table import html_equations

WORDS = stage_macros("export", press=press)
REPORT = "M7 3h13l6 6v20H7zM20 3v6h6M11 12h6M11 25v-5M16 25v-9M21 25v-3"
DATA = "M3 5h26v22H3zM3 11h26M11 5v22M14 20c2-7 4-7 6 0s4 5 6 0"
MODEL = "M11 5h11v11H11zM3 10h8M8 7l3 3-3 3M22 10h7M26 10v15H6V10"
"""Small pictures, as paths in a square of 32: a page, a table with a signal, a loop."""


NEXT_TITLE = "Next experiment: references to play"


class Offer(NamedTuple):
    """A file that can be taken away."""

    label: str
    hint: str
    make: Callable[[], object]
    needs_result: bool = True


class Choice(NamedTuple):
    """What somebody wants to take away, and the files that hold it."""

    title: str
    about: str
    picture: str
    offers: tuple[Offer, ...]


class ExportPanel(Panel):
    """What can be downloaded, in groups, on the right; what is in the files on the left."""

    kind = "Export"
    topics = frozenset({Topic.OUTCOME, Topic.RUN, Topic.SCENARIO, Topic.DIAGNOSIS})

    def build_controls(self) -> None:
        self._busy = JobStatus(self.context, "report", "plan")
        self._choices = self._made()
        offers = {o.label: o.make for choice in self._choices for o in choice.offers}
        self.context.actions.register("export", lambda label: offers.get(label, lambda: None)())
        self._files = HtmlBlock(self.gui)
        self._next = NextExperiment(self.context)

    def _made(self) -> tuple[Choice, ...]:
        models = (Offer(f.label, f.hint, partial(self._save_model, f)) for f in model_formats())
        return (
            Choice("Report", "To read, print and pass on.", REPORT, (
                Offer("Report (HTML)", "One page with all figures; opens offline.",
                      partial(self.send_export, "report.html")),
                Offer("3-D playback (HTML)", "The recording at the cursor.", self._save_playback),
                Offer("Everything (zip)", "Report, tables, model and your recordings.",
                      partial(self.send_export, "")),
            )),
            Choice("Data and scenario", "To repeat this work or go on from it.", DATA, (
                Offer("Scenario file", "Runs with “flexgui export”.", self._save_scenario, False),
                Offer("Scenario with what was found", "Reproduces this result.",
                      self._save_found),
                Offer("All tables (zip)", "Every sample as CSV.",
                      partial(self.send_export, "tables")),
            )),
            Choice("Model for other tools", "At the estimate, one file each.", MODEL,
                   tuple(models)),
        )  # fmt: skip

    def build_plots(self) -> None:
        self._references, self._drawn = Plot(self.context, 0.6, NEXT_TITLE), Planned()
        self._about = HtmlBlock(self.gui)

    def refresh(self) -> None:
        session, outcome = self.session, self.session.diagnosis.whole
        free = not session.run.busy
        self._busy.refresh("")
        self._files.show(
            other_settings(session, FIT), WORDS.files(self._choices, outcome is not None, free)
        )
        self._next.refresh()
        if session.export.planned is not self._drawn:
            self._drawn = session.export.planned
            self._references.show_whole(planned(self._drawn.references))
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

    def _save_found(self) -> None:
        session = self.session
        outcome, scenario = session.diagnosis.whole, session.identification.outcome_of
        if outcome is None or scenario is None:
            return
        try:
            self.send(*found_file(scenario, outcome, session.folder))
        except InputError as error:
            session.refuse(error)

    def send_export(self, what: str) -> None:
        """Writes the export; the browser gets a file or a folder of it, or all where empty."""
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

    def _save_model(self, model_format: ModelFormat) -> None:
        outcome = self.session.identification.outcome
        if outcome is None:
            return
        if refusal := model_format.unable(outcome):
            self.session.refuse(refusal)
            return
        task = Task.of(model_files, model_format.label, outcome=outcome, kind=model_format.kind)
        self.session.run.start_export(task, self._send_model)

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
        session.run.start_export(task, lambda page: self.send(name, page.encode()))


def recordings_of_session(session: Session) -> tuple[dict[str, bytes], str]:
    """The files of its recordings, to lie beside the scenarios, which name them without a folder;
    and why there are none: all else is still worth taking away."""
    scenario = session.identification.outcome_of or session.document.scenario
    try:
        return recordings_of(scenario, session.folder), ""
    except InputError as error:
        return {}, str(error)


TITLE = "Next experiment"
SECONDS_RANGE = (1.0, 3600.0, None)
LIMITS = {
    "speed": ("Speed limits", "One per joint: 0.5, 0.8 rad/s (m/s on a slide)."),
    "torque": ("Torque limits", "One per joint: 40, 20 N m (N on a slide)."),
}


class NextExperiment(PageElement):
    """A folder of the controls."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self._seconds = 60.0
        with self.gui.add_folder(TITLE, expand_by_default=False):
            HtmlBlock(self.gui, WORDS.next_experiment())
            number(
                context, "Time (s)", SECONDS_RANGE, lambda: self._seconds, self._wait,
                "Total time available.",
            )  # fmt: skip
            self._fields: dict[str, Any] = {
                key: self.gui.add_text(label, "", hint=hint)
                for key, (label, hint) in LIMITS.items()
            }
            self._button = button(context, "Plan and download (zip)", self._plan)
            self._words = HtmlBlock(self.gui)

    def refresh(self) -> None:
        """As the session stands."""
        able = bool(self.session.document.scenario.recordings) and not self.session.run.busy
        self.enable(able, self._button)
        self._words.show(*map(paragraph, self.session.export.planned.words))

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
        message = f"{label}: write one number per joint, separated by commas: 0.5, 0.8."
        raise InputError(message) from None
