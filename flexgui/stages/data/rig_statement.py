"""What a person states of the rig: the filled-in data sheet, and whether one is still asked for."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import msgspec

from flexgui.core.arm.arm import MOST_SEGMENTS
from flexgui.core.arm.presets import presets
from flexgui.core.errors import InputError
from flexgui.session.scenario_edits import Edit, apply_edits, cached_model
from flexgui.session.state import Topic
from flexgui.stages.data.rig_sheet import estimated, is_stated, sheet_edit, with_links
from flexgui.stages.data.rigs import RIGS, arm_edit, rig_edit, rig_of

if TYPE_CHECKING:
    from flexgui.session.session import Session


class RigStatement:
    """Takes the entries of the data sheet; keeps refused ones, so that nobody types them again."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self.refused: Mapping[str, str] = {}
        """Field -> text, of entries that were not taken."""
        self.complaint = ""
        """Why they were not taken."""

    def reset(self) -> None:
        """Another scenario follows."""
        self.refused, self.complaint = {}, ""

    @property
    def is_asked(self) -> bool:
        """Whether a person's recordings stand beside an arm that is only an example."""
        scenario = self._session.document.scenario
        own = self._session.recordings.imports.own_files
        files = {spec.file for spec in scenario.recordings if spec.file is not None}
        # Whoever brought a scenario with recordings has stated the rig in it.
        return bool(files) and files <= own and not is_stated(scenario)

    def state(self, entries: str) -> bool:
        """Takes a sheet's entries, JSON of field -> text; they are as long as a sheet at most."""
        try:
            texts = msgspec.json.decode(entries, type=dict[str, str])
        except msgspec.MsgspecError:
            return False
        document, session = self._session.document, self._session
        try:
            edit = sheet_edit(document.scenario, texts)
            arm = cached_model(apply_edits(document.scenario, edit)).arm
        except InputError as error:
            with session.changing(Topic.RECORDINGS):
                self.refused, self.complaint = texts, str(error)
            return False
        if not self._become(edit):
            return False
        lengths = ", ".join(f"{segment.length:g} m" for segment in arm.segments)
        free = estimated(document.scenario)
        rest = f" A fit estimates the {free}; all else holds as stated." if free else ""
        session.show_message(f"The rig is stated: {lengths}.{rest}")
        return True

    def choose_kind(self, title: str) -> bool:
        """Changes the kind of rig."""
        scenario = self._session.document.scenario
        rig = next((r for r in RIGS if r.title == title), None)
        if rig is None or rig == rig_of(scenario):
            return False
        self._session.replaced.keep()
        return self._become(rig_edit(scenario, rig))

    def choose_arm(self, preset: str) -> bool:
        """Uses a supplied arm."""
        scenario = self._session.document.scenario
        if preset not in presets() or preset == scenario.arm.preset:
            return False
        self._session.replaced.keep()
        return self._become(arm_edit(scenario, preset))

    def choose_links(self, count: str) -> bool:
        """Gives the arm another number of links."""
        if count not in map(str, range(1, MOST_SEGMENTS + 1)):
            return False
        self._session.replaced.keep()
        return self._become(with_links(self._session.document.scenario, int(count)))

    def _become(self, edit: Edit) -> bool:
        """Another rig: what was typed for the one before does not count."""
        changed = self._session.document.change(edit)
        if changed:
            self.reset()
            self._session.recordings.rig_changed()
        return changed
