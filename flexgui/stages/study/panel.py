"""Last stage: the identification many times over, as in the paper, beside other methods."""

from __future__ import annotations

import inspect
from functools import partial
from pathlib import Path
from typing import Any

from flexgui.core.errors import InputError
from flexgui.core.montecarlo.study import parts, study_cases
from flexgui.core.scenario.schema import Scenario
from flexgui.core.sentences import listed
from flexgui.library.shipped import DEMO
from flexgui.page.panel import PageContext, PageElement, Panel
from flexgui.page.plot import Plot
from flexgui.page.widgets import (
    HtmlBlock,
    button,
    choice,
    color,
    number,
    paragraph,
    set_options,
    stage_macros,
    switch,
)
from flexgui.session.state import Topic
from flexgui.stages.data.uploads import safe_name, zipped_folder
from flexgui.stages.study.plots_estimates import snr
from flexgui.stages.study.state import (
    DONE,
    MOST_AT_ONCE,
    MOST_RUNS,
    PAPER,
    STOPPING,
    ShownSection,
    StudyChoice,
    StudyState,
    asked,
)

WORDS = stage_macros("study")
START_LABEL, GO_ON_LABEL = "Start the study", "Go on with the study"

OPEN = "Open the paper's arm and experiments"
SAVED = (
    "All figures as a page, tables as CSV, result.json, and the files to continue with `flexgui "
    "study`."
)


class StudyPanel(Panel):
    """How much of it and how it stands on the right; tables and figures, as they come, left."""

    kind = "Study"
    topics = frozenset({Topic.STUDY, Topic.SCENARIO, Topic.RUN})

    def build_controls(self) -> None:
        context, session = self.context, self.session
        self._results = StudyResults(context)
        self._state = HtmlBlock(self.gui)
        self._bar: Any = self.gui.add_progress_bar(0.0, visible=False, animated=True)
        self._start = button(context, START_LABEL, session.study.start, prominent=True)
        self._stop = button(context, "Stop", session.study.stop)
        self._open = Opening(context)
        self._results.build_choice()
        self._save = button(
            context, "Save the results (zip)", lambda: session.study.export(self._written),
            hint=SAVED,
        )  # fmt: skip
        self._choices = self.gui.add_folder("Extent")
        with self._choices:
            self._settings()
        self._lead = HtmlBlock(self.gui)

    def _settings(self) -> None:
        context, study = self.context, self.session.study
        number(
            context, "Runs", (1, MOST_RUNS, 1), lambda: study.choice.runs,
            lambda v: study.choose(runs=v),
            "Each with new noise and a new first population; the paper has 20.",
        )  # fmt: skip
        for part in parts().values():
            switch(
                context, part.title, partial(self._has_part, part.kind),
                partial(self._choose_part, part.kind), inspect.getdoc(type(part)) or "",
            )  # fmt: skip
        number(
            context, "Parallel cases", (1, MOST_AT_ONCE, 1), lambda: study.choice.at_once,
            lambda v: study.choose(at_once=v),
            "Cases computed at the same time. Other users of this server share the processors.",
        )  # fmt: skip
        button(
            context, "Full study, as in the paper",
            lambda: study.choose(runs=PAPER, parts=tuple(parts())),
        )  # fmt: skip

    def build_plots(self) -> None:
        self._results.build_plots()

    def refresh(self) -> None:
        session, state = self.session, self.session.study.state
        refusal = "" if state.busy else session.study.refusal
        to_choose = not (refusal or state.busy)
        self._open.show(bool(refusal))
        self._start.visible = to_choose and not self._finished(state)
        self._start.label = GO_ON_LABEL if state.done and self._begun(state) else START_LABEL
        self._stop.visible = state.busy and state.phase != STOPPING
        self._bar.visible = state.busy
        self._bar.value = 100.0 * state.share
        self._choices.visible = to_choose
        self._save.visible = bool(state.sections)
        self.enable(not session.run.busy, self._save)
        self._save.color = color(state.phase == DONE)
        self._state.show(paragraph(refusal) or WORDS.state(state))
        earlier = state.settings is not None and not self._begun(state)
        size = size_text(session.document.scenario, session.study.choice) if to_choose else ""
        self._lead.show(WORDS.extent(earlier, self._finished(state), size))
        self._results.refresh()

    def _begun(self, state: StudyState) -> bool:
        """Whether it is the scenario's own study, whatever has been chosen of it since."""
        settings = state.settings
        return settings is not None and settings.scenario == self.session.document.scenario

    def _finished(self, state: StudyState) -> bool:
        """Whether nothing of what is chosen is left to do."""
        choice = self.session.study.choice
        asked_for = None if state.settings is None else state.settings.runs
        same = (asked_for, state.parts) == (choice.runs, choice.parts)
        return state.phase == DONE and self._begun(state) and same

    def _has_part(self, kind: str) -> bool:
        return kind in self.session.study.choice.parts

    def _choose_part(self, kind: str, on: bool) -> bool:
        chosen = tuple(k for k in parts() if (on if k == kind else self._has_part(k)))
        return self.session.study.choose(parts=chosen)

    def _written(self, folder: Path) -> None:
        settings = self.session.study.state.settings
        title = settings.scenario.title if settings is not None else ""
        name = f"{safe_name(title).replace(' ', '_')}_study.zip"
        self.send(name, zipped_folder(folder))


