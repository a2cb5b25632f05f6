"""What the check says of the chosen recording: pictures, and buttons where it can be mended."""

from __future__ import annotations

from typing import Any

from markupsafe import Markup

from core.check.finding import Finding
from flexgui.panels import widgets
from flexgui.panels.page_context import PageContext
from flexgui.panels.words import Words, joined, paragraph
from flexgui.session import Session
from flexgui.views.finding import finding_words, lines_applied

MOST = 5
"""Findings that are shown of one recording: as many as fit one screen with their pictures. Faults
hide one another, so what comes sixth is worth a look once the first are mended."""


class FindingList:
    """A folder with a place for each finding; places that are not needed are hidden."""

    def __init__(self, desk: PageContext) -> None:
        self._desk, gui = desk, desk.gui
        self._found: tuple[Finding, ...] = ()
        self._folder = gui.add_folder("Check of this recording")
        with self._folder:
            self._said = Words(gui)
            self._places = [self._place(k) for k in range(MOST)]
            self._applied = Words(gui)
            self._look = widgets.button(
                desk, "Check the recordings", lambda: desk.session.check_recordings(),
                hint="Units, signs, swapped joints, delays, gaps, clipped or dead channels, …",
            )  # fmt: skip

    def _place(self, k: int) -> tuple[Words, Any]:
        words = Words(self._desk.gui)
        return words, widgets.button(self._desk, "Mend", lambda: self._mend(k))

    def _mend(self, k: int) -> None:
        if k < len(self._found):
            self._desk.session.mend(self._found[k])

    def refresh(self, recording: str) -> None:
        """Of the recording that is shown."""
        session = self._desk.session
        self._found = session.findings_of(recording)
        self._folder.visible = bool(session.scenario.recordings)
        lead = _lead(session, recording, len(self._found))
        self._said.show(paragraph(lead, _look(session, self._found)))
        for k, (words, mend) in enumerate(self._places):
            one = self._found[k] if k < len(self._found) else None
            words.show(finding_words(one) if one is not None else "")
            can = one is not None and one.mend is not None
            if mend.visible != can:
                mend.visible = can
            if one is not None and can:
                mend.label = f"Mend {one.channel}"
        lines = session.mended.get(recording, ())
        more = len(self._found) - MOST
        rest = paragraph(f"{more} more follow once these are mended.", "soft") if more > 0 else ""
        self._applied.show(joined(rest, lines_applied(lines)) if rest or lines else Markup(""))
        done = session.checking or session.is_checked
        self._look.label = "Checking …" if session.checking else "Check the recordings"
        self._look.visible = not done or session.checking


def _lead(session: Session, recording: str, count: int) -> str:
    if session.checking:
        return "The recordings are being checked."
    if not session.is_checked:
        return "Not checked yet."
    if not session.was_looked_at(recording):
        return "Simulated by the model; the recordings from files were checked."
    if not count:
        return "The check finds nothing wrong with this recording."
    return "One finding." if count == 1 else f"{count} findings."


def _look(session: Session, found: tuple[Finding, ...]) -> str:
    return "lead" if found and not session.checking else "soft"


def wording_of(session: Session, recording: str) -> str:
    """One word for the list of recordings."""
    if not session.is_checked or not session.was_looked_at(recording):
        return "…" if session.checking else ""
    count = len(session.findings_of(recording))
    return "good" if not count else f"{count} finding{'s' if count > 1 else ''}"
