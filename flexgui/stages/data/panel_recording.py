"""The chosen recording: role, counted samples, columns, and findings of the check."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from operator import attrgetter
from typing import Any

from flexgui.core.check.finding import Finding
from flexgui.core.recording.channels import from_camera
from flexgui.core.recording.spec import CameraSpec, RecordingSpec
from flexgui.page.panel import PageContext, PageElement
from flexgui.page.widgets import HtmlBlock, bind, button, choice, number, set_options
from flexgui.sentences.written import reference_symbol
from flexgui.session.scenario_edits import ScenarioDict, recording_path, set_value
from flexgui.session.session import Session
from flexgui.stages.data.panel_own import WORDS
from flexgui.views.preview import finding_html, lines_applied

ROLES = ("estimate", "validate")


class RecordingSettings(PageElement):
    """Fields for the scenario's entry of the recording at the cursor."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self._ends: tuple[float, float] | None = None
        gui = self.gui
        choice(
            context, "Role", ROLES, *self._setting("role"),
            "estimate: fitted; validate: only compared.",
        )  # fmt: skip
        self._shift = number(
            context, "Camera delay [ms]", (-1000.0, 1000.0, 0.1),
            *self._setting("time_shift", unit=1e-3),
            "Camera latency of this recording.",
        )  # fmt: skip
        self._touched = HtmlBlock(gui)
        with gui.add_folder("Exclude a time range", expand_by_default=False):
            self._channel: Any = gui.add_dropdown("Column", ("z1",))
            self._stretch = gui.add_vector2("From, to [s]", (0.0, 0.5), step=0.01)
            button(context, "Mask this time range", self._mask)
            button(context, "Remove all masks", lambda: self._put(None, "mask"))
        self._file = gui.add_folder("Correct the file", expand_by_default=False)
        with self._file:
            self._file_controls()
        button(context, "Remove this recording", self._remove)

    def _file_controls(self) -> None:
        context, gui = self.context, self.gui
        self._window: Any = gui.add_vector2("Window [s]", (0.0, 1.0), step=0.01)
        button(
            context, "Keep only this window",
            lambda: self._put([float(v) for v in self._window.value], "window"),
        )  # fmt: skip
        button(context, "Keep everything", lambda: self._put(None, "window"))
        origin = gui.add_vector2(
            "Camera at [m]", self._spec.camera.origin, step=0.001, hint="Origin of its frame."
        )
        bind(
            context, origin, lambda: self._spec.camera.origin,
            lambda v: self._put([float(x) for x in v], "camera", "origin"),
        )  # fmt: skip
        number(
            context, "Camera rotation [deg]", (-360.0, 360.0, 0.1),
            *self._setting("camera", "angle", unit=math.pi / 180.0),
        )  # fmt: skip
        number(
            context, "Camera scale", (1e-6, 1e6, 0.001), *self._setting("camera", "scale", unit=1.0)
        )
        button(
            context, "Choose its columns …",
            lambda: self.session.recordings.choose_columns(self._spec.name),
        )  # fmt: skip

    def _setting(
        self, *path: str, unit: float | None = None
    ) -> tuple[Callable[[], Any], Callable[[Any], bool]]:
        """Functions that read and write an entry; a `unit` scales the number shown."""
        read = attrgetter(".".join(path))
        if unit is None:
            return lambda: read(self._spec), lambda value: self._put(value, *path)
        return lambda: round(read(self._spec) / unit, 9), lambda value: self._put(
            value * unit, *path
        )

    @property
    def _index(self) -> int:
        names = [spec.name for spec in self.session.document.scenario.recordings]
        shown = self.session.playback.cursor.recording
        return names.index(shown) if shown in names else 0

    @property
    def _spec(self) -> RecordingSpec:
        specs = self.session.document.scenario.recordings
        return specs[self._index] if specs else RecordingSpec(file="-")

    def _put(self, value: Any, *path: str) -> bool:
        document = self.session.document
        edit = set_value(recording_path(self._index, *path), value)
        return bool(document.scenario.recordings) and document.change(edit)

    def _mask(self) -> bool:
        channel = str(self._channel.value)
        stretch = [float(v) for v in self._stretch.value]
        ranges = [list(pair) for pair in self._spec.mask.get(channel, ())]
        return self._put([*ranges, stretch], "mask", channel)

    def _remove(self) -> None:
        index, document = self._index, self.session.document

        def edit(changed: ScenarioDict) -> None:
            changed["recordings"].pop(index)

        if document.scenario.recordings:
            document.change(edit)

    def refresh(self) -> None:
        """Shows columns and limits of the current recording."""
        recording = self.session.playback.recording
        self._file.visible = self._spec.simulate is None
        self._touched.show(WORDS.touched(changes(self._spec)))
        seen = recording is not None and any(from_camera(name) for name in recording.channels)
        self._shift.visible = seen
        if recording is None:
            return
        ends = (round(float(recording.time[0]), 4), round(float(recording.time[-1]), 4))
        if ends != self._ends:
            self._ends = self._window.value = ends
        names = tuple(sorted(recording.channels))
        set_options(self._channel, names, self._channel.value)


