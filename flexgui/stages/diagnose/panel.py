"""Fifth stage: what is missing, and a model that grows by it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

from markupsafe import Markup

from flexgui.classroom.panel import ChallengeControls
from flexgui.core.effects import catalogue
from flexgui.core.results import MISSING, Estimate
from flexgui.jobs.job import RUNNING
from flexgui.page import widgets
from flexgui.page.busy import Busy
from flexgui.page.panel import Panel
from flexgui.page.plot import Plot
from flexgui.page.widgets import Words, joined, paragraph
from flexgui.sentences.figures import linear_sentence, times
from flexgui.sentences.ranked import round_sentence
from flexgui.sentences.verdict import verdict_paragraphs
from flexgui.session import Topic
from flexgui.session.edit import model_of
from flexgui.session.tour import holds_way_on
from flexgui.stages.diagnose.effects import own_place, present
from flexgui.stages.diagnose.look import Look, Looked, in_vain, ladder_steps, refitted_only, worse
from flexgui.stages.diagnose.panel_candidates import Candidates, Grown, inviting
from flexgui.stages.diagnose.panel_demonstration import AtWork
from flexgui.stages.diagnose.panel_moment import Moment
from flexgui.stages.diagnose.plots_moment import live_prediction
from flexgui.views.headline import AS_GIVEN, BIASED, COMPLETE
from flexgui.views.ladder import ladder
from flexgui.views.parameter_tables import equation
from flexgui.views.ranking import ranking
from flexgui.views.summary import doubt

FIRST = "A first ranking: {} more sizes of the effects have not been tried yet."
UNTRIED = " Not in it: {}."
BEST = "the first in the list"
AGAINST = (
    "With {} the model fits the recordings worse than without it: they speak against it. Undo the "
    "last step."
)
FIND, ADD, UNDO, GO_ON = "find", "add", "undo", "go on"
BARS = 6
LADDER = 240.0
"""px: ladder and the picture below it are seen together on a usual screen."""
EMPTY = (
    "Press Find what is missing: the error of the model appears here as a ladder above the "
    "noise floor, and below it a ranking of the possible effects, which grows while they are tried."
)
HEADS = {
    "missing": "Something is missing.",
    "nothing_missing": "Nothing is missing.",
    "unlisted": "Something is missing that is not on the list.",
}


class DiagnosePanel(Panel):
    """Verdict and ranked list on the right; ladder, ranking and residual on the left."""

    kind: ClassVar[str] = "Diagnose"
    topics: ClassVar[frozenset[Topic]] = frozenset(
        {
            Topic.SCENARIO,
            Topic.RUN,
            Topic.DIAGNOSIS,
            Topic.DEMONSTRATION,
            Topic.CHALLENGE,
            Topic.RECORDINGS,
            Topic.TOUR,
        }
    )

    def build_controls(self) -> None:
        context, session = self.context, self.context.session
        self._busy = Busy(context, "diagnose", "hide")
        self._refitted: tuple[Looked, Looked] | None = None
        self._find = widgets.button(
            context,
            "Find what is missing",
            lambda: session.diagnosis.search(),
            prominent=True,
        )
        self._verdict = Words(context.gui)
        self._added, self._undo = (
            Words(context.gui),
            widgets.button(context, "Undo the last step", session.diagnosis.undo),
        )
        self._so_far = Words(context.gui)
        self._candidates = Candidates(context)
        self._rest = Words(context.gui)
        self._grown = Grown(context)
        self._challenge = ChallengeControls(context)
        self._next = widgets.button(context, "Next: export", lambda: session.show("Export"))

    def build_plots(self) -> None:
        gui = self.context.gui
        self._at_work = AtWork(self.context)
        self._about = Words(gui)
        self._ladder = Plot(gui, 0.45)
        self._moment = Moment(self.context)
        self._ranking = Plot(gui, 0.54)
        self._of: Any = gui.add_dropdown("Predicted by", (BEST,), visible=False)
        self._of.on_update(lambda _: self._show_residual())
        self._residual = Plot(gui, 0.72)
        self._drawn: object = None
        self._residual_of = ""

    def refresh(self) -> None:
        session = self.context.session
        look = session.diagnosis.look
        found = self._listed(None if look is None else look.found)
        run_is_ours = session.run.state.kind == "diagnose" and session.run.state.phase == RUNNING
        self._busy.refresh(self._sentence)
        self._find.visible = not self._busy.running
        self._find.disabled = session.run.busy or self.context.read_only
        fresh = look is not None and look.diagnosis is not None and not self._old()
        way_on = self._way_on()
        self._find.label = "Repeat diagnosis" if fresh else "Find what is missing"
        self._find.color = _color(way_on == FIND)
        self._verdict.show(self._verdict_text(look))
        self._grown.refresh(not session.run.busy)
        self._show_added()
        self._undo.color = _color(way_on == UNDO)
        self._so_far.show(_so_far(found))
        self._candidates.show(found, self._titles(found), way_on == ADD)
        able = not session.run.busy or (run_is_ours and session.diagnosis.pending is not None)
        self._candidates.enable(able and not self._old())
        self._rest.show(_rest(look))
        self._challenge.refresh()
        self._next.visible = fresh
        self._next.color = _color(way_on == GO_ON)
        self._at_work.refresh()
        self._about.show(paragraph(EMPTY, "soft") if found is None else "")
        self._show_plots(found)

    def _listed(self, found: Looked | None) -> Looked | None:
        """In a challenge only what refits have shown; the same object as long as nothing changes,
        since what is shown already is not drawn again."""
        if found is None or self.context.session.challenge.state is None:
            return found
        if self._refitted is None or self._refitted[0] is not found:
            self._refitted = (found, refitted_only(found))
        return self._refitted[1]

    def _way_on(self) -> str:
        """The one button that invites; the tour's card may hold it instead."""
        look = self.context.session.diagnosis.look
        if holds_way_on(self.context.session) or self._guess_first():
            return ""
        if look is None or look.found is None or not look.ranking or self._old():
            return FIND
        more = inviting(look.found)
        if look.diagnosis is None:
            # Whether an effect was enough that was just added, the whole list has to say.
            return ADD if more and not look.added else FIND
        if in_vain(self.context.session.diagnosis.looks):
            return UNDO
        return ADD if more else GO_ON

    def _guess_first(self) -> bool:
        """Whether a challenge waits for a guess, before which asking the tool is marked."""
        known = self.context.session.challenge.state
        return known is not None and known.revealed is None and not known.guesses

    def _verdict_text(self, look: Look | None) -> Markup:
        """The verdict on the model that is shown; of one that was left none."""
        session = self.context.session
        if session.diagnosis.pending is not None and session.diagnosis.pending is not look:
            return Markup("")
        if (
            session.diagnosis.pending is None
            and look is not None
            and worse(session.diagnosis.looks)
        ):
            text = paragraph(AGAINST.format(session.diagnosis.looks[-1].title))
            return Markup("<div class='verdict unlisted'>{}</div>").format(text)
        return self._linear(look) + _verdict(look)

    def _linear(self, look: Look | None) -> Markup:
        """What the linear model costs, beside the verdict on the first model."""
        cost = self.context.session.diagnosis.linear_model
        first = next(iter(self.context.session.diagnosis.shown_looks), None)
        if cost is None or look is not first:
            return Markup("")
        return paragraph(linear_sentence(cost))

    def _show_added(self) -> None:
        """What is in the model with its sizes, and the way back."""
        session = self.context.session
        titles = ", ".join(title for _, title in present(session.document.scenario))
        looks = session.diagnosis.shown_looks
        text = Markup("In the model: {}.").format(titles)
        content = (
            paragraph(text, "good") + _values(looks, session.diagnosis.first_fit)
            if titles
            else Markup("")
        )
        if len(looks) > 1 and looks[-1].added and looks[-1].added not in catalogue():
            content += paragraph(own_place(looks[-2], looks[-1]))
        self._added.show(content)
        self._undo.visible = len(session.diagnosis.looks) > 1
        self._undo.disabled = session.run.busy or self.context.read_only

    def _sentence(self) -> str:
        session = self.context.session
        if session.diagnosis.look is None:
            count = sum(r.role == "estimate" for r in session.document.scenario.recordings)
            return f"{count} recordings to diagnose. What does the model lack?"
        if self._old():
            return "The settings have changed since; repeat the diagnosis."
        return f"The model's error is {times(session.diagnosis.look.error)} the noise floor."

    def _old(self) -> bool:
        look = self.context.session.diagnosis.look
        return look is not None and look.scenario != self.context.session.document.scenario

    @staticmethod
    def _titles(found: Looked | None) -> dict[str, str]:
        own = {} if found is None else {r.effect: r.title for r in found.ranking}
        return {kind: one.title for kind, one in catalogue().items()} | own

    def _show_plots(self, found: Looked | None) -> None:
        if found is not self._drawn:
            self._drawn = found
            self._ladder.show_whole(
                ladder(ladder_steps(self.context.session.diagnosis.shown_looks)), LADDER
            )
            self._ranking.show_whole(ranking(found.ranking[:BARS]) if found else None, 290)
            pictured = [r.title for r in found.ranking if r.predicted] if found else []
            options = (BEST, *pictured)
            if self._of.options != options:
                self._of.options = options
            self._of.visible = bool(pictured)
        self._moment.refresh()
        self._show_residual()

    def _show_residual(self) -> None:
        look = self.context.session.diagnosis.look
        found = None if look is None else look.found
        if found is None:
            self._residual.show(None)
            return
        name = self.context.session.playback.cursor.recording
        k = found.recordings.index(name) if name in found.recordings else 0
        self._residual_of = found.recordings[k]
        pictured = [r for r in found.ranking if r.predicted]
        one = next((r for r in pictured if r.title == self._of.value), next(iter(pictured), None))
        figure = live_prediction(
            found.channels[k], found.dt[k], found.residual[k],
            None if one is None else one.predicted[k], "" if one is None else one.title,
            f"Residual, {found.recordings[k]} [× noise floor]",
        )  # fmt: skip
        self._residual.show(figure, self._cursor(found))

    def _cursor(self, found: Looked) -> float | None:
        cursor = self.context.session.playback.cursor
        return cursor.time if cursor.recording in found.recordings else None

    def move_cursor(self) -> None:
        look, name = (
            self.context.session.diagnosis.look,
            self.context.session.playback.cursor.recording,
        )
        if look is not None and look.found is not None:
            if name in look.found.recordings and name != self._residual_of:
                self._show_residual()  # its times are of another axis
                self._moment.refresh()
            self._residual.move_cursor(self._cursor(look.found))
        self._moment.move_cursor()


