"""The stages of the work as a row of buttons, and the newest message below it."""

from __future__ import annotations

from markupsafe import Markup

from flexgui.page.in_browser import PURPOSE
from flexgui.page.panel import PageContext
from flexgui.page.widgets import Words, joined, paragraph
from flexgui.session.state import OURS, STAGES, Part

PURPOSE_LINE = Markup("<p class='purpose'>{}</p>").format(PURPOSE)
FOLLOWS = Markup("<p class='follows'><b>You follow the teacher.</b> {}</p>").format(
    "Stages and settings are the teacher's. Turn the arm with the mouse as you like; take your own "
    "copy to change things. It stays yours after a reload."
)
BAR = Markup("<span class='fx-bar at-{}{}'></span>")


class StageBar:
    """Stands on top of the main panel."""

    def __init__(self, context: PageContext) -> None:
        self._context = context
        Words(context.gui, FOLLOWS if context.read_only else PURPOSE_LINE)
        self._mark = Words(context.gui, self._active())
        self._buttons = context.gui.add_button_group("Stage", STAGES)
        if not context.read_only:
            self._buttons.on_click(lambda _: context.session.show(str(self._buttons.value)))
        self._message, self._old = Words(context.gui), Words(context.gui)

    def refresh(self) -> None:
        """Shows which stage is active, the newest message, and what is not up to date."""
        self._mark.show(self._active())
        message = self._context.session.message
        kind = "bad" if message.bad else "good"
        self._message.show(paragraph(message.text, kind) if message.text else "")

        self._old.show(not_updated(self._context.session.faults.old | self._context.faults.old))

    def _active(self) -> Markup:
        """Marks the row of buttons below it."""
        number = 1 + STAGES.index(self._context.session.stage)
        return BAR.format(number, " watched" if self._context.read_only else "")


IN_FIGURES = {Part.MODEL, Part.PLAYBACK, Part.STUDY, Part.PLOTS, Part.LATE_PLOTS}
OLD_FIGURES = Markup("<span class='fx-old'></span>")


def not_updated(parts: frozenset[Part]) -> Markup:
    """Says which parts of the page show an older state, and marks its figures where they do."""
    if not parts:
        return Markup("")
    words = ", ".join(sorted(part.value for part in parts))
    sentence = f"{words[0].upper()}{words[1:]} could not be updated and may be old: {OURS}."
    return joined(paragraph(sentence, "bad"), OLD_FIGURES if parts & IN_FIGURES else "")
