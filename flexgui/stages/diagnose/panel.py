"""Fifth stage: find missing effects and add them to the model."""

from __future__ import annotations

from typing import Any

from markupsafe import Markup

from flexgui.core.effects import catalogue
from flexgui.core.results import NOTHING, RankedEffect
from flexgui.core.sentences import listed
from flexgui.jobs.job import RUNNING
from flexgui.page.actions import press
from flexgui.page.earlier_work import DIAGNOSIS, other_settings
from flexgui.page.job_status import JobStatus
from flexgui.page.panel import PageContext, PageElement, Panel
from flexgui.page.plot import Plot
from flexgui.page.widgets import HtmlBlock, button, color, on_user_input, paragraph, set_options
from flexgui.sentences.figures import linear_sentence
from flexgui.session.scenario_edits import cached_model
from flexgui.session.state import Topic
from flexgui.session.tour import card_has_button
from flexgui.stages.diagnose.effects import own_place, present
from flexgui.stages.diagnose.fitted_models import step_like
from flexgui.stages.diagnose.model_versions import (
    ModelFindings,
    ModelVersion,
    error_rose,
    error_stayed,
    ladder_steps,
    proposed_events,
    restated,
)
from flexgui.stages.diagnose.panel_candidate_figure import CandidateFigure
from flexgui.stages.diagnose.panel_candidates import WORDS, ByHand, Candidates, may_explain
from flexgui.stages.diagnose.panel_laws import LawFigure, ProposedLaws
from flexgui.stages.diagnose.panel_models import ModelTable
from flexgui.stages.diagnose.panel_rig import KnownRig
from flexgui.stages.diagnose.plots import (
    ROW_HEIGHT,
    demonstration,
    demonstration_summary,
    live_prediction,
)
from flexgui.views.ladder import ladder
from flexgui.views.missing_torque import missing_cloud
from flexgui.views.parameter_tables import changes, parameter_changes
from flexgui.views.table import html_table

BEST = "first in the list"
FIND, ADD, ADD_LAW, UNDO, GO_ON = "find", "add", "add law", "undo", "go on"


