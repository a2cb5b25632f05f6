"""The stages of the work as a row of buttons, and the newest message below it."""

from __future__ import annotations

from markupsafe import Markup

from flexgui.panels.curtain import PURPOSE
from flexgui.panels.page_context import PageContext
from flexgui.panels.style import FOLLOWER, STYLE, bar_style
from flexgui.panels.words import Words, joined, paragraph
from flexgui.session.state import STAGES

PURPOSE_LINE = Markup("<p class='purpose'>{}</p>").format(PURPOSE)
FOLLOWS = Markup("<p class='follows'><b>You follow the teacher.</b> {}</p>").format(
    "Stages and settings are the teacher's. Turn the arm with the mouse as you like; take your own "
    "copy to change things. It stays yours after a reload."
)
BAR = Markup("<span class='fx-bar'></span>")


class StageBar:
    """Stands on top of the main panel."""

    def __init__(self, desk: PageContext) -> None:
        self._desk = desk
        Words(desk.gui, FOLLOWS if desk.read_only else PURPOSE_LINE)
        self._mark = Words(desk.gui, self._style())
        self._buttons = desk.gui.add_button_group("Stage", STAGES)
        if not desk.read_only:
            self._buttons.on_click(lambda _: desk.session.show(str(self._buttons.value)))
        self._message = Words(desk.gui)

    def refresh(self) -> None:
        """Shows which stage is active and the newest message."""
        self._mark.show(self._style())
        message = self._desk.session.message
        kind = "bad" if message.bad else "good"
        self._message.show(paragraph(message.text, kind) if message.text else "")

    def _style(self) -> Markup:
        follows = FOLLOWER if self._desk.read_only else Markup("")
        return joined(STYLE, follows, bar_style(STAGES.index(self._desk.session.stage)), BAR)
