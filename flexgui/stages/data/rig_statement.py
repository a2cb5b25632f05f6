"""What a person states of the rig: the filled-in data sheet, and whether one is still asked for."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import msgspec

from flexgui.core.arm.build import build_arm
from flexgui.core.errors import InputError
from flexgui.session.scenario_edits import apply_edits, cached_model
from flexgui.session.state import Topic
from flexgui.stages.data.rig_sheet import is_stated, sheet_edit, with_links

if TYPE_CHECKING:
    from flexgui.session.session import Session

MOST_LINKS = 3


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
        files = {spec.file for spec in scenario.recordings}
        return bool(files & own) and not is_stated(scenario)

    def state(self, entries: str) -> bool:
        """Takes a sheet's entries, JSON of field -> text; they are as long as a sheet at most."""
        try:
            texts = msgspec.json.decode(entries, type=dict[str, str])
        except msgspec.MsgspecError:
            return False
        document, session = self._session.document, self._session
        try:
            edit = sheet_edit(document.scenario, texts)
            cached_model(apply_edits(document.scenario, edit))
        except InputError as error:
            with session.changing(Topic.RECORDINGS):
                self.refused, self.complaint = texts, str(error)
            return False
        self.reset()
        if not document.change(edit):
            return False
        session.recordings.rig_changed()
        arm = build_arm(document.scenario.arm)
        lengths = ", ".join(f"{segment.length:g} m" for segment in arm.segments)
        session.show_message(f"The rig is stated: {lengths}.")
        return True

    def choose_links(self, count: str) -> bool:
        """Gives the arm another number of links."""
        if count not in map(str, range(1, MOST_LINKS + 1)):
            return False
        scenario = self._session.document.scenario
        if not self._session.document.change(with_links(scenario, int(count))):
            return False
        self.reset()
        self._session.recordings.rig_changed()
        return True