def _values(looks: Sequence[Look], first_fit: Sequence[Estimate]) -> Markup:
    """Of the model as it now stands, by the diagnosis' own fit, and the first fit of it."""
    steps = [look.found.step for look in looks if look.found is not None]
    if not steps:
        return Markup("")
    own = model_of(looks[-1].scenario).effect_parameters
    found = looks[-1].diagnosis
    estimates = steps[-1].parameters if found is None else found.parameters
    standing = sorted(estimates, key=lambda e: e.name not in own)
    doubtful = doubt(looks[-1].error)
    line = Markup("Current model: {}. {}").format(
        _equations(standing), "" if doubtful else COMPLETE
    )
    text = joined(paragraph(line), paragraph(doubtful, "alarm") if doubtful else "")
    first = [e for e in first_fit if e.name not in own and not e.recording]
    if len(steps) == 1 or not first:
        return text
    found = looks[0].diagnosis
    biased = found is not None and found.verdict == MISSING
    heading = f"{BIASED[0].upper()}{BIASED[1:]}" if biased else AS_GIVEN
    before = Markup("{}: {}.").format(heading, _equations(first))
    return joined(text, paragraph(before, "soft"))


def _equations(estimates: Sequence[Estimate]) -> Markup:
    return Markup(", ").join(equation(e) for e in estimates)


