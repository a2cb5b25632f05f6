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
from flexgui.page import widgets
from flexgui.page.panel import PageContext
from flexgui.page.widgets import Words, joined, paragraph
from flexgui.sentences.figures import percent
from flexgui.sentences.ranked import ORDER, nesting, tie, worth_listing
from flexgui.sentences.written import format_number
from flexgui.session.edit import model_of
from flexgui.stages.diagnose.effects import present
from flexgui.stages.diagnose.look import Looked
from flexgui.stages.diagnose.plots_demonstration import glimpse, picture
from flexgui.views.html import mathml
from flexgui.views.ranking import chance, typeset_sizes

NOTHING_MISSING = "Nothing is missing; the effects below explain too little to count."
READ = (
    "Explains: the share of the squared error above the noise floor that disappears when the "
    "effect and all other parameters are refitted. Estimate (≈): a linear prediction before "
    "refitting. Score: about 1 per parameter for pure noise, large where the residual has the "
    f"shape of the effect. {ORDER}"
)

SHOW, HIDE = "Show what it does", "Hide what it does"

SHOWN = 6
"""Rows; those below explain next to nothing as a rule and can be added by hand."""


class Candidates:
    """Rows that are made once and then filled."""

    def __init__(self, context: PageContext) -> None:
        self._head = Words(context.gui)
        self._rows = [_Row(context) for _ in range(SHOWN)]
        self._shown: object = None

    def show(self, found: Looked | None, titles: dict[str, str], best: bool) -> None:
        """The best of a ranking; `titles` of what each cannot be told from; `best`: whether adding
        the first is the next sensible thing."""
        self._rows[0].prominent(best and found is not None and inviting(found))
        if found is self._shown:
            return
        self._shown = found
        ranking = [] if found is None else worth_listing(found.ranking)
        self._head.show(_head(found) if found is not None and ranking else "")
        for k, row in enumerate(self._rows):
            row.show(k, ranking[k] if k < len(ranking) else None, found, titles)

    def enable(self, able: bool) -> None:
        """Whether something can be added now; marks the row whose effect is demonstrated."""
        for row in self._rows:
            row.enable(able)


def inviting(found: Looked) -> bool:
    """Whether the first effect may explain something: of a model at its floor no verdict is waited
    for, and what the model's own parameters imitate explains nothing."""
    if any(one.tied_to for one in found.ranking[:1]):
        return False
    if found.diagnosis is not None:
        return found.diagnosis.verdict != NOTHING
    return bool(found.step.cost_per_sample > ABOVE**2)


def _head(found: Looked) -> Markup:
    """What the list is worth, and how its figures are read."""
    over = found.diagnosis is not None and found.diagnosis.verdict == NOTHING
    note = paragraph(NOTHING_MISSING) if over else Markup("")
    read = Markup("<details><summary>How to read the list</summary>{}</details>")
    return note + read.format(paragraph(READ, "soft"))


class _Row:
    def __init__(self, context: PageContext) -> None:
        self._context, self._kind = context, ""
        self._folder: Any = context.gui.add_folder(None, visible=False)
        with self._folder:
            self._words, self._story = Words(context.gui), Words(context.gui)
            self._add = widgets.button(
                context, "Add", lambda: context.session.diagnosis.add(self._kind)
            )
            self._show = Demonstrate(context, lambda: self._kind)

    def enable(self, able: bool) -> None:
        self._add.disabled = not able or self._context.read_only
        self._show.refresh()

    def prominent(self, best: bool) -> None:
        color = "blue" if best else "gray"
        if self._add.color != color:
            self._add.color = color

    def show(
        self, place: int, one: RankedEffect | None, found: Looked | None, titles: dict[str, str]
    ) -> None:
        self._folder.visible = one is not None
        if one is None or found is None:
            return
        self._kind = one.effect
        self._words.show(_row(place, one, found, titles))
        self._story.show(explanation(one.effect))
        label = f"Add {one.title}"
        if self._add.label != label:
            self._add.label = label


class Demonstrate:
    """A button that shows what an effect does, and hides it again."""

    def __init__(self, context: PageContext, kind: Callable[[], str]) -> None:
        self._context, self._kind = context, kind
        self._button = widgets.button(context, SHOW, self._pressed)

    def _pressed(self) -> None:
        session, kind = self._context.session, self._kind()
        if session.demonstration.kind == kind:
            session.demonstration.end()
        elif kind:
            session.demonstration.start(kind)

    def refresh(self) -> None:
        """Says what it would do."""
        shown = bool(self._kind()) and self._context.session.demonstration.kind == self._kind()
        self._button.visible = self._kind() in catalogue()
        label = HIDE if shown else SHOW
        if self._button.label != label:
            self._button.label = label


def _row(place: int, one: RankedEffect, found: Looked, titles: dict[str, str]) -> Markup:
    # Only what a refit has shown stands in bold.
    share = "" if one.refit_drop_percent is None else percent(one.refit_drop_percent)
    head = Markup("<div class='rank'><span>{}.</span><b>{}</b><i>{}</i></div>").format(
        place + 1, one.title, share
    )
    parts = [head, paragraph(_figures(one), "soft")]
    if one.parameters:
        parts.append(paragraph(Markup("Size: {}.").format(typeset_sizes(one))))
    if related := nesting(one.effect, found.ranking[0].effect):
        parts.append(paragraph(f"{related[0].upper()}{related[1:]}."))
    if one.confused_with:
        others = ", ".join(titles.get(kind, kind) for kind in one.confused_with)
        parts.append(paragraph(f"Cannot be distinguished from: {others}.", "bad"))
    if tied := tie(one):
        parts.append(paragraph(f"{tied[0].upper()}{tied[1:]}.", "bad"))
    if one.predicted:
        seen = glimpse(found.recordings, found.channels, found.dt, found.residual, one.predicted)
        parts.append(picture(seen) if seen is not None else Markup(""))
    return joined(*parts)


