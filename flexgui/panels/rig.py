"""Which kind of rig the files come from, and the constants of its motors."""

from __future__ import annotations

from typing import Any

from flexgui.panels import widgets
from flexgui.panels.page_context import PageContext
from flexgui.session.edit import put
from flexgui.session.rigs import CONSTANTS, RIGS, arm_choices, rig_of

OTHER = "Another one (see the scenario)"
OWN = "One of its own (see the scenario)"


class RigChoice:
    """Asked first: it says which signals a file must hold."""

    def __init__(self, desk: PageContext) -> None:
        self._desk = desk
        titles = tuple(rig.title for rig in RIGS)
        widgets.choice(
            desk, "Rig", (*titles, OTHER), self._title,
            lambda title: desk.session.choose_rig(title) if title != OTHER else False,
            "What drives the joints, and what of it was recorded.",
        )  # fmt: skip
        arms = arm_choices()
        widgets.choice(
            desk, "Arm", (*arms, OWN), self._arm,
            lambda name: desk.session.choose_arm(arms[name]) if name in arms else False,
            "Its values can be changed in the stage Arm.",
        )  # fmt: skip
        self._fields = {name: self._field(name, label) for name, label in CONSTANTS.items()}

    def _title(self) -> str:
        rig = rig_of(self._desk.session.scenario)
        return OTHER if rig is None else rig.title

    def _arm(self) -> str:
        preset = self._desk.session.scenario.arm.preset
        return next((name for name, known in arm_choices().items() if known == preset), OWN)

    def _field(self, name: str, label: str) -> Any:
        desk = self._desk
        handle = desk.gui.add_text(
            label, "", hint="One per joint, as on the motor's data sheet.", visible=False
        )
        return widgets.bind(desk, handle, lambda: self._shown(name), lambda v: self._put(name, v))

    def _shown(self, name: str) -> str:
        values = self._desk.session.scenario.drive.options.get(name) or ()
        return ", ".join(f"{x:g}" for x in values)

    def _put(self, name: str, text: str) -> bool:
        """A text that is no list of numbers changes nothing."""
        try:
            values = [float(part) for part in text.replace(";", ",").split(",")]
        except ValueError:
            return False
        return self._desk.session.change(put(("drive", name), values))

    def refresh(self) -> None:
        """Only what the rig has is shown."""
        options = self._desk.session.scenario.drive.options
        for name, field in self._fields.items():
            visible = bool(options.get(name))
            if field.visible != visible:
                field.visible = visible
