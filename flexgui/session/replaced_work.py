"""The work that another scenario has replaced, to go back to with one press."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from flexgui.core.scenario.schema import Scenario
from flexgui.library.shipped import EMBEDDED
from flexgui.session.state import Topic
from flexgui.stages.challenge.state import Challenge

if TYPE_CHECKING:
    from flexgui.session.session import Session


@dataclass(frozen=True)
class Work:
    """A scenario as it was left; what was found with it is among the session's models."""

    scenario: Scenario
    own_files: tuple[str, ...] = ()
    challenge: Challenge | None = None


class ReplacedWork:
    """Keeps what is replaced by a scenario, a hidden effect, own recordings or another rig."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self.left: Work | None = None
        """What was replaced last; None where nothing would be lost."""

    def keep(self) -> None:
        """Keeps the present work, which is about to be replaced, unless nothing was done to it."""
        session, imports = self._session, self._session.recordings.imports
        scenario, challenge = session.document.scenario, session.challenge.state
        found = any(m.version.scenario == scenario for m in session.diagnosis.models.all)
        as_begun = any(scenario == made() for made in EMBEDDED.values())
        if found or challenge is not None or not as_begun:
            files = tuple(sorted(imports.own_files))
            self.left = Work(scenario, files, challenge)

    def back(self) -> bool:
        """Makes the replaced work the present one again, and keeps the present one in its turn."""
        session, work = self._session, self.left
        if work is None:
            return False
        self.left = None
        session.start_with(work.scenario)
        with session.lock:
            session.recordings.imports.own_files = frozenset(work.own_files)
            session.challenge.go_on(work.challenge)
        session.notify(Topic.SCENARIO, Topic.RECORDINGS, Topic.CHALLENGE)
        session.show_message(f"Back to: {work.scenario.title}.")
        return True

    def forget(self) -> None:
        """Offers it no longer."""
        with self._session.changing(Topic.SCENARIO):
            self.left = None