def _figures(one: RankedEffect) -> str:
    refitted = one.refit_drop_percent
    if not math.isfinite(one.score) and refitted is not None:
        return f"Your formula explains {percent(refitted)} of the error after fitting."
    expected = _about(one.expected_drop_percent)
    score = f"score {format_number(one.score, 3)}, chance of noise {chance(one.p_value)}"
    if refitted is None:
        return f"Not refitted; estimate: {expected} of the error; {score}."
    share = f"{percent(refitted)} of the error ({expected} predicted before refitting)"
    return f"Explains {share}; {score}."


def _about(share: float) -> str:
    """'≈ 80 %', 'less than 1 %'."""
    text = percent(share)
    return f"≈ {text}" if text[0].isdigit() else text


def explanation(kind: str) -> Markup:
    """Story and formula of a listed effect, folded."""
    body = _body(kind)
    if not body:
        return Markup("")
    return Markup("<details><summary>What is it?</summary>{}</details>").format(body)


def story(kind: str) -> Markup:
    """The same with its title, open."""
    one = catalogue().get(kind)
    return joined(paragraph("Your own effect" if one is None else one.title, "lead"), _body(kind))


def _body(kind: str) -> Markup:
    one = catalogue().get(kind)
    if one is None:
        return Markup("")
    formula = Markup("<div class='formula'>{}</div>").format(mathml(one.formula))
    return joined(paragraph(one.story), formula if one.formula else "")


ADDED_NONE = "nothing added"


class Grown:
    """Controls of the model's effects."""

    def __init__(self, context: PageContext) -> None:
        self._context = context
        session, gui = context.session, context.gui
        with gui.add_folder("Add or remove by hand", expand_by_default=False):
            self._by_title = {e.title: kind for kind, e in sorted(catalogue().items())}
            titles = tuple(sorted(self._by_title))
            self._pick = gui.add_dropdown("Effect", titles, disabled=context.read_only)
            self._about = Words(gui, explanation(self._by_title[titles[0]]))
            self._pick.on_update(lambda _: self._picked())
            self._add = widgets.button(
                context, "Add this effect", lambda: session.diagnosis.add(self._kind)
            )
            self._show = Demonstrate(context, lambda: self._kind)
            self._present = gui.add_dropdown(
                "In the model", (ADDED_NONE,), disabled=context.read_only
            )
            self._remove = widgets.button(context, "Remove it", self._removed)
        with gui.add_folder("Add an own effect by formula", expand_by_default=False):
            self._own_controls()

    def _own_controls(self) -> None:
        context, gui = self._context, self._context.gui
        arm = model_of(context.session.document.scenario).arm
        self._target = gui.add_dropdown("Acts at", tuple(targets(arm)), disabled=context.read_only)
        self._formula = gui.add_text(
            "Formula", "-a*tanh(dtheta1/0.001)", disabled=context.read_only
        )
        self._parameters = gui.add_text("Parameters", "a = 0.5 [N m]", disabled=context.read_only)
        self._hint = Words(gui)
        self._target.on_update(lambda _: self._show_hint())
        self._own = widgets.button(context, "Add this formula", self._add_own)
        self._refused = Words(gui)
        self._show_hint()

    @property
    def _kind(self) -> str:
        return self._by_title.get(str(self._pick.value), "")

    def _picked(self) -> None:
        self._about.show(explanation(self._kind))
        self._show.refresh()

    def _show_hint(self) -> None:
        try:
            words = states(
                model_of(self._context.session.document.scenario).arm, str(self._target.value)
            )
        except (InputError, KeyError):
            return
        self._hint.show(
            paragraph(
                f"The torque in N m (at the tip the force in N) from {', '.join(words)} and your "
                f"parameters; with sin, cos, tanh, exp, sqrt, abs, sign. It must vanish with its "
                f"parameters.",
                "soft",
            )
        )

    def _add_own(self) -> None:
        texts = (str(self._target.value), str(self._formula.value), str(self._parameters.value))
        session = self._context.session
        done = session.diagnosis.add_own(*texts)
        # The newest message stands on top, which may be out of sight from here.
        self._refused.show("" if done else paragraph(session.message.text, "bad"))

    def _removed(self) -> None:
        session = self._context.session
        for kind, title in present(session.document.scenario):
            if title == self._present.value:
                session.diagnosis.remove(kind)
                return

    def refresh(self, able: bool) -> None:
        """Shows what is in the model."""
        session = self._context.session
        inside = present(session.document.scenario)
        titles = tuple(dict.fromkeys(title for _, title in inside)) or (ADDED_NONE,)
        if self._present.options != titles:
            self._present.options = titles
        able = able and not self._context.read_only
        self._add.disabled = self._own.disabled = not able
        self._remove.disabled = not able or not inside
        self._show.refresh()
