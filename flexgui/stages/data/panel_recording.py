"""The chosen recording: its role, what of it counts, how its file is to be read, and what the check
says of it."""

from __future__ import annotations

import math
from typing import Any

from markupsafe import Markup

from flexgui.core.check.finding import Finding
from flexgui.core.recording.spec import RecordingSpec
from flexgui.page import widgets
from flexgui.page.panel import PageContext
from flexgui.page.widgets import Words, joined, paragraph
from flexgui.session import Session
from flexgui.session.edit import Document, put, recording
from flexgui.views.preview import finding_words, lines_applied

ROLES = ("estimate", "validate")


class OneRecording:
    """Fields that change the scenario's entry of the recording under the cursor."""

    def __init__(self, context: PageContext) -> None:
        self._context = context
        self._ends: tuple[float, float] | None = None
        gui = context.gui
        widgets.choice(
            context, "Role", ROLES, lambda: self._spec.role, lambda v: self._put(v, "role"),
            "estimate: fitted; validate: only compared.",
        )  # fmt: skip
        with gui.add_folder("Exclude a time range", expand_by_default=False):
            self._channel = gui.add_dropdown("Column", ("z1",))
            self._stretch = gui.add_vector2("From, to [s]", (0.0, 0.5), step=0.01)
            widgets.button(context, "Mask this time range", self._mask)
            widgets.button(context, "Remove all masks", lambda: self._put(None, "mask"))
        self._file = gui.add_folder("Correct the file", expand_by_default=False)
        with self._file:
            self._file_controls()
        widgets.button(context, "Remove this recording", self._remove)

    def _file_controls(self) -> None:
        context, gui = self._context, self._context.gui
        self._window: Any = gui.add_vector2("Window [s]", (0.0, 1.0), step=0.01)
        widgets.button(context, "Keep only this window", self._trim)
        widgets.button(context, "Keep everything", lambda: self._put(None, "window"))
        widgets.number(
            context, "Camera delay [ms]", lambda: 1e3 * self._spec.time_shift,
            lambda v: self._put(1e-3 * v, "time_shift"), -1000.0, 1000.0, 0.1,
            "How much too late the camera's samples are recorded.",
        )  # fmt: skip
        origin = gui.add_vector2(
            "Camera at [m]", self._spec.camera.origin, step=0.001, hint="Origin of its frame."
        )
        widgets.bind(
            context, origin, lambda: self._spec.camera.origin,
            lambda v: self._put([float(x) for x in v], "camera", "origin"),
        )  # fmt: skip
        widgets.number(
            context, "Camera rotation [deg]", lambda: math.degrees(self._spec.camera.angle),
            lambda v: self._put(math.radians(v), "camera", "angle"), -360.0, 360.0, 0.1,
        )  # fmt: skip
        widgets.number(
            context, "Camera scale", lambda: self._spec.camera.scale,
            lambda v: self._put(float(v), "camera", "scale"), 1e-6, 1e6, 0.001,
        )  # fmt: skip
        widgets.button(
            context,
            "Choose its columns …",
            lambda: context.session.recordings.choose_columns(self._spec.name),
        )
        self._gained = gui.add_dropdown("Column", ("z1",))
        self._gain = gui.add_number("Gain", 1.0, step=0.01)
        self._negative = gui.add_checkbox("Invert sign", False)
        widgets.button(context, "Apply gain and sign", self._scale)

    @property
    def _index(self) -> int:
        session = self._context.session
        names = [spec.name for spec in session.document.scenario.recordings]
        return (
            names.index(session.playback.cursor.recording)
            if session.playback.cursor.recording in names
            else 0
        )

    @property
    def _spec(self) -> RecordingSpec:
        specs = self._context.session.document.scenario.recordings
        return specs[self._index] if specs else RecordingSpec(file="-")

    def _put(self, value: Any, *path: str) -> bool:
        session = self._context.session
        return bool(session.document.scenario.recordings) and session.document.change(
            put(recording(self._index, *path), value)
        )

    def _mask(self) -> bool:
        channel = str(self._channel.value)
        stretch = [float(v) for v in self._stretch.value]
        known = [list(pair) for pair in self._spec.mask.get(channel, ())]
        return self._put([*known, stretch], "mask", channel)

    def _trim(self) -> bool:
        return self._put([float(v) for v in self._window.value], "window")

    def _scale(self) -> bool:
        channel = str(self._gained.value)
        known = self._spec.columns.get(channel)
        column = {
            "name": known.name if known else channel,
            "gain": float(self._gain.value),
            "sign": -1 if self._negative.value else 1,
        }
        return self._put(column, "columns", channel)

    def _remove(self) -> bool:
        index, session = self._index, self._context.session
        if not session.document.scenario.recordings:
            return False

        def edit(document: Document) -> None:
            document["recordings"].pop(index)

        return session.document.change(edit)

    def refresh(self) -> None:
        """Columns and limits of the recording that is shown now."""
        found = self._context.session.playback.recording
        self._file.visible = self._spec.simulate is None
        if found is None:
            return
        ends = (round(float(found.time[0]), 4), round(float(found.time[-1]), 4))
        if ends != self._ends:
            self._ends = ends
            self._window.value = ends
        names = tuple(sorted(found.channels))
        for dropdown in (self._channel, self._gained):
            if dropdown.options != names:
                dropdown.options = names


