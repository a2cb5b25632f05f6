"""What could be missing: a row per effect, best first, with a button that adds it; and effects by
hand, from the list or by a formula of one's own."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from markupsafe import Markup

from flexgui.core.effects import catalogue
from flexgui.core.effects.own import states, targets
from flexgui.core.errors import InputError
from flexgui.core.results import ABOVE, NOTHING, RankedEffect
from flexgui.page.panel import PageContext, Piece
from flexgui.page.widgets import Words, button, color, offer, paragraph, react, words_of
from flexgui.sentences.figures import percent
from flexgui.sentences.ranked import ORDER, nesting, round_sentence, tie, worth_listing
from flexgui.sentences.verdict import verdict_paragraphs
from flexgui.sentences.written import format_number
from flexgui.session.edit import model_of
from flexgui.stages.diagnose.effects import present
from flexgui.stages.diagnose.look import Looked
from flexgui.stages.diagnose.plots import glimpse, picture
from flexgui.views.headline import COMPLETE
from flexgui.views.parameter_tables import equation
from flexgui.views.ranking import chance, typeset_sizes
from flexgui.views.summary import doubt
from flexgui.views.table import mathml

WORDS = words_of(
    "diagnose", percent=percent, number=format_number, chance=chance, isfinite=math.isfinite,
    typeset_sizes=typeset_sizes, nesting=nesting, tie=tie, mathml=mathml, equation=equation,
    doubt=doubt, verdict_paragraphs=verdict_paragraphs, round_sentence=round_sentence,
    order=ORDER, complete=COMPLETE,
)  # fmt: skip
SHOW, HIDE = "Show what it does", "Hide what it does"
SHOWN = 6
"""Rows; those below explain next to nothing as a rule and can be added by hand."""


class Candidates:
    """Rows that are made once and then filled."""

    def __init__(self, context: PageContext) -> None:
        self._head = Words(context.gui)
        self._rows = [CandidateRow(context) for _ in range(SHOWN)]
        self._shown: object = None

    def show(self, found: Looked | None, titles: dict[str, str], best: bool, able: bool) -> None:
        """The best of a ranking; `titles` of what each cannot be told from; `best`: whether adding
        the first is the next sensible thing; `able`: whether anything can be added now."""
        self._rows[0].add.color = color(best and found is not None and inviting(found))
        if found is not self._shown:
            self._shown = found
            ranking = worth_listing(found.ranking) if found is not None else []
            diagnosed = None if found is None else found.diagnosis
            over = diagnosed is not None and diagnosed.verdict == NOTHING
            self._head.show(WORDS.head(over) if ranking else "")
            for k, row in enumerate(self._rows):
                row.show(k, ranking[k] if k < len(ranking) else None, found, titles)
        for row in self._rows:
            row.enable(able, row.add)
            row.demonstrate.refresh()


def inviting(found: Looked) -> bool:
    """Whether the first effect may explain something: of a model at its floor no verdict is waited
    for, and what the model's own parameters imitate explains nothing."""
    if any(one.tied_to for one in found.ranking[:1]):
        return False
    if found.diagnosis is not None:
        return found.diagnosis.verdict != NOTHING
    return bool(found.step.cost_per_sample > ABOVE**2)


class CandidateRow(Piece):
    """One effect of the ranking."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self._kind = ""
        self._folder: Any = self.gui.add_folder(None, visible=False)
        with self._folder:
            self._words, self._story = Words(self.gui), Words(self.gui)
            self.add = button(context, "Add", lambda: self.session.diagnosis.add(self._kind))
            self.demonstrate = Demonstrate(context, lambda: self._kind)

    def show(
        self, place: int, one: RankedEffect | None, found: Looked | None, titles: dict[str, str]
    ) -> None:
        """The effect at a place of the ranking, from 0; None hides the row."""
        self._folder.visible = one is not None
        if one is None or found is None:
            return
        self._kind = one.effect
        self._words.show(row_words(place, one, found, titles))
        self._story.show(WORDS.explanation(catalogue().get(one.effect)))
        self.add.label = f"Add {one.title}"


class Demonstrate(Piece):
    """A button that shows what an effect does, and hides it again."""

    def __init__(self, context: PageContext, kind: Callable[[], str]) -> None:
        super().__init__(context)
        self._kind = kind
        self._button = button(context, SHOW, self._pressed)

    def _pressed(self) -> None:
        demonstration, kind = self.session.demonstration, self._kind()
        if demonstration.kind == kind:
            demonstration.end()
        elif kind:
            demonstration.start(kind)

    def refresh(self) -> None:
        """Says what it would do."""
        kind = self._kind()
        self._button.visible = kind in catalogue()
        self._button.label = HIDE if kind and self.session.demonstration.kind == kind else SHOW


def row_words(place: int, one: RankedEffect, found: Looked, titles: dict[str, str]) -> Markup:
    """What stands in a row of the ranking, with a picture of what the effect predicts."""
    seen = None
    if one.predicted:
        seen = glimpse(found.recordings, found.channels, found.dt, found.residual, one.predicted)
    drawn = "" if seen is None else picture(seen)
    return Markup(WORDS.candidate(place, one, found.ranking[0].effect, titles, drawn))


ADDED_NONE = "nothing added"


class ByHand(Piece):
    """Adds and removes any effect, and a formula of one's own."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        gui = self.gui
        with gui.add_folder("Add or remove by hand", expand_by_default=False):
            self._by_title = {e.title: kind for kind, e in sorted(catalogue().items())}
            titles = tuple(sorted(self._by_title))
            self._pick: Any = react(context, gui.add_dropdown("Effect", titles), self._picked)
            self._about = Words(gui, WORDS.explanation(catalogue()[self._by_title[titles[0]]]))
            self._add = button(
                context, "Add this effect", lambda: self.session.diagnosis.add(self._kind())
            )
            self._show = Demonstrate(context, self._kind)
            self._present: Any = gui.add_dropdown("In the model", (ADDED_NONE,))
            self._remove = button(context, "Remove it", self._removed)
        with gui.add_folder("Add an own effect by formula", expand_by_default=False):
            kinds = tuple(targets(model_of(self.session.document.scenario).arm))
            self._target: Any = react(context, gui.add_dropdown("Acts at", kinds), self._show_hint)
            self._formula = gui.add_text("Formula", "-a*tanh(dtheta1/0.001)")
            self._parameters = gui.add_text("Parameters", "a = 0.5 [N m]")
            self._hint = Words(gui)
            self._own = button(context, "Add this formula", self._add_own)
            self._refused = Words(gui)
            self._show_hint()

    def _kind(self) -> str:
        return self._by_title.get(str(self._pick.value), "")

    def _picked(self) -> None:
        self._about.show(WORDS.explanation(catalogue().get(self._kind())))
        self._show.refresh()

    def _show_hint(self) -> None:
        try:
            arm = model_of(self.session.document.scenario).arm
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
        offer(self._present, titles, self._present.value)
        self.enable(able, self._add, self._own)
        self.enable(able and bool(inside), self._remove)
        self._show.refresh()