def size_text(scenario: Scenario, choice: StudyChoice) -> str:
    """How many cases, or why there are none."""
    try:
        settings = asked(scenario, choice)
    except InputError as error:
        return str(error)
    cases = len(study_cases(settings, choice.parts))
    ratios = listed([snr(each) for each in settings.snr_db])
    return f"{cases} cases; {choice.runs} runs at {len(settings.points)} working points, {ratios}."


class Opening(PageElement):
    """Opens the paper's scenario: at once where there is nothing to lose, and else it asks."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self._question = HtmlBlock(self.gui)
        self._open: Any = button(context, OPEN, self._pressed, prominent=True)
        self._yes: Any = button(context, "Replace my work", self._replace, prominent=True)
        self._no: Any = button(context, "Keep my work", partial(self._ask, False))
        self._asking, self._shown = False, True
        self.show(True)

    def show(self, visible: bool) -> None:
        """The button or its question; nothing."""
        self._shown = visible
        self._ask(self._asking and visible)

    def _ask(self, asking: bool) -> None:
        self._asking = asking
        self._question.show(WORDS.replaces() if asking else "")
        self._open.visible = self._shown and not asking
        self._yes.visible = self._no.visible = asking

    def _pressed(self) -> None:
        session = self.session
        brought = any(spec.file is not None for spec in session.document.scenario.recordings)
        if brought or session.identification.outcome is not None or session.diagnosis.versions:
            self._ask(True)
        else:
            self._replace()

    def _replace(self) -> None:
        self._ask(False)
        self.session.choose(DEMO)


NONE = "no results yet"
MOST_FIGURES = 2
"""Of one section."""


class StudyResults(PageElement):
    """A choice on the right; on the left what was chosen, which grows while the study runs."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self._chosen = ""
        self._drawn: object = NONE

    def build_choice(self) -> None:
        """Add the choice of a section."""
        self._choice = choice(
            self.context, "Show", (NONE,), lambda: self._chosen or NONE, self._choose
        )

    def build_plots(self) -> None:
        """Add the figures and tables of a section."""
        self._title = HtmlBlock(self.gui)
        self._figures = [
            (Plot(self.context, 0.6), HtmlBlock(self.gui)) for _ in range(MOST_FIGURES)
        ]
        self._words = HtmlBlock(self.gui)

    def refresh(self) -> None:
        """Draws the chosen section where it has changed."""
        sections = {s.title: s for s in self.session.study.state.sections}
        set_options(self._choice, tuple(sections) or (NONE,), self._chosen)
        self._chosen = self._choice.value
        self._choice.visible = bool(sections)
        section = sections.get(self._chosen)
        if section is not self._drawn:
            self._draw(section)
        self._drawn = section

    def _choose(self, title: str) -> None:
        self._chosen = title
        self.refresh()

    def _draw(self, section: ShownSection | None) -> None:
        if section is None:
            self._title.show(WORDS.nothing_yet())
            self._words.show()
        else:
            self._title.show(paragraph(section.title, "lead"))
            self._words.show(section.words)
        figures = [*([] if section is None else section.figures), *[None] * MOST_FIGURES]
        for (plot, caption), shown in zip(self._figures, figures, strict=False):
            plot.show_whole(shown)
            caption.show(paragraph(shown["layout"]["meta"]["caption"] if shown else "", "soft"))