def changes(spec: RecordingSpec) -> dict[str, list[str]]:
    """Channel -> changes that the scenario makes to it, as text; only changed channels."""
    changes_of: dict[str, list[str]] = {}
    for name, column in spec.columns.items():
        factor = f"× {column.factor:g}".replace("-", "−")
        changes_of[name] = [] if column.factor == 1.0 else [factor]
    for name, stretches in spec.mask.items():
        left_out = ", ".join(f"{a:g} to {b:g} s" for a, b in stretches)
        changes_of.setdefault(name, []).append(f"without {left_out}")
    for name in spec.logger_filter:
        changes_of.setdefault(name, []).append("behind the logger's low-pass")
    camera = [f"{1e3 * spec.time_shift:g} ms earlier"] if spec.time_shift else []
    camera += [] if spec.camera == CameraSpec() else ["turned, moved or scaled as a whole"]
    for name in ("z1", "z2") if camera else ():
        changes_of.setdefault(name, []).extend(camera)
    return {reference_symbol(name): words for name, words in changes_of.items() if words}


MOST_FINDINGS = 5
"""Findings shown at once, as many as fit a screen; faults hide one another, so more follow."""


class FindingList(PageElement):
    """The findings about a recording, each with its button."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self._found: tuple[Finding, ...] = ()
        self._folder = self.gui.add_folder("Check of this recording")
        with self._folder:
            self._lead = HtmlBlock(self.gui)
            self._places = [
                (
                    HtmlBlock(self.gui),
                    button(context, "Correct", partial(self._mend, k)),
                    button(context, "Dismiss", partial(self._dismiss, k)),
                )
                for k in range(MOST_FINDINGS)
            ]
            self._applied = HtmlBlock(self.gui)
            self._look = button(
                context, "Check the recordings", self.session.check.start,
                hint="Units, signs, swapped joints, delays, gaps, clipped or dead channels, …",
            )  # fmt: skip

    def _mend(self, k: int) -> None:
        if k < len(self._found):
            self.session.check.mend(self._found[k])

    def _dismiss(self, k: int) -> None:
        if k < len(self._found):
            self.session.check.dismiss(self._found[k])

    def refresh(self, recording: str) -> None:
        """Shows the findings about the current recording."""
        check = self.session.check
        self._found = check.findings_of(recording)
        self._folder.visible = bool(self.session.document.scenario.recordings)
        looked_at = check.was_checked(recording)
        asked = self.session.recordings.rig.is_asked
        self._lead.show(WORDS.check(check, looked_at, len(self._found), asked))
        for k, (words, mend, dismiss) in enumerate(self._places):
            finding = self._found[k] if k < len(self._found) else None
            words.show(finding_html(finding) if finding is not None else "")
            mend.visible = finding is not None and finding.fix is not None
            dismiss.visible = finding is not None
            if finding is not None:
                mend.label = f"Correct {finding.channel}"
        lines = lines_applied(check.mended.get(recording, ()))
        self._applied.show(WORDS.more(len(self._found) - MOST_FINDINGS), lines)
        self._look.visible = not (check.running or check.is_checked or asked)


def wording_of(session: Session, recording: str) -> str:
    """Result of the check in one word, for the list of recordings."""
    if not session.check.is_checked or not session.check.was_checked(recording):
        return "…" if session.check.running else ""
    count = len(session.check.findings_of(recording))
    return "good" if not count else f"{count} finding{'s' if count > 1 else ''}"
