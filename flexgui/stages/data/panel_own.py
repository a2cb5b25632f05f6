"""A person's own recordings: of which kind of rig they are, and whether they come instead of those
that stand or beside them."""

from __future__ import annotations

from typing import Any

from flexgui.page import widgets
from flexgui.page.panel import PageContext
from flexgui.page.widgets import Words, joined, paragraph
from flexgui.session import Services
from flexgui.session.edit import put
from flexgui.stages.data.rigs import CONSTANTS, RIGS, arm_choices, rig_of

TOP = -1.0
"""Order of what stands above all else in the panel: a question waits. viser counts from 0."""


class Arrivals:
    """Asks where something has arrived; brings back what made room."""

    def __init__(self, context: PageContext) -> None:
        self._context, gui = context, context.gui
        session = context.session
        self._folder = gui.add_folder("Imported file", order=TOP, visible=False)
        with self._folder:
            self._lead = Words(gui)
            self._alone = widgets.button(
                context,
                "Use it alone",
                lambda: session.recordings.use_arrived(alone=True),
                prominent=True,
            )
            self._beside = widgets.button(
                context, "Add", lambda: session.recordings.use_arrived(alone=False)
            )
            self._leave = widgets.button(
                context, "Cancel import", lambda: session.recordings.leave_arrived()
            )
            self._back = widgets.button(context, "Restore", lambda: session.recordings.bring_back())

    def refresh(self) -> None:
        """Hidden where there is nothing to say."""
        session = self._context.session
        arrived, count, aside = (
            session.recordings.arrived,
            len(session.document.scenario.recordings),
            session.recordings.aside,
        )
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
            self._lead.show(joined(*(paragraph(each.words) for each in arrived), question))
        else:
            self._lead.show(paragraph(_set_aside(len(aside)), "soft"))
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


OTHER = "Another one (see the scenario)"
OWN = "One of its own (see the scenario)"


class RigChoice:
    """Asked first: it says which signals a file must hold."""

    def __init__(self, context: PageContext) -> None:
        self._context, recordings = context, context.session.recordings
        titles = tuple(rig.title for rig in RIGS)
        widgets.choice(
            context, "Rig", (*titles, OTHER), self._title,
            lambda title: recordings.choose_rig(title) if title != OTHER else False,
            "What drives the joints, and what of it was recorded.",
        )  # fmt: skip
        arms = arm_choices()
        widgets.choice(
            context, "Arm", (*arms, OWN), self._arm,
            lambda name: recordings.choose_arm(arms[name]) if name in arms else False,
            "Its values can be changed in the stage Arm.",
        )  # fmt: skip
        self._fields = {name: self._field(name, label) for name, label in CONSTANTS.items()}

    def _title(self) -> str:
        rig = rig_of(self._context.session.document.scenario)
        return OTHER if rig is None else rig.title

    def _arm(self) -> str:
        preset = self._context.session.document.scenario.arm.preset
        return next((name for name, known in arm_choices().items() if known == preset), OWN)

    def _field(self, name: str, label: str) -> Any:
        context = self._context
        handle = context.gui.add_text(
            label, "", hint="One per joint, as on the motor's data sheet.", visible=False
        )
        return widgets.bind(
            context, handle, lambda: self._shown(name), lambda v: self._put(name, v)
        )

    def _shown(self, name: str) -> str:
        values = self._context.session.document.scenario.drive.options.get(name) or ()
        return ", ".join(f"{x:g}" for x in values)

    def _put(self, name: str, text: str) -> bool:
        """A text that is no list of numbers changes nothing."""
        try:
            values = [float(part) for part in text.replace(";", ",").split(",")]
        except ValueError:
            return False
        return self._context.session.document.change(put(("drive", name), values))

    def refresh(self) -> None:
        """Only what the rig has is shown."""
        options = self._context.session.document.scenario.drive.options
        for name, field in self._fields.items():
            visible = bool(options.get(name))
            if field.visible != visible:
                field.visible = visible
