"""The page of one browser: stages on the right, their plots on the left, the arm between them. What
changed is drawn on another thread, so that no callback ever waits for a drawing."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import viser

from flexgui.core.plugins import classes_of
from flexgui.panels.in_browser import lift
from flexgui.panels.page_layout import CONTROLS, PLOTS, PageLayout, Widths, Window
from flexgui.panels.panel import PageContext, Panel
from flexgui.panels.plot_panel import fresh_paper, paper_of
from flexgui.panels.scene_panel import Scene
from flexgui.panels.stagebar import StageBar
from flexgui.panels.timeline import TimeLine
from flexgui.panels.tour import Offer, Tour
from flexgui.panels.widgets import grey
from flexgui.session import Services, Session, Topic
from flexgui.session.latest import CREW, TURNS
from flexgui.session.state import STAGES, Part

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

    def __init__(self, context: PageContext) -> None:
        self.context = context
        gui = context.gui
        self._layout = PageLayout(context.client)
        fresh_paper(gui)
        others = set(gui._gui_input_handle_from_uuid)
        gui.set_panel_label("FlexGUI")
        gui.main_panel.dock_right()
        self._docked = (PLOTS, CONTROLS)
        gui.main_panel.set_width(CONTROLS)
        kinds = classes_of("flexgui.panels", Panel)
        self._panels: dict[str, Panel] = {stage: kinds[stage](context) for stage in STAGES}
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
        if context.session.view is None:
            context.session.refresh_live()
        if context.session.playback is None:
            context.session.refresh_playback()

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
        due = not self.context.session.cursor.playing or now - self._cursor_drawn > CURSOR_INTERVAL
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
        if self._behind_curtain and self.context.session.view is not None:
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


log = logging.getLogger(__name__)


STREAMED = frozenset({Topic.RUN, Topic.DIAGNOSIS, Topic.STUDY, Topic.SCENARIO})
"""What may wait a little: a job's news, and an edit, whose result follows as another topic."""
INTERVAL = 0.25
"""s between two drawings of what streams: a browser that draws without a pause hears no click."""
SLOWEST = 1.0
"""s, the same of what has streamed for long: a search of minutes is not looked at four times each
second, and a browser without a graphics card has a moment for a click."""
LONG = 5.0
"""s of streaming after which the pause is twice as long."""
REST = 0.4
"""s without a change, twice what a hand on a slider pauses, until what takes long is drawn too."""


class Painter:
    """Collects topics and gives them to `draw`, several changes of one kind as one; calls `settle`
    once they pause."""

    def __init__(
        self,
        draw: Callable[[frozenset[Topic]], None],
        settle: Callable[[], None],
        at_rest: Callable[[], bool],
    ) -> None:
        """`at_rest` says whether no change is being computed."""
        self._draw, self._settle, self._at_rest = draw, settle, at_rest
        self._news = threading.Condition()
        self._dirty: set[Topic] = set()
        self._busy = self._closed = False
        self._streamed = 0.0
        """When what streams was drawn last."""
        self._since = 0.0
        """Since when it streams without a longer pause."""

    def mark(self, topic: Topic) -> None:
        """Returns at once."""
        with self._news:
            if self._closed:
                return
            self._dirty.add(topic)
            self._news.notify()
            if self._busy:
                return
            self._busy = True
        CREW.run(self._run)

    def close(self) -> None:
        """Draws nothing more."""
        with self._news:
            self._closed = True
            self._news.notify()

    def _run(self) -> None:
        unsettled = False
        while (dirty := self._next(unsettled)) is not None:
            if dirty & STREAMED:
                self._note_streamed(time.monotonic())
            try:
                with TURNS.end():
                    if dirty:
                        self._draw(dirty)
                    else:
                        self._settle()
            except Exception:
                if not self._closed:
                    log.exception("Drawing %s failed", sorted(topic.value for topic in dirty))
            unsettled = bool(dirty)

    def _next(self, unsettled: bool) -> frozenset[Topic] | None:
        """What is to be drawn, when it is time; empty where changes pause, None where nothing is
        to be done."""
        with self._news:
            if unsettled:
                self._news.wait_for(lambda: self._closed or self._dirty, REST)
                unsettled = self._at_rest()
            while not self._closed and (pause := self._pause()):
                self._news.wait(pause)
            dirty, self._dirty = frozenset(() if self._closed else self._dirty), set()
            self._busy = bool(dirty) or (unsettled and not self._closed)
            return dirty if self._busy else None

    def _note_streamed(self, now: float) -> None:
        if now - self._streamed > 2.0 * SLOWEST:
            self._since = now
        self._streamed = now

    def _pause(self) -> float:
        """s until what has changed is to be drawn."""
        if not self._dirty or self._dirty - STREAMED:
            return 0.0
        interval = INTERVAL
        if Topic.SCENARIO not in self._dirty:  # an edit waits no longer than at first
            streaming = self._streamed - self._since
            interval = min(INTERVAL * (1.0 + streaming / LONG), SLOWEST)
        return max(self._streamed + interval - time.monotonic(), 0.0)
