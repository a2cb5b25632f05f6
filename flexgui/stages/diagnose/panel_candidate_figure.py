"""On Diagnose: the missing torque, or the residual that fails most, with the first candidate in it.

It opens by itself with the first ranking, stays while an effect is added, and shows on the same
axes what the effect has explained.
"""

from __future__ import annotations

from flexgui.core.effects import catalogue
from flexgui.core.results import MissingTorque
from flexgui.page.panel import PageContext, PageElement
from flexgui.page.plot import Plot
from flexgui.page.widgets import HtmlBlock
from flexgui.stages.diagnose.model_versions import ModelFindings, ModelVersion
from flexgui.stages.diagnose.panel_candidates import WORDS, inviting
from flexgui.stages.diagnose.plots import (
    BESIDE,
    cloud_caption,
    residual_caption,
    residual_figure,
    torque_cloud,
    worst_channel,
)
from flexgui.views.over_speed import OverSpeed

CLOUD, EACH, RESIDUAL = 280.0, 190.0, 240.0
"""px: two joints stand side by side, more below one another; all beside a ladder on a usual
screen."""


class CandidateFigure(PageElement):
    """One sentence and one figure."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self._words = HtmlBlock(self.gui)
        self._cloud, self._residual = Plot(context, 0.55), Plot(context, 0.44)
        self._drawn: object = None
        self._over_time = ""
        """The recording whose residual is shown; empty while the torque is."""

    def refresh(self) -> None:
        """Draws the newest version that has a residual; the one before stays until then."""
        version = self._newest()
        found = None if version is None else version.found
        if version is None or found is None:
            self._drawn, self._over_time = None, ""
            self._words.show()
            self._cloud.show(None)
            self._residual.show(None)
            return
        # The recording under the cursor, where the fit has seen it; else the first.
        name = self.session.playback.cursor.recording
        name = name if name in found.recordings else found.recordings[0]
        first = found.ranking[0].effect if found.ranking else None
        key = (id(version.comparisons), id(found.residual), id(found.laws), first, name)
        if key == self._drawn:
            return
        self._drawn = key
        torques, laws = _torques(version, name), _laws(version, found, name)
        if torques and (laws or self._is_after_a_law(version, found)):
            self._show_cloud(version, name, torques, laws)
        else:
            self._show_residual(found, name)

    def move_cursor(self) -> None:
        """The time-line's cursor moved."""
        if self._over_time:
            self._residual.move_cursor(self._cursor())

    def _cursor(self) -> float | None:
        """None while the time-line is in another recording, whose times are not of this axis."""
        cursor = self.session.playback.cursor
        return cursor.time if cursor.recording == self._over_time else None

    def _newest(self) -> ModelVersion | None:
        """A version without a residual of its own yet leaves the figure to the one before."""
        versions = self.session.diagnosis.shown_versions
        complete = [k for k in versions if k.found is not None and k.found.recordings]
        # Straight after an effect was added its torque is still to come: the picture waits for it.
        if len(complete) > 1 and not complete[-1].comparisons and complete[-2].comparisons:
            return complete[-2]
        return complete[-1] if complete else None

    def _is_after_a_law(self, version: ModelVersion, found: ModelFindings) -> bool:
        """Whether an effect with a law was added last, and no new candidate is offered yet."""
        versions = self.session.diagnosis.shown_versions
        place = next((k for k, each in enumerate(versions) if each is version), 0)
        before = versions[place - 1].found if place else None
        had = before is not None and bool(before.laws) and before.laws_of == version.added
        return had and (not found.ranking or not inviting(found))

    def _show_cloud(
        self, version: ModelVersion, name: str, torques: tuple[MissingTorque, ...],
        laws: tuple[OverSpeed, ...],
    ) -> None:  # fmt: skip
        versions = self.session.diagnosis.shown_versions
        first = next((t for k in versions if (t := _torques(k, name))), torques)
        title = _title(version.found.laws_of) if laws and version.found is not None else ""
        height = CLOUD if len(torques) <= BESIDE else EACH * len(torques)
        self._cloud.show(torque_cloud(torques, laws, title, first), height=height)
        self._residual.show(None)
        self._over_time = ""
        kind = "force" if all(t.unit == "N" for t in torques) else "torque"
        caption = cloud_caption(torques, first)
        self._words.show(WORDS.over_speed(name, kind, title, version.title, caption))

    def _show_residual(self, found: ModelFindings, name: str) -> None:
        k = found.recordings.index(name)
        at = self.session.diagnosis.shown_versions[0].found
        start = at if at is not None and name in at.recordings else found
        i = start.recordings.index(name)
        j = worst_channel(start.residual[i])
        channel = start.channels[i][j]
        if channel not in found.channels[k]:
            start, i, j = found, k, worst_channel(found.residual[k])
            channel = found.channels[k][j]
        here = found.channels[k].index(channel)
        now, before = found.residual[k][:, here], start.residual[i][:, j]
        one = next((r for r in found.ranking if r.predicted), None) if inviting(found) else None
        predicted = None if one is None else one.predicted[k][:, here]
        title = "" if one is None else one.title
        unit = next((e.unit for e in found.step.errors if e.channel == channel), "")
        figure = residual_figure(channel, found.dt[k], now, predicted, title, before, unit)
        self._over_time = name
        self._residual.show(figure, self._cursor(), RESIDUAL)
        self._cloud.show(None)
        caption = residual_caption(channel, unit, now, before)
        self._words.show(WORDS.over_time(name, title, caption))


def _laws(version: ModelVersion, found: ModelFindings, name: str) -> tuple[OverSpeed, ...]:
    """Of the first candidate on a recording, where something is to be explained."""
    names = [c.recording for c in version.comparisons]
    if not found.laws or name not in names or not inviting(found):
        return ()
    return found.laws[names.index(name)]


def _torques(version: ModelVersion, name: str) -> tuple[MissingTorque, ...]:
    return next((c.missing_torque for c in version.comparisons if c.recording == name), ())


def _title(kind: str) -> str:
    one = catalogue().get(kind)
    return kind if one is None else one.title
