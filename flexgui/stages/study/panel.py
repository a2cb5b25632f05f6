"""Last stage: the identification many times over, as in the paper, beside other methods."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

from markupsafe import Markup

from flexgui.core.errors import InputError
from flexgui.core.montecarlo.study import Part, parts, study_cases
from flexgui.core.scenario.schema import Scenario
from flexgui.core.sentences import listed
from flexgui.page import widgets
from flexgui.page.panel import PageContext, Panel
from flexgui.page.plot import Plot
from flexgui.page.widgets import Words, joined, paragraph
from flexgui.session import Topic
from flexgui.session.demo import DEMO
from flexgui.stages.data.uploads import safe_name, zipped_folder
from flexgui.stages.study.baselines import snr
from flexgui.stages.study.state import (
    DONE,
    FAILED,
    MOST_AT_ONCE,
    MOST_RUNS,
    STOPPING,
    ShownSection,
    StudyChoice,
    StudyState,
    asked,
    whole,
)

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
        context, session = self.context, self.context.session
        self._results = StudyResults(context)
        self._state = Words(context.gui)
        self._bar: Any = context.gui.add_progress_bar(0.0, visible=False, animated=True)
        self._start = widgets.button(context, START, lambda: session.study.start(), prominent=True)
        self._stop = widgets.button(context, "Stop", session.study.stop)
        self._open = Confirm(
            context, OPEN, REPLACES, lambda: session.choose(DEMO), self._has_work,
            "Replace my work", "Keep my work",
        )  # fmt: skip
        self._results.build_choice()
        self._save = widgets.button(
            context, "Save the results (zip)", self._export,
            hint="A page with all figures, tables as CSV, result.json, and what "
            "`flexgui study` needs to continue from here.",
        )  # fmt: skip
        self._settings()
        self._lead = Words(context.gui)

    def _settings(self) -> None:
        context, session = self.context, self.context.session
        self._choices = context.gui.add_folder("Extent")
        with self._choices:
            widgets.number(
                context, "Runs", lambda: session.study.choice.runs,
                lambda v: session.study.choose(runs=int(v)), 1, MOST_RUNS, 1,
                "Each with fresh noise and a fresh first population; the paper has 20.",
            )  # fmt: skip
            for part in parts().values():
                self._switch(part)
            widgets.number(
                context, "Parallel cases", lambda: session.study.choice.at_once,
                lambda v: session.study.choose(at_once=int(v)), 1, MOST_AT_ONCE, 1,
                "Cases that run at the same time; other users of this server run in between.",
            )  # fmt: skip
            self._whole = widgets.button(context, "All of it, as in the paper", self._choose_whole)

    def _switch(self, part: Part) -> None:
        session, kind = self.context.session, part.kind
        widgets.switch(
            self.context, part.title, lambda: kind in session.study.choice.parts,
            lambda on: self._choose_part(kind, on), inspect.getdoc(type(part)) or "",
        )  # fmt: skip

    def build_plots(self) -> None:
        self._results.build_plots()

    def refresh(self) -> None:
        session, state = self.context.session, self.context.session.study.state
        refusal = "" if state.busy else session.study.refusal
        open_to_choose, follows = not (refusal or state.busy), self.context.read_only
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
        self._lead.show(self._about(state, open_to_choose))
        self._results.refresh()

    def _has_work(self) -> bool:
        """Whether opening another scenario would lose something that a person made."""
        session = self.context.session
        brought = any(spec.file is not None for spec in session.document.scenario.recordings)
        return (
            brought or session.identification.outcome is not None or bool(session.diagnosis.looks)
        )

    def _begun(self, state: StudyState) -> bool:
        """Whether it is the scenario's own study, whatever has been chosen of it since."""
        settings = state.settings
        return settings is not None and settings.scenario == self.context.session.document.scenario

    def _finished(self, state: StudyState) -> bool:
        """Whether nothing of what is chosen is left to do."""
        choice = self.context.session.study.choice
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
        session = self.context.session
        texts = []
        if state.settings is not None and state.settings.scenario != session.document.scenario:
            texts.append("The scenario has changed since; these results belong to the earlier one.")
        if self._finished(state):
            texts.append(MORE)
        elif open_to_choose:
            texts.append(_size(session.document.scenario, session.study.choice))
        return joined(*(paragraph(text, "soft") for text in texts))

    def _choose_part(self, kind: str, on: bool) -> bool:
        session = self.context.session
        before = session.study.choice.parts
        chosen = tuple(k for k in parts() if (on if k == kind else k in before))
        return session.study.choose(parts=chosen)

    def _choose_whole(self) -> None:
        everything = whole()
        self.context.session.study.choose(runs=everything.runs, parts=everything.parts)

    def _export(self) -> None:
        def written(folder: Path) -> None:
            settings = self.context.session.study.state.settings
            title = settings.scenario.title if settings is not None else ""
            name = f"{safe_name(title).replace(' ', '_') or 'scenario'}_study.zip"
            content = zipped_folder(folder)
            self.context.client.send_file_download(name, content, save_immediately=True)
            self.context.session.show_message(f"{name} was sent to your browser.")

        self.context.session.study.export(written)


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


