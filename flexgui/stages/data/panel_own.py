"""A person's own recordings: of which kind of rig they are, and whether they come instead of those
that stand or beside them."""

from __future__ import annotations

from functools import partial
from typing import Any

from flexgui.page.panel import PageContext, Piece
from flexgui.page.widgets import Words, bind, button, choice, words_of
from flexgui.session.edit import put
from flexgui.stages.data.rigs import CONSTANTS, RIGS, arm_choices, rig_of

WORDS = words_of("data")
TOP = -1.0
"""Order of what stands above all else in the panel: a question waits. viser counts from 0."""
MEGA = 1e6
FORMATS = (
    "CSV, Parquet, MAT, HDF5, TDMS, MDF4, MCAP, ROS 2 db3 or NPZ, several at once; or a scenario "
    "(TOML, or its zip). At most {:.0f} MB each."
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


class Arrivals(Piece):
    """Asks how imported files are used; restores what they replaced."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        imports = self.session.recordings.imports
        self._folder = self.gui.add_folder("Imported file", order=TOP, visible=False)
        with self._folder:
            self._lead = Words(self.gui)
            self._alone = button(
                context, "Use it alone", partial(imports.use, alone=True), prominent=True
            )
            self._beside = button(context, "Add", partial(imports.use, alone=False))
            self._leave = button(context, "Cancel import", imports.cancel)
            self._back = button(context, "Restore", imports.restore)

    def refresh(self) -> None:
        """Hidden where there is nothing to say."""
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


OTHER = "Another one (see the scenario)"
OWN = "One of its own (see the scenario)"


class RigChoice(Piece):
    """Asked first: it says which signals a file must hold."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        recordings, arms = self.session.recordings, arm_choices()
        choice(
            context, "Rig", (*(rig.title for rig in RIGS), OTHER), self._title,
            recordings.choose_rig, "What drives the joints, and what of it was recorded.",
        )  # fmt: skip
        choice(
            context, "Arm", (*arms, OWN), self._arm,
            lambda name: recordings.choose_arm(arms.get(name, "")),
            "Its values can be changed in the stage Arm.",
        )  # fmt: skip
        self._fields = {name: self._field(name, label) for name, label in CONSTANTS.items()}

    def _title(self) -> str:
        rig = rig_of(self.session.document.scenario)
        return OTHER if rig is None else rig.title

    def _arm(self) -> str:
        preset = self.session.document.scenario.arm.preset
        return next((name for name, known in arm_choices().items() if known == preset), OWN)

    def _field(self, name: str, label: str) -> Any:
        hint = "One per joint, as on the motor's data sheet."
        field = self.gui.add_text(label, "", hint=hint, visible=False)
        return bind(self.context, field, partial(self._shown, name), partial(self._put, name))

    def _shown(self, name: str) -> str:
        values = self.session.document.scenario.drive.options.get(name) or ()
        return ", ".join(f"{x:g}" for x in values)

    def _put(self, name: str, text: str) -> bool:
        """A text that is no list of numbers changes nothing."""
        try:
            values = [float(part) for part in text.replace(";", ",").split(",")]
        except ValueError:
            return False
        return self.session.document.change(put(("drive", name), values))

    def refresh(self) -> None:
        """Only what the rig has is shown."""
        options = self.session.document.scenario.drive.options
        for name, field in self._fields.items():
            field.visible = bool(options.get(name))
