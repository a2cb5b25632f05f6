"""Own recordings: the button that takes them, and whether they replace the present ones."""

from __future__ import annotations

from functools import partial
from typing import Any

from flexgui.page.actions import press
from flexgui.page.panel import PageContext, PageElement
from flexgui.page.widgets import HtmlBlock, button, stage_macros

WORDS = stage_macros("data", press=press)
TOP = -1.0
"""Order of what stands above all else in the panel: a question waits. viser counts from 0."""
MEGA = 1e6
FORMATS = (
    "CSV, Parquet, MAT, HDF5, TDMS, MDF4, MCAP, ROS 2 db3 or NPZ, several at once. Or a scenario "
    "(TOML or zip). At most {:.0f} MB each."
)


def upload_button(context: PageContext, label: str) -> None:
    """Takes files to the stage Data."""
    session = context.session

    def upload(event: Any) -> None:
        file = event.target.value
        session.show("Data")
        session.recordings.upload(file.name, file.content)

    hint = FORMATS.format(session.services.upload_limit_bytes / MEGA)
    made = context.gui.add_upload_button(label, hint=hint, color="gray")
    if not context.read_only:
        made.on_upload(upload)


class Arrivals(PageElement):
    """Asks how imported files are used."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        imports = self.session.recordings.imports
        self._folder = self.gui.add_folder("Imported file", order=TOP, visible=False)
        with self._folder:
            self._lead = HtmlBlock(self.gui)
            self._alone = button(
                context, "Use it alone", partial(imports.use, alone=True), prominent=True
            )
            self._beside = button(context, "Add", partial(imports.use, alone=False))
            button(context, "Cancel import", imports.cancel)

    def refresh(self) -> None:
        """Hides everything if there is nothing to ask."""
        pending = self.session.recordings.imports.pending
        count, one = len(self.session.document.scenario.recordings), len(pending) == 1
        present = f"the {count} present recordings" if count > 1 else "the present recording"
        self._alone.label = "Use it alone" if one else f"Use these {len(pending)} alone"
        self._beside.label = f"Add to {present}"
        self._lead.show(WORDS.arrivals(pending, present))
        self._folder.visible = bool(pending)