class Confirm:
    """A button that acts at once where there is nothing to lose, and else asks first."""

    def __init__(
        self, context: PageContext, label: str, question: str, action: Callable[[], object],
        loses: Callable[[], bool], yes: str, no: str,
    ) -> None:  # fmt: skip
        self._action, self._loses, self._question = action, loses, question
        self._words = Words(context.gui)
        self._begin: Any = widgets.button(context, label, self._pressed, prominent=True)
        self._yes: Any = widgets.button(context, yes, self._confirmed, prominent=True)
        self._no: Any = widgets.button(context, no, self._left)
        self._asking, self._shown = False, True
        self.show(True)

    def show(self, visible: bool) -> None:
        """The button or its question; nothing."""
        self._shown = visible
        self._asking = self._asking and visible
        self._words.show(paragraph(self._question, "bad") if self._asking else "")
        self._begin.visible = visible and not self._asking
        self._yes.visible = self._no.visible = visible and self._asking

    def _pressed(self) -> None:
        if self._loses():
            self._asking = True
            self.show(self._shown)
        else:
            self._action()

    def _confirmed(self) -> None:
        self._left()
        self._action()

    def _left(self) -> None:
        self._asking = False
        self.show(self._shown)


NONE = "no results yet"
MOST_FIGURES = 2
"""Of one section."""

EMPTY = (
    "The study repeats the identification with fresh noise, as the paper does for its Tables I and "
    "II, and shows how far the estimates scatter, beside the printed figures. Further parts "
    "validate on sweeps, compare with other methods on the same data, and say which experiments "
    "would give more information. Tables and figures stand here as soon as the first results come."
)


class StudyResults:
    """A choice on the right; on the left what was chosen, which grows while the study runs."""

    def __init__(self, context: PageContext) -> None:
        self._context = context
        self._chosen = ""
        self._drawn: ShownSection | None = None

    def build_choice(self) -> None:
        """Add the choice of a section."""
        self._choice = widgets.choice(
            self._context, "Show", (NONE,), lambda: self._chosen or NONE, self._choose
        )

    def build_plots(self) -> None:
        """Add the figures and tables of a section."""
        gui = self._context.gui
        self._title = Words(gui)
        self._figures = [(Plot(gui, 0.6), Words(gui)) for _ in range(MOST_FIGURES)]
        self._words = Words(gui)

    def refresh(self) -> None:
        """Draws the chosen section where it has changed."""
        sections = {s.title: s for s in self._context.session.study.state.sections}
        options = tuple(sections) or (NONE,)
        if self._chosen not in options:
            self._chosen = options[0]
        self._choice.visible = bool(sections)
        if self._choice.options != options:
            self._choice.options = options
        if self._choice.value != self._chosen:
            self._choice.value = self._chosen
        section = sections.get(self._chosen)
        if section is None:
            self._clear()
        elif section is not self._drawn:
            self._draw(section)
        self._drawn = section

    def _choose(self, title: str) -> bool:
        self._chosen = title
        self.refresh()
        return True

    def _clear(self) -> None:
        self._title.show(paragraph(EMPTY, "soft"))
        self._words.show("")
        for plot, caption in self._figures:
            plot.show(None)
            caption.show("")

    def _draw(self, section: ShownSection) -> None:
        self._title.show(paragraph(section.title, "lead"))
        self._words.show(section.words)
        figures = [*section.figures, *[None] * MOST_FIGURES]
        for (plot, caption), shown in zip(self._figures, figures, strict=False):
            if shown is None:
                plot.show(None)
                caption.show("")
            else:
                plot.show(shown.figure, height=shown.height)
                caption.show(paragraph(shown.caption, "soft"))
