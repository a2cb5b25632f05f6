"""Effects that could be missing, best first, with buttons; effects added by hand or formula."""

from __future__ import annotations

import math
from typing import Any

from markupsafe import Markup

from flexgui.core.effects import catalogue
from flexgui.core.effects.own import states, targets
from flexgui.core.errors import InputError
from flexgui.core.results import ABOVE, NOTHING, UNJUDGED, RankedEffect
from flexgui.page.actions import press
from flexgui.page.panel import PageContext, PageElement
from flexgui.page.widgets import (
    HtmlBlock,
    button,
    on_user_input,
    paragraph,
    set_options,
    stage_macros,
)
from flexgui.sentences.figures import LITTLE, criteria_text, evidence, percent, short_percent
from flexgui.sentences.proposal import carrier_words, event_sentence, proposal_paragraphs
from flexgui.sentences.ranked import explained_share, nesting, round_sentence, tie, worth_listing
from flexgui.sentences.verdict import card_words, verdict_paragraphs
from flexgui.sentences.written import format_number
from flexgui.session.scenario_edits import cached_model
from flexgui.stages.diagnose.effects import present
from flexgui.stages.diagnose.model_versions import ModelFindings
from flexgui.stages.diagnose.plots import glimpse, picture
from flexgui.views import colours
from flexgui.views.headline import COMPLETE
from flexgui.views.names import equation
from flexgui.views.ranking import chance, typeset_sizes
from flexgui.views.summary import DOUBTFUL
from flexgui.views.table import mathml_lines

WORDS = stage_macros(
    "diagnose", percent=percent, short_percent=short_percent, number=format_number, chance=chance,
    isfinite=math.isfinite, typeset_sizes=typeset_sizes, nesting=nesting, tie=tie,
    mathml=mathml_lines, event_sentence=event_sentence,
    equation=equation, verdict_paragraphs=verdict_paragraphs, card_words=card_words, press=press,
    round_sentence=round_sentence, complete=COMPLETE, doubtful=DOUBTFUL, catalogue=catalogue,
    residual=colours.RESIDUAL, added=colours.ADDED, carrier_words=carrier_words,
    proposal_paragraphs=proposal_paragraphs, criteria_text=criteria_text, bic_text=evidence,
)  # fmt: skip


class Candidates(PageElement):
    """The ranked list of effects."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self._words = HtmlBlock(self.gui)
        self._of: ModelFindings | None = None
        self._rows: list[tuple[RankedEffect, Markup | str, str]] = []
        context.actions.register("add effect", self._add)
        context.actions.register("show effect", self._demonstrate)

    def _add(self, kind: str) -> None:
        version = self.session.diagnosis.newest
        if version is not None and any(ranked.effect == kind for ranked in version.ranking):
            self.session.diagnosis.add(kind)

    def _demonstrate(self, kind: str) -> None:
        """Shows or hides what an effect does."""
        demonstration = self.session.demonstration
        if demonstration.kind == kind:
            demonstration.end()
        elif kind in catalogue():
            demonstration.start(kind)

    def show(self, findings: ModelFindings | None, titles: dict[str, str], able: bool) -> None:
        """Show the best of a ranking.

        `titles`: of what each cannot be distinguished from; `able`: whether anything can be added
        now.
        """
        if findings is None:
            self._words.show()
            return
        over = findings.diagnosis is not None and findings.diagnosis.verdict == NOTHING
        listed = () if over else worth_listing(findings.ranking)
        worth = [ranked for ranked in listed if explained_share(ranked) >= LITTLE]
        if findings is not self._of:  # pictures take longer than words
            self._of, self._rows = findings, [with_picture(ranked, findings) for ranked in worth]
        small = [ranked for ranked in findings.ranking if ranked not in worth]
        self._words.show(
            WORDS.candidates(
                self._rows, small, over, titles, able, self.session.demonstration.kind,
            )
        )  # fmt: skip


Pictured = tuple[RankedEffect, Markup | str, str]


def with_picture(ranked: RankedEffect, findings: ModelFindings) -> Pictured:
    """An effect of the ranking with a picture of its prediction and a caption."""
    seen = None
    if ranked.predicted:
        residual = findings.residual
        seen = glimpse(
            findings.recordings, findings.channels, findings.dt, residual, ranked.predicted
        )
    return (ranked, "", "") if seen is None else (ranked, picture(seen), seen.caption)


def may_explain(findings: ModelFindings) -> bool:
    """Whether adding the first effect is sensible: error above the floor, effect identifiable."""
    if any(ranked.tied_to for ranked in findings.ranking[:1]):
        return False
    if findings.diagnosis is not None:
        found = findings.diagnosis
        return found.unfinished or found.verdict not in (NOTHING, UNJUDGED)
    return bool(findings.step.cost_per_sample > ABOVE**2)


ADDED_NONE = "nothing added"


class ByHand(PageElement):
    """Adds and removes any effect, and a formula of one's own."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        gui = self.gui
        with gui.add_folder("Add or remove by hand", expand_by_default=False):
            self._by_title = {e.title: kind for kind, e in sorted(catalogue().items())}
            titles = tuple(sorted(self._by_title))
            self._pick: Any = on_user_input(
                context, gui.add_dropdown("Effect", titles), self._picked
            )
            self._about = HtmlBlock(gui)
            self._add = button(
                context, "Add this effect", lambda: self.session.diagnosis.add(self._kind())
            )
            self._present: Any = gui.add_dropdown("In the model", (ADDED_NONE,))
            self._remove = button(context, "Remove it", self._removed)
        with gui.add_folder("Add your own effect as a formula", expand_by_default=False):
            kinds = tuple(targets(cached_model(self.session.document.scenario).arm))
            self._target: Any = on_user_input(
                context, gui.add_dropdown("Acts at", kinds), self._show_hint
            )
            self._formula = gui.add_text("Formula", "-a*tanh(dtheta1/0.001)")
            self._parameters = gui.add_text("Parameters", "a = 0.5 [N m]")
            self._hint = HtmlBlock(gui)
            self._own = button(context, "Add this formula", self._add_own)
            self._refused = HtmlBlock(gui)
            self._show_hint()

    def _kind(self) -> str:
        return self._by_title.get(str(self._pick.value), "")

    def _picked(self) -> None:
        kind = self._kind()
        shown = WORDS.show_it(kind, self.session.demonstration.kind)
        self._about.show(WORDS.explanation(catalogue().get(kind)), shown)

    def _show_hint(self) -> None:
        try:
            arm = cached_model(self.session.document.scenario).arm
            words = states(arm, str(self._target.value))
        except (InputError, KeyError):
            return
        self._hint.show(WORDS.own_formula(words))

    def _add_own(self) -> None:
        texts = (str(self._target.value), str(self._formula.value), str(self._parameters.value))
        done = self.session.diagnosis.add_own(*texts)
        # The newest message stands on top, which may be out of sight from here.
        self._refused.show(paragraph("" if done else self.session.message.text, "bad"))

    def _removed(self) -> None:
        inside = {title: kind for kind, title in reversed(present(self.session.document.scenario))}
        if kind := inside.get(str(self._present.value)):
            self.session.diagnosis.remove(kind)

    def refresh(self, able: bool) -> None:
        """Shows what is in the model."""
        inside = present(self.session.document.scenario)
        titles = tuple(dict.fromkeys(title for _, title in inside)) or (ADDED_NONE,)
        set_options(self._present, titles, self._present.value)
        self.enable(able, self._add, self._own)
        self.enable(able and bool(inside), self._remove)
        self._picked()
