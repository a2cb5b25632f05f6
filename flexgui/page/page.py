"""The page of one browser: stages on the right, their plots on the left, the arm between them.
Changes are drawn on another thread, so that no callback waits for a drawing."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from importlib import import_module
from typing import Any

import viser
from markupsafe import Markup

from flexgui.page.actions import press, selection
from flexgui.page.earlier_work import register_ways_back, replaced_work
from flexgui.page.in_browser import install_scripts, remove_curtain
from flexgui.page.layout import CONTROLS, PLOTS, THEMES, PageLayout, Widths, Window
from flexgui.page.panel import PageContext, PageElement, Panel
from flexgui.page.redraw import RedrawScheduler
from flexgui.page.scene_panel import ScenePanel
from flexgui.page.timeline import TimeLine
from flexgui.page.tour import RestoreQuestion, Tour
from flexgui.page.widgets import HtmlBlock, disable_inputs, paragraph
from flexgui.session.session import Session
from flexgui.session.state import INTERNAL_FAULT, STAGES, WORK_STAGES, PagePart, Topic

CURSOR_INTERVAL = 0.12
"""s between two moves of the cursor in plots while a recording plays."""

BESIDE = 20.0
"""px of the left panel beside the figures."""


def build_page(client: viser.ClientHandle, session: Session, read_only: bool = False) -> Page:
    """Builds the page from the session's state; a follower's page is `read_only`."""
    return Page(PageContext(client, session, read_only))


class Page(PageElement):
    """The page; it lives as long as the browser's connection."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        gui, session = context.gui, context.session
        install_scripts(context.client)
        self._layout = PageLayout(context.client)
        others = set(gui._gui_input_handle_from_uuid)
        gui.set_panel_label("FlexGUI")
        gui.main_panel.dock_right()
        self._docked = (PLOTS, CONTROLS, False)
        gui.main_panel.set_width(CONTROLS)
        self._panels: dict[str, Panel] = {stage: panel_of(stage)(context) for stage in STAGES}
        context.actions.build(gui)
        self._offer = RestoreQuestion(context)
        self._steps = StageBar(context, self._panels, lambda: self._tour.label)
        self._tour = Tour(context)
        self._cursor_drawn, self._behind_curtain = 0.0, True
        self._left = gui.add_panel()
        self._syncs: dict[str, list[Callable[[], None]]] = {}
        self._folders = self._in_folders(lambda panel: panel.build_controls())
        with self._left.add_tab("Plots"):
            self._folders += self._in_folders(self._build_plots)
        self._left.dock_left()
        self._left.set_width(PLOTS)
        self._scene = ScenePanel(context)
        self._timeline = TimeLine(context, self._scene.look_from)
        self._layout.begin(self.context.theme.fit, self._fit, self._scene.fit)
        if context.read_only:
            disable_inputs(gui, others)
        is_idle = partial(session.wait_idle, 0.0)
        self._redraw = RedrawScheduler(self._draw, self._draw_slow_parts, is_idle)
        self._end = session.subscribe(self._redraw.mark)
        for topic in Topic:
            self._redraw.mark(topic)
        if session.document.live_model is None:
            session.document.refresh()
        if session.playback.motion is None:
            session.playback.refresh()

    def close(self) -> None:
        """Stops drawing; the session goes on."""
        self._end()
        self.context.faults.closed = True
        self._layout.close()
        self._redraw.close()
        self._scene.close()

    def _fit(self, window: Window, shares: Widths) -> None:
        """Sets the panels' widths if the window needs other ones; else a moved border stays."""
        # Sent once more when the panels stand: while a panel is docked it takes no width that its
        # edge had before, as after a reconnect.
        wanted = (shares.plots, shares.controls, window.picture > 0.0)
        if wanted != self._docked:
            self._docked = wanted
            self._left.set_width(shares.plots)
            self.gui.main_panel.set_width(shares.controls)
        width = window.width if window.phone else shares.plots
        self.context.plot_area.resize(width - BESIDE, shares.columns, window.height)

    def _cursor_is_due(self) -> bool:
        """Whether to move the plots' cursor: while a recording plays, less often than the arm."""
        now = time.monotonic()
        playing = self.session.playback.cursor.playing
        due = not playing or now - self._cursor_drawn > CURSOR_INTERVAL
        self._cursor_drawn = now if due else self._cursor_drawn
        return due

    def _in_folders(self, build: Callable[[Panel], None]) -> list[tuple[str, Any]]:
        """Makes a folder for each stage; only that of the shown stage is visible."""
        folders, outer_syncs = [], self.context.syncs
        for stage, panel in self._panels.items():
            folder = self.gui.add_folder(None, visible=stage == self.session.stage)
            self.context.syncs = self._syncs.setdefault(stage, [])
            with folder:
                build(panel)
            folders.append((stage, folder))
        self.context.syncs = outer_syncs
        return folders

    def _build_plots(self, panel: Panel) -> None:
        HtmlBlock(self.gui, COLUMNS_MARK)
        panel.build_plots()

    def _draw(self, topics: frozenset[Topic]) -> None:
        with self.context.client.atomic():
            for part, draw in self._due(topics):
                with self.context.faults.watch(part):
                    draw()
        if self._behind_curtain and self.session.document.live_model is not None:
            self._behind_curtain = False
            remove_curtain(self.context.client)
        # At once, not at the next sixtieth of a second: dragging a slider feels slow else.
        self.context.client.flush()

    def _due(self, topics: frozenset[Topic]) -> Iterator[tuple[PagePart, Callable[[], object]]]:
        """The parts to draw; a fault in one does not affect the others."""
        shown = self._panels[self.session.stage]
        outer_syncs = (*self.context.syncs, self._timeline.refresh)
        yield PagePart.FRAME, partial(self._draw_frame, topics)
        yield PagePart.ARM, partial(self._scene.draw, topics)
        if Topic.STAGE in topics or topics & shown.topics:
            yield PagePart.PLOTS, shown.refresh
        if topics & {Topic.CURSOR, Topic.RECORDINGS, Topic.OUTCOME} and self._cursor_is_due():
            yield PagePart.CURSOR, partial(_each, *outer_syncs, shown.move_cursor)
        elif Topic.STAGE in topics:
            yield PagePart.CURSOR, partial(_each, *outer_syncs)
        if topics - {Topic.CURSOR, Topic.MESSAGE, Topic.RUN, Topic.DIAGNOSIS, Topic.TOUR}:
            yield PagePart.INPUTS, partial(_each, *self._syncs[self.session.stage])

    def _draw_frame(self, topics: frozenset[Topic]) -> None:
        if Topic.STAGE in topics:
            for stage, folder in self._folders:
                folder.visible = stage == self.session.stage
        if Topic.KEPT in topics:
            self._offer.refresh()
        if topics - {Topic.CURSOR, Topic.LIVE}:
            self._steps.refresh()
        if topics - {Topic.CURSOR, Topic.LIVE, Topic.MESSAGE}:
            self._tour.refresh()

    def _draw_slow_parts(self) -> None:
        """Draws the slow parts of the shown stage."""
        with self.context.client.atomic(), self.context.faults.watch(PagePart.LATE_PLOTS):
            self._panels[self.session.stage].draw_slow_parts()


