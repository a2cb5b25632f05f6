"""A person's own recordings: instead of those that stand, or beside them."""

from __future__ import annotations

from flexgui.panels import widgets
from flexgui.panels.page_context import PageContext
from flexgui.panels.words import Words, joined, paragraph
from flexgui.session import Services

TOP = -1.0
"""Order of what stands above all else in the panel: a question waits. viser counts from 0."""


class Arrivals:
    """Asks where something has arrived; brings back what made room."""

    def __init__(self, desk: PageContext) -> None:
        self._desk, gui = desk, desk.gui
        session = desk.session
        self._folder = gui.add_folder("Imported file", order=TOP, visible=False)
        with self._folder:
            self._said = Words(gui)
            self._alone = widgets.button(
                desk, "Use it alone", lambda: session.use_arrived(alone=True), prominent=True
            )
            self._beside = widgets.button(desk, "Add", lambda: session.use_arrived(alone=False))
            self._leave = widgets.button(desk, "Cancel import", lambda: session.leave_arrived())
            self._back = widgets.button(desk, "Restore", lambda: session.bring_back())

    def refresh(self) -> None:
        """Hidden where there is nothing to say."""
        session = self._desk.session
        arrived, count, aside = session.arrived, len(session.scenario.recordings), session.aside
        one = len(arrived) == 1
        present = f"the {count} present recordings" if count > 1 else "the present recording"
        self._alone.label = "Use it alone" if one else f"Use these {len(arrived)} alone"
        self._beside.label = f"Add to {present}"
        for each in (self._alone, self._beside, self._leave):
            each.visible = bool(arrived)
        self._back.visible = bool(aside) and not arrived
        if arrived:
            it = "it" if one else "them"
            question = paragraph(f"Use {it} alone, or add {it} to {present}?", "lead")
            self._said.show(joined(*(paragraph(each.words) for each in arrived), question))
        else:
            self._said.show(paragraph(_set_aside(len(aside)), "soft"))
        self._folder.visible = bool(arrived or aside)


def _set_aside(count: int) -> str:
    return f"{count} recordings were set aside." if count != 1 else "One recording was set aside."


MEGA = 1e6


def upload_hint(services: Services) -> str:
    """For the buttons that take a file."""
    limit = services.upload_limit_bytes / MEGA
    return (
        f"CSV, Parquet, MAT, HDF5, TDMS, MDF4, MCAP, ROS 2 db3 or NPZ, several at once; or a "
        f"scenario (TOML, or its zip). At most {limit:.0f} MB each."
    )
