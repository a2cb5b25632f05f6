"""The page of one browser: stages on the right, their plots on the left, the arm between them. What
changed is drawn on another thread, so that no callback ever waits for a drawing."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from functools import partial
from importlib import import_module
from typing import Any

import viser

from flexgui.page.in_browser import help_hands, lift
from flexgui.page.layout import CONTROLS, PLOTS, PageLayout, Widths, Window
from flexgui.page.painter import Painter
from flexgui.page.panel import PageContext, Panel
from flexgui.page.plot import fresh_paper, paper_of
from flexgui.page.scene_panel import Scene
from flexgui.page.stagebar import StageBar
from flexgui.page.timeline import TimeLine
from flexgui.page.tour import Offer, Tour
from flexgui.page.widgets import grey
from flexgui.session import Session, Topic
from flexgui.session.state import STAGES, Part

CURSOR_INTERVAL = 0.12
"""s: a plot is sent whole each time."""

BESIDE = 20.0
"""px of the left panel that are not the figures'."""


def build_page(client: viser.ClientHandle, session: Session, read_only: bool = False) -> Page:
    """Builds everything from the session's state; a follower's page is `read_only`."""
    return Page(PageContext(client, session, read_only))


class Page:
    """Lives as long as the browser's connection."""

    def __init__(self, context: PageContext) -> None:
        self.context = context
        gui = context.gui
        help_hands(context.client)
        self._layout = PageLayout(context.client)
        fresh_paper(gui)
        others = set(gui._gui_input_handle_from_uuid)
        gui.set_panel_label("FlexGUI")
        gui.main_panel.dock_right()
        self._docked = (PLOTS, CONTROLS)
        gui.main_panel.set_width(CONTROLS)
        self._panels: dict[str, Panel] = {stage: panel_of(stage)(context) for stage in STAGES}
        self._folders: dict[str, tuple[Any, Any]] = {}
        self._offer = Offer(context)
        self._bar = StageBar(context)
        self._tour = Tour(context)
        self._cursor_drawn, self._behind_curtain = 0.0, True
        self._left = gui.add_panel()
        self._build(gui)
        self._left.dock_left()
        self._left.set_width(PLOTS)
        self._scene = Scene(context)
        self._timeline = TimeLine(context, self._scene.look_from)
        self._layout.begin(self.context.theme.fit, self._fit, self._timeline.fit, self._scene.fit)
        if context.read_only:
            grey(gui, others)
        self._painter = Painter(self._draw, self._settle, lambda: context.session.wait_idle(0.0))
        self._end = context.session.subscribe(self._painter.mark)
        for topic in Topic:
            self._painter.mark(topic)
        if context.session.document.view is None:
            context.session.document.refresh()
        if context.session.playback.motion is None:
            context.session.playback.refresh()

    def close(self) -> None:
        """Stops drawing; the session lives on."""
        self._end()
        self.context.faults.closed = True
        self._layout.close()
        self._painter.close()
        self._scene.close()

    def _fit(self, window: Window, shares: Widths) -> None:
        """Whoever has moved a border keeps it until the window itself asks for others."""
        if (shares.plots, shares.controls) != self._docked:
            self._docked = (shares.plots, shares.controls)
            self._left.set_width(shares.plots)
            self.context.gui.main_panel.set_width(shares.controls)
        width = window.width if window.phone else shares.plots
        paper_of(self.context.gui).resize(width - BESIDE)

    def _cursor_is_due(self) -> bool:
        """While it plays the arm moves at every frame, plots and slider less often."""
        now = time.monotonic()
        due = (
            not self.context.session.playback.cursor.playing
            or now - self._cursor_drawn > CURSOR_INTERVAL
        )
        self._cursor_drawn = now if due else self._cursor_drawn
        return due

    def _build(self, gui: viser.GuiApi) -> None:
        controls = {}
        for stage, panel in self._panels.items():
            controls[stage] = gui.add_folder(None, visible=stage == self.context.session.stage)
            with controls[stage]:
                panel.build_controls()
        with self._left.add_tab("Plots"):
            for stage, panel in self._panels.items():
                folder = gui.add_folder(None, visible=stage == self.context.session.stage)
                with folder:
                    panel.build_plots()
                self._folders[stage] = (controls[stage], folder)

    def _draw(self, topics: frozenset[Topic]) -> None:
        with self.context.client.atomic():
            for part, draw in self._due(topics):
                with self.context.faults.watch(part):
                    draw()
        if self._behind_curtain and self.context.session.document.view is not None:
            self._behind_curtain = False
            lift(self.context.client)
        # Not at the next sixtieth of a second: a hand on a slider feels it.
        self.context.client.flush()

    def _due(self, topics: frozenset[Topic]) -> Iterator[tuple[Part, Callable[[], object]]]:
        """What is to be drawn, each by itself: one that fails keeps no other from being drawn."""
        shown = self._panels[self.context.session.stage]
        yield Part.FRAME, partial(self._draw_frame, topics)
        yield Part.ARM, partial(self._scene.draw, topics)
        if Topic.STAGE in topics or topics & shown.topics:
            yield Part.PLOTS, shown.refresh
        if topics & {Topic.CURSOR, Topic.RECORDINGS, Topic.OUTCOME} and self._cursor_is_due():
            yield Part.CURSOR, partial(_each, self._timeline.refresh, shown.move_cursor)
        elif Topic.STAGE in topics:
            yield Part.CURSOR, self._timeline.refresh
        if topics - {Topic.CURSOR, Topic.MESSAGE, Topic.RUN, Topic.DIAGNOSIS, Topic.TOUR}:
            yield Part.INPUTS, partial(_each, *self.context.syncs)

    def _draw_frame(self, topics: frozenset[Topic]) -> None:
        if Topic.STAGE in topics:
            for stage, folders in self._folders.items():
                for folder in folders:
                    folder.visible = stage == self.context.session.stage
        if Topic.KEPT in topics:
            self._offer.refresh()
        if topics & {Topic.STAGE, Topic.MESSAGE}:
            self._bar.refresh()
        if topics - {Topic.CURSOR, Topic.LIVE, Topic.MESSAGE}:
            self._tour.refresh()

    def _settle(self) -> None:
        """Nothing has moved for a moment."""
        with self.context.client.atomic(), self.context.faults.watch(Part.LATE_PLOTS):
            self._panels[self.context.session.stage].settle()


def _each(*steps: Callable[[], object]) -> None:
    for step in steps:
        step()


def panel_of(stage: str) -> type[Panel]:
    """The panel in the folder of a stage."""
    module = import_module(f"flexgui.stages.{stage.lower()}.panel")
    classes = (each for each in vars(module).values() if isinstance(each, type))
    return next(each for each in classes if issubclass(each, Panel) and each.kind == stage)