class DiagnosePanel(Panel):
    """Verdict, model and candidates on the right; ladder, torque and residual on the left."""

    kind = "Diagnose"
    topics = frozenset({
        Topic.SCENARIO, Topic.RUN, Topic.DIAGNOSIS, Topic.DEMONSTRATION, Topic.CHALLENGE,
        Topic.RECORDINGS, Topic.TOUR,
    })  # fmt: skip

    @property
    def done(self) -> bool:
        version = self.session.diagnosis.newest
        return version is not None and version.diagnosis is not None and not self._old(version)

    def build_controls(self) -> None:
        context, session, gui = self.context, self.session, self.gui
        self._busy = JobStatus(context, "diagnose", "hide")
        self._made = HtmlBlock(gui)
        self._find = button(
            context, "Find what is missing", session.diagnosis.search, prominent=True
        )
        self._verdict, self._model = HtmlBlock(gui), HtmlBlock(gui)
        context.actions.register("repeat diagnosis", lambda _: session.diagnosis.search())
        context.actions.register("undo step", lambda _: session.diagnosis.undo())
        self._laws = ProposedLaws(context)
        self._models = ModelTable(context)
        self._so_far = HtmlBlock(gui)
        KnownRig(context)
        self._candidates = Candidates(context)
        self._by_hand = ByHand(context)

    def build_plots(self) -> None:
        context, gui = self.context, self.gui
        self._at_work = DemonstrationView(context)
        self._about = HtmlBlock(gui)
        self._ladder = Plot(context, 0.45, wide=True)
        self._restated = HtmlBlock(gui)
        self._law_figure = LawFigure(context)
        self._candidate_figure = CandidateFigure(context)
        self._residual = Plot(context, 0.72)
        of = gui.add_dropdown("Predicted by", (BEST,), visible=False)
        self._of: Any = on_user_input(context, of, self._show_residual)
        self._drawn: object = None
        self._steps: list[object] = []
        self._residual_of = ""

    def refresh(self) -> None:
        session, version = self.session, self.session.diagnosis.newest
        findings = None if version is None else version.found
        free, old, way_on = not session.run.busy, self._old(version), self._next_step(version)
        titles = _titles(findings)
        self._busy.refresh(self._sentence(version))
        made = other_settings(session, DIAGNOSIS) if session.diagnosis.pending is None else ""
        self._made.show(made)
        self._find.visible = not self._busy.running and not self.done
        self.enable(free, self._find)
        self._find.color = color(way_on == FIND)
        self._verdict.show(self._verdict_words(version, titles, free, way_on))
        self._model.show(self._model_words(free, way_on))
        self._by_hand.refresh(free)
        self._models.refresh(free)
        self._so_far.show(WORDS.so_far(findings))
        run = session.run.state
        streams = run.kind == "diagnose" and run.phase == RUNNING
        able = free or (streams and session.diagnosis.pending is not None)
        self._laws.show(None if old else version, able, way_on == ADD_LAW)
        self._candidates.show(findings, titles, able and not self._is_of_another_model(version))
        self._at_work.refresh()
        self._about.show(WORDS.nothing_yet() if findings is None else made)
        self._show_plots(findings)

    def _next_step(self, version: ModelVersion | None) -> str:
        """The next button to highlight; empty if the tour's card has it."""
        if card_has_button(self.session):
            return ""
        if version is None or version.found is None or not version.ranking or self._old(version):
            return FIND
        if self.session.diagnosis.laws or proposed_events(version):
            return ADD_LAW
        more = may_explain(version.found)
        if version.diagnosis is None:
            # Whether an effect was enough that was just added, the whole list has to say.
            return ADD if more and not version.added else FIND
        if error_stayed(self.session.diagnosis.versions):
            return UNDO
        return ADD if more else GO_ON

    def _verdict_words(
        self, version: ModelVersion | None, titles: dict[str, str], free: bool, way_on: str
    ) -> Markup:
        """The verdict on the shown model; empty for an earlier one."""
        diagnosis = self.session.diagnosis
        if version is None or (diagnosis.pending is not None and diagnosis.pending is not version):
            return Markup("")
        if len(diagnosis.compared_versions) < len(diagnosis.shown_versions):
            return Markup("")  # its figures come with its bar
        if self._old(version) and diagnosis.pending is None:
            return Markup(WORDS.past_verdict(version.diagnosis, version.error))
        against = diagnosis.pending is None and error_rose(diagnosis.versions)
        # What the linear model costs belongs to the verdict on the first model.
        cost = diagnosis.linear_model if version is diagnosis.shown_versions[0] else None
        return Markup(
            WORDS.verdict(
                version.diagnosis, version.error, diagnosis.versions[-1].title if against else "",
                "" if cost is None else linear_sentence(cost), titles,
                self._way_on(version, way_on, free), self.done, free,
            )
        )  # fmt: skip

    def _way_on(self, version: ModelVersion, way_on: str, free: bool) -> Markup:
        """The card's button: the next sensible step."""
        if way_on == ADD and version.ranking:
            first = version.ranking[0]
            return press(f"Add {first.title}", "add effect", first.effect, "main", able=free)
        if way_on == UNDO:
            return press("Undo the last step", "undo step", kind="main", able=free)
        kind = "main" if way_on == GO_ON else ""
        return press("Next: export", "stage", "Export", kind)

    def _model_words(self, free: bool, way_on: str) -> Markup:
        """Effects of the model with its parameters, beside those of the model as given."""
        diagnosis = self.session.diagnosis
        versions = diagnosis.shown_versions
        titles = [title for _, title in present(self.session.document.scenario)]
        undo = len(diagnosis.versions) > 1 and way_on != UNDO  # then the card above has it
        steps = [version.found.step for version in versions if version.found is not None]
        pending = diagnosis.pending
        waits = pending is not None and bool(pending.title) and not pending.comparisons
        if not steps or waits:
            return Markup(WORDS.model(titles, (), 0.0, "", "", undo, free))
        last, own = versions[-1], cached_model(versions[-1].scenario).effect_parameters
        estimates = steps[-1].parameters if last.diagnosis is None else last.diagnosis.parameters
        standing = sorted(estimates, key=lambda e: e.name not in own)
        table = parameter_changes(changes(steps, estimates), listed(titles) or last.title)
        typed = len(versions) > 1 and last.added in diagnosis.formulas  # no proposed law
        place = own_place(versions[-2], last) if typed else ""
        changed = "" if table is None else html_table(table)
        return Markup(WORDS.model(titles, standing, last.error, changed, place, undo, free))

    def _sentence(self, version: ModelVersion | None) -> str:
        if version is None:
            recordings = self.session.document.scenario.recordings
            count = sum(r.role == "estimate" for r in recordings)
            return f"{count} recordings to diagnose. What does the model lack?"
        return ""

    def _old(self, version: ModelVersion | None) -> bool:
        return version is not None and version.scenario != self.session.document.scenario

    def _is_of_another_model(self, version: ModelVersion | None) -> bool:
        """Whether more has changed since than what is stated of the rig: an effect of the list can
        be added whatever is known of the others."""
        now = self.session.document.scenario
        return version is not None and version.scenario.model_copy(update={"rig": now.rig}) != now

    def _show_plots(self, findings: ModelFindings | None) -> None:
        self._show_ladder()
        if findings is not self._drawn:
            self._drawn = findings
            pictured = [r.title for r in _predicting(findings)]
            set_options(self._of, (BEST, *pictured), self._of.value)
            self._of.visible = bool(pictured)
        self._law_figure.refresh()
        self._candidate_figure.refresh()
        self._show_residual()

    def _show_ladder(self) -> None:
        """The way to the present model, and the model beside it."""
        diagnosis = self.session.diagnosis
        versions, beside = diagnosis.compared_versions, diagnosis.models.beside
        expected = diagnosis.expected
        drawn: list[object] = [*(each.found for each in versions), beside, expected and expected[0]]
        if [id(each) for each in drawn] == [id(each) for each in self._steps]:
            return
        self._steps = drawn
        other = None
        if beside is not None and beside.version.found is not None:
            step = step_like(beside.version.found.step, versions[-1] if versions else None)
            other = (beside.title, step)
        self._ladder.show_whole(ladder(ladder_steps(versions), other, expected))
        self._restated.show(paragraph(restated(versions), "soft"))

    def _show_residual(self) -> None:
        version = self.session.diagnosis.newest
        findings = None if version is None else version.found
        pictured = _predicting(findings)
        name = self.session.playback.cursor.recording
        self._residual_of = name
        if findings is None or not pictured:
            self._residual.show(None)
            return
        k = findings.recordings.index(name) if name in findings.recordings else 0
        # The first in the list may have none; that of another one would be taken for its own.
        first = findings.ranking[0] if findings.ranking[0] in pictured else None
        chosen = next((r for r in pictured if r.title == self._of.value), first)
        figure = live_prediction(
            findings.channels[k], findings.dt[k], findings.residual[k],
            None if chosen is None else chosen.predicted[k], "" if chosen is None else chosen.title,
            f"Residual, {findings.recordings[k]} [× noise floor]",
        )  # fmt: skip
        height = ROW_HEIGHT * (1.0 + len(findings.channels[k]))
        self._residual.show(figure, self._begins(findings), height)

    def _begins(self, findings: ModelFindings) -> float | None:
        """The residual's axis begins with the recording; None where that was not fitted."""
        return 0.0 if self.session.playback.cursor.recording in findings.recordings else None

    def move_cursor(self) -> None:
        version, name = self.session.diagnosis.newest, self.session.playback.cursor.recording
        if version is not None and version.found is not None:
            if name in version.found.recordings and name != self._residual_of:
                self._show_residual()  # its times are of another axis
                self._candidate_figure.refresh()
            self._residual.move_cursor(self._begins(version.found))
        self._candidate_figure.move_cursor()


