"""The card of the tour on the page, and the question whether to restore earlier work.

On the tour the buttons for the next stage also start the work there. Five clicks lead from the
first page to a smaller error: begin, fit, compare, find, add.
"""

from __future__ import annotations

from typing import Any

from markupsafe import Markup

from flexgui.library.shipped import HIDDEN, is_of_tour
from flexgui.page.panel import PageContext, PageElement
from flexgui.page.widgets import HtmlBlock, button, color, paragraph
from flexgui.session.tour import (
    BEGIN,
    END,
    FIRST_STAGE,
    OFFERED,
    STARTED,
    Card,
    card,
    is_on_tour,
    needs_fit,
    needs_search,
    next_stage,
)
from flexgui.stages.data.panel_own import upload_button

CARD = Markup("<div class='tour {}'><p class='lead'>{}</p><p>{}</p></div>")
AWAY = Markup("<span class='fx-away'></span>")
"""A mark for the style: the button below is hidden."""

OPEN_MINE = "Open my recordings"
"""Beside the offer of the tour, for a person with recordings."""
REOPEN, LEAVE, SKIP = "Tour", "Leave the tour", "Skip tour"
NO_CARD = Card("", "")


class Tour(PageElement):
    """The card below the stages; *Tour* shows a dismissed one again."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self._card = HtmlBlock(self.gui)
        self._go: Any = button(context, BEGIN, self._pressed, prominent=True)
        self._away = HtmlBlock(self.gui, AWAY)
        upload_button(context, OPEN_MINE)
        context.actions.register("tour", lambda _: self._leave_or_reopen())

    def _shown(self) -> Card | None:
        return None if self.context.read_only else card(self.session)

    def _pressed(self) -> None:
        """The card's own button: starts the tour, or ends it."""
        session = self.session
        if session.tour.step != OFFERED:
            session.tour.set_step(None)
        elif session.choose(HIDDEN):
            session.tour.set_step(STARTED)
            session.show("Data")

    def _leave_or_reopen(self) -> None:
        session = self.session
        if self._shown() is not None:
            session.tour.set_step(None)
        elif is_of_tour(session.document.scenario):
            session.tour.set_step(STARTED)
            if self._shown() is None:
                session.show(next_stage(session))
        else:
            session.tour.set_step(OFFERED)
            session.show(FIRST_STAGE)

    def refresh(self) -> None:
        """Shows the present card."""
        present_card = self._shown()
        shown = present_card or NO_CARD
        offers = shown.button == BEGIN
        self._card.show(
            CARD.format("pair" if offers else "", shown.title, shown.text) if present_card else ""
        )
        self._away.show("" if offers else AWAY)
        self._go.visible = bool(shown.button)
        self._go.label = shown.button or BEGIN
        # Where earlier work is offered, that button is highlighted instead.
        self._go.color = color(self.session.store.earlier is None)

    @property
    def label(self) -> str:
        """The label of the button that leaves or reopens the tour; empty on the last card."""
        present_card = self._shown()
        if self.context.read_only or (present_card is not None and present_card.button == END):
            return ""
        return REOPEN if present_card is None else SKIP if present_card.button == BEGIN else LEAVE


ON_TOP = -1e8
"""Order in the main panel: above the stages."""


class RestoreQuestion(PageElement):
    """A question with two buttons; hidden once it is answered."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        store = self.session.store
        self._folder = None
        if store.earlier is None or context.read_only:
            return
        self._folder = self.gui.add_folder(None, order=ON_TOP)
        with self._folder:
            HtmlBlock(self.gui, paragraph(f"Restore your work of {store.earlier.date}?", "lead"))
            button(context, "Restore it", store.restore, prominent=True)
            button(context, "Not now", store.decline)

    def refresh(self) -> None:
        """Hides the question once it is answered."""
        if self._folder is not None:
            self._folder.visible = self.session.store.earlier is not None


def to_identification(context: PageContext) -> None:
    """Shows *Identify*; on the tour also starts the fit."""
    session = context.session
    session.show("Identify")
    if is_on_tour(session) and needs_fit(session):
        session.identification.start()


def to_diagnosis(context: PageContext) -> None:
    """Shows *Diagnose*; on the tour also starts the diagnosis."""
    session = context.session
    session.show("Diagnose")
    if is_on_tour(session) and needs_search(session):
        session.diagnosis.search()