def _color(invites: bool) -> str:
    return "blue" if invites else "gray"


def _verdict(look: Look | None) -> Markup:
    """The verdict and its first paragraph; the rest unfolds."""
    if look is None or look.diagnosis is None:
        return Markup("")
    found = look.diagnosis
    first, *more = verdict_paragraphs(found) or ("",)
    doubtful = doubt(look.error)
    body = joined(
        paragraph(HEADS.get(found.verdict, found.verdict), "lead"), paragraph(first),
        paragraph(doubtful, "alarm") if doubtful else "",
    )  # fmt: skip
    if more:
        rest = joined(*(paragraph(text) for text in more))
        body += Markup("<details><summary>Details</summary>{}</details>").format(rest)
    return Markup("<div class='verdict {}'>{}</div>").format(found.verdict, body)


def _so_far(found: Looked | None) -> Markup:
    """What a ranking does not know yet."""
    if found is None or not (found.ranking and found.to_come):
        return Markup("")
    untried = UNTRIED.format(", ".join(found.untried)) if found.untried else ""
    return paragraph(FIRST.format(found.to_come) + untried, "soft")


def _rest(look: Look | None) -> Markup:
    """The experiment that would decide, and what was not tried."""
    if look is None or look.diagnosis is None:
        return Markup("")
    sentences = [text for r in look.diagnosis.rounds if (text := round_sentence(r))]
    known = catalogue()
    skipped = Markup("").join(
        Markup("<li>{}: {}</li>").format(known[kind].title if kind in known else kind, reason)
        for kind, reason in look.diagnosis.not_applicable.items()
    )
    fold = Markup("<details><summary>Not tried</summary><ul>{}</ul></details>").format(skipped)
    return joined(*(paragraph(text) for text in sentences), fold if skipped else "")
