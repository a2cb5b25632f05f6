"""On Diagnose: missing torque, or the largest residual, with the first candidate's prediction.

It opens by itself with the first ranking, stays while an effect is added, and shows on the same
axes what the effect has explained.
"""

from __future__ import annotations

from flexgui.core.results import MissingTorque
from flexgui.page.panel import PageContext, PageElement
from flexgui.page.plot import Plot
from flexgui.page.widgets import HtmlBlock
from flexgui.stages.diagnose.effects import titled
from flexgui.stages.diagnose.model_versions import ModelFindings, ModelVersion
from flexgui.stages.diagnose.panel_candidates import WORDS, may_explain
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
"""px; two joints are side by side, more are below one another."""


class CandidateFigure(PageElement):
    """One caption and one figure."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self._words = HtmlBlock(self.gui)
        self._cloud, self._residual = Plot(context, 0.55), Plot(context, 0.44)
        self._drawn: object = None
        self._over_time = ""
        """The recording whose residual is shown; empty while the torque is."""

    def refresh(self) -> None:
        """Draws the newest version that has a residual."""
        version = self._newest()
        findings = None if version is None else version.found
        if version is None or findings is None:
            self._drawn, self._over_time = None, ""
            self._words.show()
            self._cloud.show(None)
            self._residual.show(None)
            return
        # The recording under the cursor, where the fit has seen it; else the first.
        name = self.session.playback.cursor.recording
        name = name if name in findings.recordings else findings.recordings[0]
        first = findings.ranking[0].effect if findings.ranking else None
        key = (id(version.comparisons), id(findings.residual), id(findings.laws), first, name)
        if key == self._drawn:
            return
        self._drawn = key
        torques, laws = _torques(version, name), _laws(version, findings, name)
        if torques and (laws or self._is_after_a_law(version, findings)):
            self._show_cloud(version, name, torques, laws)
        else:
            self._show_residual(findings, name)

    def move_cursor(self) -> None:
        """The time-line's cursor moved."""
        if self._over_time:
            self._residual.move_cursor(self._begins())

    def _begins(self) -> float | None:
        """The residual's axis begins with the recording; None if the cursor is in another one."""
        return 0.0 if self.session.playback.cursor.recording == self._over_time else None

    def _newest(self) -> ModelVersion | None:
        """The newest compared version with a residual."""
        versions = self.session.diagnosis.compared_versions
        complete = [k for k in versions if k.found is not None and k.found.recordings]
        return complete[-1] if complete else None

    def _is_after_a_law(self, version: ModelVersion, findings: ModelFindings) -> bool:
        """Whether the last added effect has a law and no new candidate is shown yet."""
        versions = self.session.diagnosis.shown_versions
        place = next((k for k, each in enumerate(versions) if each is version), 0)
        before = versions[place - 1].found if place else None
        had = before is not None and bool(before.laws) and before.laws_of == version.added
        return had and (not findings.ranking or not may_explain(findings))

    def _show_cloud(
        self, version: ModelVersion, name: str, torques: tuple[MissingTorque, ...],
        laws: tuple[OverSpeed, ...],
    ) -> None:  # fmt: skip
        versions = self.session.diagnosis.shown_versions
        first = next((t for k in versions if (t := _torques(k, name))), torques)
        title = titled([version.found.laws_of])[0] if laws and version.found is not None else ""
        height = CLOUD if len(torques) <= BESIDE else EACH * len(torques)
        self._cloud.show(torque_cloud(torques, laws, title, first), height=height)
        self._residual.show(None)
        self._over_time = ""
        kind = "force" if all(t.unit == "N" for t in torques) else "torque"
        caption = cloud_caption(torques, first)
        self._words.show(WORDS.over_speed(name, kind, title, version.title, caption))

    def _show_residual(self, findings: ModelFindings, name: str) -> None:
        k = findings.recordings.index(name)
        at = self.session.diagnosis.shown_versions[0].found
        start = at if at is not None and name in at.recordings else findings
        i = start.recordings.index(name)
        j = worst_channel(start.residual[i])
        channel = start.channels[i][j]
        if channel not in findings.channels[k]:
            start, i, j = findings, k, worst_channel(findings.residual[k])
            channel = findings.channels[k][j]
        here = findings.channels[k].index(channel)
        current, before = findings.residual[k][:, here], start.residual[i][:, j]
        ranking = findings.ranking if may_explain(findings) else ()
        predicting = next((r for r in ranking if r.predicted), None)
        predicted = None if predicting is None else predicting.predicted[k][:, here]
        title = "" if predicting is None else predicting.title
        unit = next((e.unit for e in findings.step.errors if e.channel == channel), "")
        figure = residual_figure(channel, findings.dt[k], current, predicted, title, before, unit)
        self._over_time = name
        self._residual.show(figure, self._begins(), RESIDUAL)
        self._cloud.show(None)
        caption = residual_caption(channel, unit, current, before)
        self._words.show(WORDS.over_time(name, title, caption))


def _laws(version: ModelVersion, findings: ModelFindings, name: str) -> tuple[OverSpeed, ...]:
    """Laws of the first candidate in a recording; empty if nothing is to be explained."""
    names = [c.recording for c in version.comparisons]
    if not findings.laws or name not in names or not may_explain(findings):
        return ()
    return findings.laws[names.index(name)]


def _torques(version: ModelVersion, name: str) -> tuple[MissingTorque, ...]:
    return next((c.missing_torque for c in version.comparisons if c.recording == name), ())