def _predicting(findings: ModelFindings | None) -> list[RankedEffect]:
    """Effects whose prediction can be drawn; none if nothing is missing."""
    diagnosis = None if findings is None else findings.diagnosis
    if findings is None or (diagnosis is not None and diagnosis.verdict == NOTHING):
        return []
    return [ranked for ranked in findings.ranking if ranked.predicted]


def _titles(findings: ModelFindings | None) -> dict[str, str]:
    own = {} if findings is None else {r.effect: r.title for r in findings.ranking}
    return {kind: effect.title for kind, effect in catalogue().items()} | own


class DemonstrationView(PageElement):
    """The demonstration of an effect: formula, outputs, torque and progress."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self._words, self._plot = HtmlBlock(self.gui), Plot(context, 0.56)
        self._below = HtmlBlock(self.gui)
        self._about, self._cloud = HtmlBlock(self.gui), Plot(context, 0.75)
        self._drawn: object = None
        self._torques: object = None

    def refresh(self) -> None:
        """Shows the demonstration, or why there is none."""
        state = self.session.demonstration
        shown, why = state.shown if state.kind else None, state.not_shown
        effect = catalogue().get(state.kind)
        words = WORDS.at_work(effect, why) if shown is None else WORDS.named(effect)
        self._words.show(words if state.kind else "")
        self._below.show(paragraph("" if shown is None else demonstration_summary(shown), "soft"))
        if shown is not self._drawn:
            self._drawn = shown
            self._plot.show(None if shown is None else demonstration(shown))
        # Only where a diagnosis knows what is missing and the effect has a law to put into it.
        torques = state.torques
        if shown is None or not torques:
            self._torques = None
            self._about.show()
            self._cloud.show(None)
        elif self._torques != (id(shown), id(torques)):
            self._torques = (id(shown), id(torques))
            self._about.show(WORDS.torque(shown.recording))
            self._cloud.show(missing_cloud(torques, shown.torques, shown.title))