def _each(*steps: Callable[[], object]) -> None:
    for step in steps:
        step()


def panel_of(stage: str) -> type[Panel]:
    """The panel in the folder of a stage."""
    module = import_module(f"flexgui.stages.{stage.lower()}.panel")
    classes = (each for each in vars(module).values() if isinstance(each, type))
    return next(each for each in classes if issubclass(each, Panel) and each.kind == stage)


FOLLOWS = Markup("<p class='follows'><b>You follow the teacher.</b> {}</p>").format(
    "Stages and settings are the teacher's. Turn the arm with the mouse as you like; take your own "
    "copy to change things. It stays yours after a reload."
)
COLUMNS_MARK = Markup("<span class='fx-plots'></span>")
"""A mark for the style: in a wide window the plots around it stand in columns."""
STAGE_BAR = Markup(
    "<nav class='steps fx-bar' aria-label='Stages'><div>{}</div>"
    "<div class='beside'>{}<span></span>{} {}</div></nav>"
)
STAGE_BUTTON = Markup(
    "<button type='button' data-action='stage' data-value='{0}' class='{1}'{2}>{0}</button>"
)
OLD_FIGURES = Markup("<span class='fx-old'></span>")
IN_FIGURES = {
    PagePart.MODEL, PagePart.PLAYBACK, PagePart.STUDY, PagePart.PLOTS, PagePart.LATE_PLOTS,
}  # fmt: skip


