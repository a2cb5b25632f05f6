"""What the page says of results of other settings and of replaced work, and how to go back."""

from __future__ import annotations

from markupsafe import Markup

from flexgui.core.scenario.schema import Scenario
from flexgui.page.actions import press
from flexgui.page.panel import PageContext
from flexgui.session.session import Session
from flexgui.session.settings import made_with

NOTE = Markup("<p class='warn'>{} {}</p>")
LEFT = Markup("<p class='soft'>Your earlier work, “{}”, is kept. {} {}</p>")
FIT, DIAGNOSIS = "fit", "diagnosis"


def register_ways_back(context: PageContext) -> None:
    """Makes the buttons of the notes work."""
    replaced = context.session.replaced
    context.actions.register("back to settings", lambda of: _go_to(context.session, of))
    context.actions.register("back to work", lambda _: replaced.back())
    context.actions.register("forget work", lambda _: replaced.forget())


def other_settings(session: Session, of: str) -> Markup:
    """With which other settings a shown result was made: the last `FIT` or `DIAGNOSIS`; empty for
    the present ones."""
    made = _made_with(session, of)
    words = "" if made is None else made_with(made, session.document.scenario)
    way_back = press("Back to these settings", "back to settings", of, able=not session.run.busy)
    return NOTE.format(words, way_back) if words else Markup("")


def replaced_work(session: Session) -> Markup:
    """The work that another scenario has replaced; empty without any."""
    left = session.replaced.left
    if left is None:
        return Markup("")
    back = press("Back to it", "back to work", able=not session.run.busy)
    return LEFT.format(left.scenario.title, back, press("Dismiss", "forget work", kind="link"))


def _made_with(session: Session, of: str) -> Scenario | None:
    version = session.diagnosis.newest
    if of == FIT:
        return session.identification.outcome_of
    return None if version is None else version.scenario


def _go_to(session: Session, of: str) -> bool:
    made = _made_with(session, of)
    return made is not None and session.go_to(made)
