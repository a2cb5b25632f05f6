"""The joint torque that the model lacks: along the time-line, and as a cloud over the speed."""

from __future__ import annotations

from core.results import MissingTorque
from flexgui.panels.page_context import PageContext
from flexgui.panels.plot import Plot
from flexgui.panels.words import Words, paragraph
from flexgui.views.missing_torque import missing_cloud, missing_curve

SAID = (
    "The torque that the drive delivers beyond what the model needs for the measured motion. Over "
    "the speed: a step at zero is dry friction, a slope viscous friction, a cloud without shape is "
    "noise."
)
NONE = (
    "No missing torque is known for this recording: press Find what is missing first. It needs a "
    "working point (or a torque rig), since it is computed with the model linearised there."
)


class Missing:
    """Hidden unless it was asked for."""

    def __init__(self, desk: PageContext) -> None:
        self._desk = desk
        self._words = Words(desk.gui)
        self._curve, self._cloud = Plot(desk.gui, 0.75), Plot(desk.gui, 0.75)
        self._drawn: tuple[MissingTorque, ...] | None = None

    def refresh(self, torques: tuple[MissingTorque, ...] | None) -> None:
        """None hides it; an empty tuple says why there is nothing."""
        self._words.show("" if torques is None else paragraph(SAID if torques else NONE, "soft"))
        if not torques:
            self._drawn = None
            self._curve.show(None)
            self._cloud.show(None)
            return
        if torques is not self._drawn:
            self._drawn = torques
            self._curve.show(missing_curve(torques), self._cursor())
            self._cloud.show(missing_cloud(torques))

    def _cursor(self) -> float | None:
        if not self._drawn:
            return None
        return float(self._drawn[0].time[0]) + self._desk.session.cursor.time

    def move_cursor(self) -> None:
        """The time-line's cursor moved."""
        if self._drawn:
            self._curve.move_cursor(self._cursor())
