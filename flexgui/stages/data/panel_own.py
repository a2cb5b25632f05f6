"""Own recordings: their kind of rig, and whether they replace the present ones."""

from __future__ import annotations

from functools import partial
from typing import Any

from markupsafe import Markup

from flexgui.core.scenario.schema import Scenario
from flexgui.page.actions import press, selection
from flexgui.page.panel import PageContext, PageElement
from flexgui.page.widgets import HtmlBlock, bind, button, joined, stage_macros
from flexgui.session.scenario_edits import set_value
from flexgui.stages.data.rigs import CONSTANTS, RIGS, arm_choices, rig_of

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
    """Asks how imported files are used, and restores what they replaced."""

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
            self._leave = button(context, "Cancel import", imports.cancel)
            self._back = button(context, "Restore", imports.restore)

    def refresh(self) -> None:
        """Hides everything if there is nothing to ask."""
        imports = self.session.recordings.imports
        pending, replaced = imports.pending, imports.replaced
        count, one = len(self.session.document.scenario.recordings), len(pending) == 1
        present = f"the {count} present recordings" if count > 1 else "the present recording"
        self._alone.label = "Use it alone" if one else f"Use these {len(pending)} alone"
        self._beside.label = f"Add to {present}"
        self._alone.visible = self._beside.visible = self._leave.visible = bool(pending)
        self._back.visible = bool(replaced) and not pending
        self._lead.show(WORDS.arrivals(pending, present, len(replaced)))
        self._folder.visible = bool(pending or replaced)


STATED = {"": "As the scenario states it"}
"""Of an arm or a rig that is none of the lists."""


def rig_choices(scenario: Scenario) -> Markup:
    """Dropdowns for rig and arm, which decide which signals a file must hold."""
    rig, preset = rig_of(scenario), scenario.arm.preset or ""
    rigs = {one.title: one.title for one in RIGS}
    arms = {choices: name for name, choices in arm_choices().items()}
    title = "" if rig is None else rig.title
    rows = (("Rig", "rig", rigs, title), ("Arm", "arm", arms, preset))
    return Markup("<div class='choices'>{}</div>").format(
        joined(*(
            selection(label, action, choices if value in choices else STATED | choices, value)
            for label, action, choices, value in rows
        ))
    )  # fmt: skip


class RigChoice(PageElement):
    """Rig, arm and the rig's constants, if no waiting file shows them."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        recordings = self.session.recordings
        context.actions.register("rig", recordings.choose_rig)
        context.actions.register("arm", recordings.choose_arm)
        self._rig = HtmlBlock(self.gui)
        self._fields = {name: self._field(name, label) for name, label in CONSTANTS.items()}

    def _field(self, name: str, label: str) -> Any:
        hint = "One per joint, as on the motor's data sheet."
        field = self.gui.add_text(label, "", hint=hint, visible=False)
        return bind(self.context, field, partial(self._shown, name), partial(self._put, name))

    def _shown(self, name: str) -> str:
        values = self.session.document.scenario.drive.options.get(name) or ()
        return ", ".join(f"{x:g}" for x in values)

    def _put(self, name: str, text: str) -> bool:
        """Stores a list of numbers; other text changes nothing."""
        try:
            values = [float(part) for part in text.replace(";", ",").split(",")]
        except ValueError:
            return False
        return self.session.document.change(set_value(("drive", name), values))

    def refresh(self) -> None:
        """Shows the constants of this rig."""
        scenario = self.session.document.scenario
        waits = self.session.recordings.waiting is not None
        self._rig.show("" if waits else rig_choices(scenario))
        options = scenario.drive.options
        for name, field in self._fields.items():
            field.visible = bool(options.get(name))
