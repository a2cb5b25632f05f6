"""Work of an earlier session, which a person may take up again."""

from __future__ import annotations

from flexgui.panels import widgets
from flexgui.panels.page_context import PageContext
from flexgui.panels.words import Words, paragraph

ON_TOP = -1e8
"""Order in the main panel: above the stages."""


class Offer:
    """A question with two buttons; gone once it is answered."""

    def __init__(self, desk: PageContext) -> None:
        self._desk = desk
        earlier = desk.session.earlier
        self._folder = None
        if earlier is None or desk.read_only:
            return
        self._folder = desk.gui.add_folder(None, order=ON_TOP)
        with self._folder:
            question = f"Restore your work of {earlier.words}?"
            Words(desk.gui).show(paragraph(question, "lead"))
            widgets.button(desk, "Restore it", lambda: desk.session.restore(), prominent=True)
            widgets.button(desk, "Not now", lambda: desk.session.decline())

    def refresh(self) -> None:
        """Takes the question away once it is answered."""
        if self._folder is not None:
            self._folder.visible = self._desk.session.earlier is not None
