"""The tables and figures of a study, one section at a time."""

from __future__ import annotations

from flexgui.panels import widgets
from flexgui.panels.page_context import PageContext
from flexgui.panels.plot import Plot
from flexgui.panels.words import Words, paragraph
from flexgui.session.study_shown import ShownSection

NONE = "no results yet"
MOST_FIGURES = 2
"""Of one section."""

EMPTY = (
    "The study repeats the identification with fresh noise, as the paper does for its Tables I and "
    "II, and shows how far the estimates scatter, beside the printed figures. Further parts "
    "validate on sweeps, compare with other methods on the same data, and say which experiments "
    "would give more information. Tables and figures stand here as soon as the first results come."
)


class StudyResults:
    """A choice on the right; on the left what was chosen, which grows while the study runs."""

    def __init__(self, desk: PageContext) -> None:
        self._desk = desk
        self._chosen = ""
        self._drawn: ShownSection | None = None

    def build_choice(self) -> None:
        """Add the choice of a section."""
        self._choice = widgets.choice(
            self._desk, "Show", (NONE,), lambda: self._chosen or NONE, self._choose
        )

    def build_plots(self) -> None:
        """Add the figures and tables of a section."""
        gui = self._desk.gui
        self._title = Words(gui)
        self._figures = [(Plot(gui, 0.6), Words(gui)) for _ in range(MOST_FIGURES)]
        self._words = Words(gui)

    def refresh(self) -> None:
        """Draws the chosen section where it has changed."""
        sections = {s.title: s for s in self._desk.session.study.sections}
        options = tuple(sections) or (NONE,)
        if self._chosen not in options:
            self._chosen = options[0]
        self._choice.visible = bool(sections)
        if self._choice.options != options:
            self._choice.options = options
        if self._choice.value != self._chosen:
            self._choice.value = self._chosen
        section = sections.get(self._chosen)
        if section is None:
            self._clear()
        elif section is not self._drawn:
            self._draw(section)
        self._drawn = section

    def _choose(self, title: str) -> bool:
        self._chosen = title
        self.refresh()
        return True

    def _clear(self) -> None:
        self._title.show(paragraph(EMPTY, "soft"))
        self._words.show("")
        for plot, caption in self._figures:
            plot.show(None)
            caption.show("")

    def _draw(self, section: ShownSection) -> None:
        self._title.show(paragraph(section.title, "lead"))
        self._words.show(section.words)
        figures = [*section.figures, *[None] * MOST_FIGURES]
        for (plot, caption), shown in zip(self._figures, figures, strict=False):
            if shown is None:
                plot.show(None)
                caption.show("")
            else:
                plot.show(shown.figure, height=shown.height)
                caption.show(paragraph(shown.caption, "soft"))
