"""The buttons that lead to the next stage: on the tour they also begin what is done there.

Five clicks lead from the first page to the error that falls: begin, fit, compare, find, add.
"""

from __future__ import annotations

from flexgui.panels.page_context import PageContext
from flexgui.session.tour_card import is_on_tour, is_to_be_fitted, is_to_be_searched


def to_identification(desk: PageContext) -> None:
    """Shows *Identify*; on the tour the fit starts as it stands."""
    session = desk.session
    session.show("Identify")
    if is_on_tour(session) and is_to_be_fitted(session):
        session.identify(desk.services)


def to_diagnosis(desk: PageContext) -> None:
    """Shows *Diagnose*; on the tour the search for what is missing starts."""
    session = desk.session
    session.show("Diagnose")
    if is_on_tour(session) and is_to_be_searched(session):
        session.diagnose(desk.services)
