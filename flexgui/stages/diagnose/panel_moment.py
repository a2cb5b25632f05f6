"""On Diagnose: the missing torque, or the residual that fails most, with the first candidate in it.

It opens by itself with the first ranking, stays while an effect is added, and shows on the same
axes what the effect has explained.
"""

from __future__ import annotations

from flexgui.core.effects import catalogue
from flexgui.core.results import MissingTorque
from flexgui.page.panel import PageContext, Piece
from flexgui.page.plot import Plot
from flexgui.page.widgets import Words
from flexgui.stages.diagnose.look import Look, Looked
from flexgui.stages.diagnose.panel_candidates import WORDS, inviting
from flexgui.stages.diagnose.plots import (
    BESIDE,
    cloud_caption,
    moment_cloud,
    moment_residual,
    residual_caption,
    worst_channel,
)
from flexgui.views.over_speed import OverSpeed

CLOUD, EACH, RESIDUAL = 280.0, 190.0, 240.0
"""px: two joints stand side by side, more below one another; all beside a ladder on a usual
screen."""


class Moment(Piece):
    """One sentence and one figure."""

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self._words = Words(self.gui)
        self._cloud, self._residual = Plot(context, 0.55), Plot(context, 0.44)
        self._drawn: object = None
        self._over_time = ""
        """The recording whose residual is shown; empty while the torque is."""

    def refresh(self) -> None:
        """Draws the newest look that has something to show; the one before stays until then."""
        look = self._newest()
        found = None if look is None else look.found
        if look is None or found is None:
            self._drawn, self._over_time = None, ""
            self._words.show()
            self._cloud.show(None)
            self._residual.show(None)
            return
        # The recording under the cursor, where the fit has seen it; else the first.
        name = self.session.playback.cursor.recording
        name = name if name in found.recordings else found.recordings[0]
        first = found.ranking[0].effect if found.ranking else None
        key = (id(look.comparisons), id(found.residual), id(found.laws), first, name)
        if key == self._drawn:
            return
        self._drawn = key
        torques, laws = _torques(look, name), _laws(look, found, name)
        if torques and (laws or self._is_after_a_law(look, found)):
            self._show_cloud(look, name, torques, laws)
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

    def _newest(self) -> Look | None:
        """A look without a residual of its own yet leaves the picture to the one before."""
        looks = self.session.diagnosis.shown_looks
        complete = [k for k in looks if k.found is not None and k.found.recordings]
        # Straight after an effect was added its torque is still to come: the picture waits for it.
        if len(complete) > 1 and not complete[-1].comparisons and complete[-2].comparisons:
            return complete[-2]
        return complete[-1] if complete else None

    def _is_after_a_law(self, look: Look, found: Looked) -> bool:
        """Whether the look was reached by adding what had a law, and nothing new is offered yet."""
        looks = self.session.diagnosis.shown_looks
        place = next((k for k, each in enumerate(looks) if each is look), 0)
        before = looks[place - 1].found if place else None
        had = before is not None and bool(before.laws) and before.laws_of == look.added
        return had and (not found.ranking or not inviting(found))

    def _show_cloud(
        self, look: Look, name: str, torques: tuple[MissingTorque, ...],
        laws: tuple[OverSpeed, ...],
    ) -> None:  # fmt: skip
        looks = self.session.diagnosis.shown_looks
        first = next((t for k in looks if (t := _torques(k, name))), torques)
        title = _title(look.found.laws_of) if laws and look.found is not None else ""
        height = CLOUD if len(torques) <= BESIDE else EACH * len(torques)
        self._cloud.show(moment_cloud(torques, laws, title, first), height=height)
        self._residual.show(None)
        self._over_time = ""
        kind = "force" if all(t.unit == "N" for t in torques) else "torque"
        caption = cloud_caption(torques, first)
        self._words.show(WORDS.over_speed(name, kind, title, look.title, caption))

    def _show_residual(self, found: Looked, name: str) -> None:
        k = found.recordings.index(name)
        at = self.session.diagnosis.shown_looks[0].found
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
        figure = moment_residual(channel, found.dt[k], now, predicted, title, before, unit)
        self._over_time = name
        self._residual.show(figure, self._cursor(), RESIDUAL)
        self._cloud.show(None)
        caption = residual_caption(channel, unit, now, before)
        self._words.show(WORDS.over_time(name, title, caption))


def _laws(look: Look, found: Looked, name: str) -> tuple[OverSpeed, ...]:
    """Of the first candidate on a recording, where something is to be explained."""
    names = [c.recording for c in look.comparisons]
    if not found.laws or name not in names or not inviting(found):
        return ()
    return found.laws[names.index(name)]


def _torques(look: Look, name: str) -> tuple[MissingTorque, ...]:
    return next((c.missing_torque for c in look.comparisons if c.recording == name), ())


def _title(kind: str) -> str:
    one = catalogue().get(kind)
    return kind if one is None else one.title
