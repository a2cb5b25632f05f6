"""The page of one browser: stages on the right, their plots on the left, the arm between them."""

from __future__ import annotations

import time
from typing import Any

import viser

from core.plugins import classes_of
from flexgui.panels.in_browser import lift
from flexgui.panels.page_layout import CONTROLS, PLOTS, PageLayout, Widths, Window
from flexgui.panels.painter import Painter
from flexgui.panels.panel import PageContext, Panel
from flexgui.panels.plot import fresh_paper, paper_of
from flexgui.panels.scene import Scene
from flexgui.panels.stagebar import StageBar
from flexgui.panels.timeline import TimeLine
from flexgui.panels.tour import Offer, Tour
from flexgui.panels.widgets import grey
from flexgui.session import Services, Session, Topic
from flexgui.session.state import STAGES

CURSOR_INTERVAL = 0.12
"""s: a plot is sent whole each time."""

FOLLOWER = "follower"
"""The role of who watches a demo."""

BESIDE = 20.0
"""px of the left panel that are not the figures'."""


def build_page(
    client: viser.ClientHandle, session: Session, services: Services, read_only: bool = False
) -> Page:
    """Builds everything from the session's state; a follower's page is `read_only`."""
    demo = getattr(services, "demo", None)
    follows = demo is not None and demo.role(client) == FOLLOWER
    return Page(PageContext(client, session, services, read_only or follows))


class Page:
    """Lives as long as the browser's connection."""

    def __init__(self, desk: PageContext) -> None:
        self.desk = desk
        gui = desk.gui
        self._layout = PageLayout(desk.client)
        fresh_paper(gui)
        others = set(gui._gui_input_handle_from_uuid)
        gui.set_panel_label("FlexGUI")
        gui.main_panel.dock_right()
        self._docked = (PLOTS, CONTROLS)
        gui.main_panel.set_width(CONTROLS)
        kinds = classes_of("flexgui.panels", Panel)
        self._panels: dict[str, Panel] = {stage: kinds[stage](desk) for stage in STAGES}
        self._folders: dict[str, tuple[Any, Any]] = {}
        self._offer = Offer(desk)
        self._bar = StageBar(desk)
        self._tour = Tour(desk)
        self._cursor_drawn, self._behind_curtain = 0.0, True
        self._left = gui.add_panel()
        self._build(gui)
        self._left.dock_left()
        self._left.set_width(PLOTS)
        self._scene = Scene(desk)
        self._timeline = TimeLine(desk, self._scene.look_from)
        self._layout.begin(self.desk.theme.fit, self._fit, self._timeline.fit, self._scene.fit)
        if desk.read_only:
            grey(gui, others)
        self._painter = Painter(self._draw, self._settle, lambda: desk.session.wait_idle(0.0))
        self._end = desk.session.subscribe(self._painter.mark)
        for topic in Topic:
            self._painter.mark(topic)
        if desk.session.view is None:
            desk.session.refresh_live()
        if desk.session.playback is None:
            desk.session.refresh_playback()

    def close(self) -> None:
        """Stops drawing; the session lives on."""
        self._end()
        self._layout.close()
        self._painter.close()
        self._timeline.close()
        self._scene.close()

    def _fit(self, window: Window, shares: Widths) -> None:
        """Whoever has moved a border keeps it until the window itself asks for others."""
        if (shares.plots, shares.controls) != self._docked:
            self._docked = (shares.plots, shares.controls)
            self._left.set_width(shares.plots)
            self.desk.gui.main_panel.set_width(shares.controls)
        width = window.width if window.phone else shares.plots
        paper_of(self.desk.gui).resize(width - BESIDE)

    def _cursor_is_due(self) -> bool:
        """While it plays the arm moves at every frame, plots and slider less often."""
        now = time.monotonic()
        due = not self.desk.session.cursor.playing or now - self._cursor_drawn > CURSOR_INTERVAL
        self._cursor_drawn = now if due else self._cursor_drawn
        return due

    def _build(self, gui: viser.GuiApi) -> None:
        controls = {}
        for stage, panel in self._panels.items():
            controls[stage] = gui.add_folder(None, visible=stage == self.desk.session.stage)
            with controls[stage]:
                panel.build_controls()
        with self._left.add_tab("Plots"):
            for stage, panel in self._panels.items():
                folder = gui.add_folder(None, visible=stage == self.desk.session.stage)
                with folder:
                    panel.build_plots()
                self._folders[stage] = (controls[stage], folder)

    def _draw(self, topics: frozenset[Topic]) -> None:
        session = self.desk.session
        shown = self._panels[session.stage]
        with self.desk.client.atomic():
            if Topic.STAGE in topics:
                for stage, folders in self._folders.items():
                    for folder in folders:
                        folder.visible = stage == session.stage
            if Topic.KEPT in topics:
                self._offer.refresh()
            if topics & {Topic.STAGE, Topic.MESSAGE}:
                self._bar.refresh()
            if topics - {Topic.CURSOR, Topic.LIVE, Topic.MESSAGE}:
                self._tour.refresh()
            self._scene.draw(topics)
            if Topic.STAGE in topics or topics & shown.topics:
                shown.refresh()
            if topics & {Topic.CURSOR, Topic.RECORDINGS, Topic.OUTCOME} and self._cursor_is_due():
                self._timeline.refresh()
                shown.move_cursor()
            elif Topic.STAGE in topics:
                self._timeline.refresh()
            if topics - {Topic.CURSOR, Topic.MESSAGE, Topic.RUN, Topic.DIAGNOSIS, Topic.TOUR}:
                for sync in tuple(self.desk.syncs):
                    sync()
        if self._behind_curtain and session.view is not None:
            self._behind_curtain = False
            lift(self.desk.client)
        # Not at the next sixtieth of a second: a hand on a slider feels it.
        self.desk.client.flush()

    def _settle(self) -> None:
        """Nothing has moved for a moment."""
        with self.desk.client.atomic():
            self._panels[self.desk.session.stage].settle()