class StageBar(PageElement):
    """The stages on top of the main panel, with marks for done ones, and the newest message."""

    def __init__(
        self, context: PageContext, panels: Mapping[str, Panel], tour: Callable[[], str]
    ) -> None:
        """`tour` returns the label of the button that starts or leaves the tour."""
        super().__init__(context)
        self._panels, self._tour_label = panels, tour
        HtmlBlock(self.gui, FOLLOWS if context.read_only else "")
        self._steps, self._message, self._left, self._old = (HtmlBlock(self.gui) for _ in range(4))
        register_ways_back(context)
        context.actions.register("stage", self.session.show)
        context.actions.register("theme", context.theme.choose)

    def refresh(self) -> None:
        """Shows the active stage, the newest message, and which parts are outdated."""
        self._steps.show(self._written())
        message = self.session.message
        self._message.show(paragraph(message.text, "bad" if message.bad else "good"))
        self._left.show("" if self.context.read_only else replaced_work(self.session))
        self._old.show(*not_updated(self.session.faults.outdated | self.context.faults.outdated))

    def _written(self) -> Markup:
        steps, beside = (
            Markup("").join(map(self._step, stages))
            for stages in (WORK_STAGES, STAGES[len(WORK_STAGES) :])
        )
        label = self._tour_label()
        tour = press(label, "tour", kind="link") if label else ""
        return STAGE_BAR.format(steps, beside, tour, settings_menu(self.context))

    def _step(self, stage: str) -> Markup:
        current = stage == self.session.stage
        marked = Markup(" aria-current='step'") if current else ""
        return STAGE_BUTTON.format(stage, "done" if self._panels[stage].done else "", marked)


def not_updated(parts: frozenset[PagePart]) -> list[Markup]:
    """A sentence on outdated parts of the page, and a mark if its figures are among them."""
    if not parts:
        return []
    words = ", ".join(sorted(part.value for part in parts))
    sentence = (
        f"{words[0].upper()}{words[1:]} could not be updated and may be old: {INTERNAL_FAULT}."
    )
    return [paragraph(sentence, "bad"), *([OLD_FIGURES] if parts & IN_FIGURES else [])]


MENU = Markup(
    "<details class='settings'><summary title='Settings'>Settings</summary><div>{}</div></details>"
)
KEPT = {
    "text": ("Text size", {"100": "usual", "115": "larger", "130": "largest"}),
    "look": (
        "3-D view",
        {"auto": "automatic", "fine": "with reflections", "plain": "plain, faster"},
    ),
}
"""Settings that only the browser stores; `browser/page.js` applies them."""


def settings_menu(context: PageContext) -> Markup:
    """The settings menu."""
    themes = {name: name for name in THEMES}
    rows = [selection("Colours", "theme", themes, context.theme.chosen)]
    for name, (label, options) in KEPT.items():
        rows.append(selection(label, name, options, "", kept=True))
    return MENU.format(Markup("").join(rows))