MOST = 5
"""Findings that are shown of one recording: as many as fit one screen with their pictures. Faults
hide one another, so what comes sixth is worth a look once the first are mended."""


class FindingList:
    """A folder with a place for each finding; places that are not needed are hidden."""

    def __init__(self, context: PageContext) -> None:
        self._context, gui = context, context.gui
        self._found: tuple[Finding, ...] = ()
        self._folder = gui.add_folder("Check of this recording")
        with self._folder:
            self._lead = Words(gui)
            self._places = [self._place(k) for k in range(MOST)]
            self._applied = Words(gui)
            self._look = widgets.button(
                context, "Check the recordings", lambda: context.session.check.start(),
                hint="Units, signs, swapped joints, delays, gaps, clipped or dead channels, …",
            )  # fmt: skip

    def _place(self, k: int) -> tuple[Words, Any]:
        words = Words(self._context.gui)
        return words, widgets.button(self._context, "Mend", lambda: self._mend(k))

    def _mend(self, k: int) -> None:
        if k < len(self._found):
            self._context.session.check.mend(self._found[k])

    def refresh(self, recording: str) -> None:
        """Of the recording that is shown."""
        session = self._context.session
        self._found = session.check.findings_of(recording)
        self._folder.visible = bool(session.document.scenario.recordings)
        lead = _lead(session, recording, len(self._found))
        self._lead.show(paragraph(lead, _look(session, self._found)))
        for k, (words, mend) in enumerate(self._places):
            one = self._found[k] if k < len(self._found) else None
            words.show(finding_words(one) if one is not None else "")
            can = one is not None and one.mend is not None
            if mend.visible != can:
                mend.visible = can
            if one is not None and can:
                mend.label = f"Mend {one.channel}"
        lines = session.check.mended.get(recording, ())
        more = len(self._found) - MOST
        rest = paragraph(f"{more} more follow once these are mended.", "soft") if more > 0 else ""
        self._applied.show(joined(rest, lines_applied(lines)) if rest or lines else Markup(""))
        done = session.check.running or session.check.is_checked
        self._look.label = "Checking …" if session.check.running else "Check the recordings"
        self._look.visible = not done or session.check.running


def _lead(session: Session, recording: str, count: int) -> str:
    if session.check.running:
        return "The recordings are being checked."
    if not session.check.is_checked:
        return "Not checked yet."
    if not session.check.was_looked_at(recording):
        return "Simulated by the model; the recordings from files were checked."
    if not count:
        return "The check finds nothing wrong with this recording."
    return "One finding." if count == 1 else f"{count} findings."


def _look(session: Session, found: tuple[Finding, ...]) -> str:
    return "lead" if found and not session.check.running else "soft"


def wording_of(session: Session, recording: str) -> str:
    """One word for the list of recordings."""
    if not session.check.is_checked or not session.check.was_looked_at(recording):
        return "…" if session.check.running else ""
    count = len(session.check.findings_of(recording))
    return "good" if not count else f"{count} finding{'s' if count > 1 else ''}"
