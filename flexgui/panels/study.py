"""Last stage: the identification many times over, as in the paper, beside other methods."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any, ClassVar

from markupsafe import Markup

from core.errors import InputError
from core.montecarlo.part import Part
from core.montecarlo.study import parts, study_cases
from core.scenario.schema import Scenario
from core.sentences import listed
from flexgui.panels import widgets
from flexgui.panels.confirm import Confirm
from flexgui.panels.panel import Panel
from flexgui.panels.study_results import StudyResults
from flexgui.panels.words import Words, joined, paragraph
from flexgui.session import Topic
from flexgui.session.bundle import zipped_folder
from flexgui.session.demo import DEMO
from flexgui.session.study_choice import MOST_AT_ONCE, MOST_RUNS, StudyChoice, asked, whole
from flexgui.session.study_state import DONE, FAILED, STOPPING, StudyState
from flexgui.session.uploads import safe_name
from flexgui.views.study_estimates import snr

MINUTE = 60.0
LONG = 90.0
"""s from which a time is told in minutes."""

START, GO_ON = "Start the study", "Go on with the study"

MORE = "More runs or other parts continue from the present results; nothing is computed twice."
OPEN = "Open the paper's arm and experiments"
REPLACES = (
    "This replaces your recordings, the identification and the diagnosis by the paper's arm. "
    "Export first what you want to keep. Replace them?"
)


class StudyPanel(Panel):
    """How much of it and how it stands on the right; tables and figures, as they come, left."""

    kind: ClassVar[str] = "Study"
    topics: ClassVar[frozenset[Topic]] = frozenset({Topic.STUDY, Topic.SCENARIO, Topic.RUN})

    def build_controls(self) -> None:
        desk, session = self.desk, self.desk.session
        self._results = StudyResults(desk)
        self._state = Words(desk.gui)
        self._bar: Any = desk.gui.add_progress_bar(0.0, visible=False, animated=True)
        self._start = widgets.button(
            desk, START, lambda: session.start_study(desk.services), prominent=True
        )
        self._stop = widgets.button(desk, "Stop", session.stop_study)
        self._open = Confirm(
            desk, OPEN, REPLACES, lambda: session.choose(DEMO, desk.services), self._has_work,
            "Replace my work", "Keep my work",
        )  # fmt: skip
        self._results.build_choice()
        self._save = widgets.button(
            desk, "Save the results (zip)", self._export,
            hint="A page with all figures, tables as CSV, result.json, and what "
            "`flexgui study` needs to continue from here.",
        )  # fmt: skip
        self._settings()
        self._said = Words(desk.gui)

    def _settings(self) -> None:
        desk, session = self.desk, self.desk.session
        self._choices = desk.gui.add_folder("Extent")
        with self._choices:
            widgets.number(
                desk, "Runs", lambda: session.study_choice.runs,
                lambda v: session.choose_study(runs=int(v)), 1, MOST_RUNS, 1,
                "Each with fresh noise and a fresh first population; the paper has 20.",
            )  # fmt: skip
            for part in parts().values():
                self._switch(part)
            widgets.number(
                desk, "Parallel cases", lambda: session.study_choice.at_once,
                lambda v: session.choose_study(at_once=int(v)), 1, MOST_AT_ONCE, 1,
                "Cases that run at the same time; other users of this server run in between.",
            )  # fmt: skip
            self._whole = widgets.button(desk, "All of it, as in the paper", self._choose_whole)

    def _switch(self, part: Part) -> None:
        session, kind = self.desk.session, part.kind
        widgets.switch(
            self.desk, part.title, lambda: kind in session.study_choice.parts,
            lambda on: self._choose_part(kind, on), inspect.getdoc(type(part)) or "",
        )  # fmt: skip

    def build_plots(self) -> None:
        self._results.build_plots()

    def refresh(self) -> None:
        session, state = self.desk.session, self.desk.session.study
        refusal = "" if state.busy else session.study_refusal
        open_to_choose, follows = not (refusal or state.busy), self.desk.read_only
        self._open.show(bool(refusal))
        self._start.visible = open_to_choose and not self._finished(state)
        self._start.disabled = follows
        self._start.label = GO_ON if state.done and self._begun(state) else START
        self._stop.visible = state.busy and state.phase != STOPPING
        self._bar.visible = state.busy
        self._bar.value = 100.0 * state.share
        self._choices.visible = open_to_choose
        self._whole.disabled = follows
        self._save.visible = bool(state.sections)
        self._save.disabled = session.run.busy or follows
        self._save.color = "blue" if state.phase == DONE else "gray"
        lead = paragraph(self._sentence(state), "lead")
        self._state.show(paragraph(refusal) if refusal else lead)
        self._said.show(self._about(state, open_to_choose))
        self._results.refresh()

    def _has_work(self) -> bool:
        """Whether opening another scenario would lose something that a person made."""
        session = self.desk.session
        brought = any(spec.file is not None for spec in session.scenario.recordings)
        return brought or session.outcome is not None or bool(session.looks)

    def _begun(self, state: StudyState) -> bool:
        """Whether it is the scenario's own study, whatever has been chosen of it since."""
        settings = state.settings
        return settings is not None and settings.scenario == self.desk.session.scenario

    def _finished(self, state: StudyState) -> bool:
        """Whether nothing of what is chosen is left to do."""
        choice = self.desk.session.study_choice
        asked_for = None if state.settings is None else state.settings.runs
        same = (asked_for, state.parts) == (choice.runs, choice.parts)
        return state.phase == DONE and self._begun(state) and same

    def _sentence(self, state: StudyState) -> str:
        if state.phase == STOPPING:
            return "Stopping: running cases have a few seconds to finish …"
        if state.busy:
            left = state.remaining_seconds
            time = "" if left is None else f", about {_duration(left)} left"
            return f"{state.done} of {state.total} cases{time}."
        if state.phase == FAILED:
            return state.sentence
        if state.total:
            whole = state.done == state.total
            return f"{'Finished' if whole else 'Stopped'}: {state.done} of {state.total} cases."
        return "How far do estimates scatter, and which method is best?"

    def _about(self, state: StudyState, open_to_choose: bool) -> Markup:
        session = self.desk.session
        texts = []
        if state.settings is not None and state.settings.scenario != session.scenario:
            texts.append("The scenario has changed since; these results belong to the earlier one.")
        if self._finished(state):
            texts.append(MORE)
        elif open_to_choose:
            texts.append(_size(session.scenario, session.study_choice))
        return joined(*(paragraph(text, "soft") for text in texts))

    def _choose_part(self, kind: str, on: bool) -> bool:
        session = self.desk.session
        before = session.study_choice.parts
        chosen = tuple(k for k in parts() if (on if k == kind else k in before))
        return session.choose_study(parts=chosen)

    def _choose_whole(self) -> None:
        everything = whole()
        self.desk.session.choose_study(runs=everything.runs, parts=everything.parts)

    def _export(self) -> None:
        def written(folder: Path) -> None:
            settings = self.desk.session.study.settings
            title = settings.scenario.title if settings is not None else ""
            name = f"{safe_name(title).replace(' ', '_') or 'scenario'}_study.zip"
            content = zipped_folder(folder)
            self.desk.client.send_file_download(name, content, save_immediately=True)
            self.desk.session.show_message(f"{name} was sent to your browser.")

        self.desk.session.export_study(self.desk.services, written)


def _duration(seconds: float) -> str:
    return f"{seconds / MINUTE:.0f} min" if seconds > LONG else f"{max(seconds, 1.0):.0f} s"


def _size(scenario: Scenario, choice: StudyChoice) -> str:
    """How many cases, or why there are none."""
    try:
        settings = asked(scenario, choice)
    except InputError as error:
        return str(error)
    cases = len(study_cases(settings, choice.parts))
    ratios = listed([snr(each) for each in settings.snr_db])
    return f"{cases} cases; {choice.runs} runs at {len(settings.points)} working points, {ratios}."
