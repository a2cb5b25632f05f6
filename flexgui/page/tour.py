"""The first visit: a card with four steps from a recording to a found effect.

The buttons that lead to the next stage also begin, on the tour, what is done there. Five clicks
lead from the first page to the error that falls: begin, fit, compare, find, add.
"""

from __future__ import annotations

from typing import Any

from markupsafe import Markup

from flexgui.library.shipped import HIDDEN, is_of_tour
from flexgui.page.panel import PageContext, PageElement
from flexgui.page.widgets import HtmlBlock, button, color, paragraph
from flexgui.session.tour import (
    AT,
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
"""A mark: the button below is hidden."""

OPEN_MINE = "Open my recordings"
"""Beside the tour's offer: who has own files need not walk through somebody else's."""
AGAIN, LEAVE, REFUSE = "Tour", "Leave the tour", "Skip tour"
NOTHING = Card("", "")


class Tour(PageElement):
    """A card below the stages; who dismissed it can have it back."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self._card = HtmlBlock(self.gui)
        self._go: Any = button(context, BEGIN, self._pressed, prominent=True)
        self._away = HtmlBlock(self.gui, AWAY)
        upload_button(context, OPEN_MINE)
        context.actions.register("tour", lambda _: self._left_or_back())

    def _shown(self) -> Card | None:
        return None if self.context.read_only else card(self.session)

    def _pressed(self) -> None:
        """The card's own button: begins the tour, or ends it."""
        session = self.session
        if session.tour.step != OFFERED:
            session.tour.set_step(None)
        elif session.choose(HIDDEN):
            session.tour.set_step(STARTED)
            session.show("Data")

    def _left_or_back(self) -> None:
        session = self.session
        if self._shown() is not None:
            session.tour.set_step(None)
        elif is_of_tour(session.document.scenario):
            session.tour.set_step(STARTED)
            if session.stage not in AT:
                session.show(next_stage(session))
        else:
            session.tour.set_step(OFFERED)
            session.show(FIRST_STAGE)

    def refresh(self) -> None:
        """Shows the card of the moment."""
        found = self._shown()
        shown = found or NOTHING
        offers = shown.button == BEGIN
        self._card.show(
            CARD.format("pair" if offers else "", shown.title, shown.text) if found else ""
        )
        self._away.show("" if offers else AWAY)
        self._go.visible = bool(shown.button)
        self._go.label = shown.button or BEGIN
        # Where earlier work is offered, to restore it is the next thing to do.
        self._go.color = color(self.session.store.earlier is None)

    @property
    def way(self) -> str:
        """The word that leaves the tour, or comes back to it; empty on its last card, which has a
        button that ends it."""
        found = self._shown()
        if self.context.read_only or (found is not None and found.button == END):
            return ""
        return AGAIN if found is None else REFUSE if found.button == BEGIN else LEAVE


ON_TOP = -1e8
"""Order in the main panel: above the stages."""


class RestoreQuestion(PageElement):
    """A question with two buttons; gone once it is answered."""

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
        """Takes the question away once it is answered."""
        if self._folder is not None:
            self._folder.visible = self.session.store.earlier is not None


def to_identification(context: PageContext) -> None:
    """Shows *Identify*; on the tour the fit starts as it stands."""
    session = context.session
    session.show("Identify")
    if is_on_tour(session) and needs_fit(session):
        session.identification.start()


def to_diagnosis(context: PageContext) -> None:
    """Shows *Diagnose*; on the tour the search for what is missing starts."""
    session = context.session
    session.show("Diagnose")
    if is_on_tour(session) and needs_search(session):
        session.diagnosis.search()
