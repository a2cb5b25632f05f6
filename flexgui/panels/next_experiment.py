"""What to record next: the limits of the rig, the time there is, and the files to play."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from core.errors import InputError
from flexgui.panels import widgets
from flexgui.panels.page_context import PageContext
from flexgui.panels.words import Words, joined, paragraph
from flexgui.session.bundle import recordings_of, zipped_folder

TITLE = "Next experiment"
ABOUT = (
    "References that the rig can play within its limits, chosen so that the parameters become "
    "known best. Leave a limit empty to stay within what was recorded."
)
SECONDS = (1.0, 3600.0)

LIMITS = {
    "speed": ("Speed limits", "Per joint, by commas: 0.5, 0.8 rad/s (m/s on a slide)."),
    "torque": ("Torque limits", "Per joint, by commas: 40, 20 N m (N on a slide)."),
}


class NextExperiment:
    """A folder of the controls."""

    def __init__(self, desk: PageContext, send: Callable[[str, bytes], None]) -> None:
        self._desk, self._send, self._seconds = desk, send, 60.0
        with desk.gui.add_folder(TITLE, expand_by_default=False):
            Words(desk.gui).show(paragraph(ABOUT, "soft"))
            widgets.number(
                desk, "Time (s)", lambda: self._seconds, self._wait, *SECONDS,
                hint="That you have, for all experiments together.",
            )  # fmt: skip
            self._fields = {
                key: desk.gui.add_text(label, "", hint=hint)
                for key, (label, hint) in LIMITS.items()
            }
            self._button = widgets.button(desk, "Plan and download (zip)", self._plan)
            self._said = Words(desk.gui)

    def refresh(self) -> None:
        """As the session stands."""
        session = self._desk.session
        able = bool(session.scenario.recordings) and not session.busy
        self._button.disabled = not able or self._desk.read_only
        for field in self._fields.values():
            field.disabled = self._desk.read_only
        self._said.show(joined(*(paragraph(text) for text in session.planned)))

    def _wait(self, seconds: float) -> None:
        self._seconds = float(seconds)

    def _plan(self) -> None:
        session = self._desk.session
        try:
            limits = {
                key: _numbers(LIMITS[key][0], field.value)
                for key, field in self._fields.items()
                if field.value.strip()
            }
        except InputError as error:
            session.show_message(str(error), bad=True)
            return
        session.plan_next(self._desk.services, self._seconds, limits, self._download)

    def _download(self, folder: Path) -> None:
        session = self._desk.session
        try:
            beside = recordings_of(session.scenario, session.folder)
        except InputError:  # a file that is gone: what to play is still worth having
            beside = {}
        self._send("next_experiment.zip", zipped_folder(folder, beside))


def _numbers(label: str, text: str) -> list[float]:
    try:
        return [float(part) for part in text.replace(";", ",").split(",") if part.strip()]
    except ValueError:
        message = f"{label}: write a number per joint, by commas: 0.5, 0.8."
        raise InputError(message) from None
