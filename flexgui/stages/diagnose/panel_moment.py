"""On Diagnose: the missing torque, or the residual that fails most, with the first candidate in it.

It opens by itself with the first ranking, stays while an effect is added, and shows on the same
axes what the effect has explained.
"""

from __future__ import annotations

from flexgui.core.effects import catalogue
from flexgui.core.results import MissingTorque
from flexgui.page.panel import PageContext
from flexgui.page.plot import Plot
from flexgui.page.widgets import Words, joined, paragraph
from flexgui.stages.diagnose.look import Look, Looked
from flexgui.stages.diagnose.panel_candidates import inviting
from flexgui.stages.diagnose.plots_moment import (
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

LACKS = "What the model lacks in {}: the joint {} that the drive delivers beyond the model's."
WITH = "The line is the law of {} at its fitted size."
AFTER = "What {} left of it, on the same axes."
RESIDUAL_OF = "What the model does not explain of {}, on the output that fails most."
PREDICTED = "The line is what {} predicts of it."


class Moment:
    """One sentence and one figure."""

    def __init__(self, context: PageContext) -> None:
        self._context = context
        self._words = Words(context.gui)
        self._cloud = Plot(context.gui, 0.55)
        self._residual = Plot(context.gui, 0.44)
        self._drawn: object = None
        self._timed, self._shown = False, ""

    def refresh(self) -> None:
        """Draws the newest look that has something to show; the one before stays until then."""
        look = self._newest()
        if look is None or look.found is None:
            self._drawn = None
            self._hide()
            return
        found, name = look.found, self._recording(look)
        key = (id(look.comparisons), id(found.residual), id(found.laws), _first(found), name)
        if key == self._drawn:
            return
        self._drawn = key
        torques = _torques(look, name)
        laws = self._laws(look, name)
        if torques and (laws or self._is_after_a_law(look)):
            self._show_cloud(look, name, torques, laws)
        else:
            self._show_residual(found, name)

    def move_cursor(self) -> None:
        """The time-line's cursor moved."""
        if self._timed:
            self._residual.move_cursor(self._cursor())

    def _cursor(self) -> float | None:
        """None while the time-line is in another recording, whose times are not of this axis."""
        cursor = self._context.session.playback.cursor
        return cursor.time if cursor.recording == self._shown else None

    def _newest(self) -> Look | None:
        """A look without a residual of its own yet leaves the picture to the one before."""
        looks = self._context.session.diagnosis.shown_looks
        complete = [k for k in looks if k.found is not None and k.found.recordings]
        # Straight after an effect was added its torque is still to come: the picture waits for it.
        if len(complete) > 1 and not complete[-1].comparisons and complete[-2].comparisons:
            return complete[-2]
        return complete[-1] if complete else None

    def _recording(self, look: Look) -> str:
        """The one under the cursor, where the fit has seen it; else the first."""
        assert look.found is not None
        name = self._context.session.playback.cursor.recording
        return name if name in look.found.recordings else look.found.recordings[0]

    def _laws(self, look: Look, name: str) -> tuple[OverSpeed, ...]:
        """Of the first candidate on this recording, where something is to be explained."""
        assert look.found is not None
        names = [c.recording for c in look.comparisons]
        if not look.found.laws or name not in names or not inviting(look.found):
            return ()
        return look.found.laws[names.index(name)]

    def _is_after_a_law(self, look: Look) -> bool:
        """Whether the look was reached by adding what had a law, and nothing new is offered yet."""
        looks = self._context.session.diagnosis.shown_looks
        place = next((k for k, each in enumerate(looks) if each is look), 0)
        before = looks[place - 1].found if place else None
        had = before is not None and bool(before.laws) and before.laws_of == look.added
        found = look.found
        return had and found is not None and (not found.ranking or not inviting(found))

    def _show_cloud(
        self, look: Look, name: str, torques: tuple[MissingTorque, ...],
        laws: tuple[OverSpeed, ...],
    ) -> None:  # fmt: skip
        assert look.found is not None
        first = next((t for k in self._looks() if (t := _torques(k, name))), torques)
        title = _title(look.found.laws_of) if laws else ""
        height = CLOUD if len(torques) <= BESIDE else EACH * len(torques)
        self._cloud.show(moment_cloud(torques, laws, title, first), height=height)
        self._residual.show(None)
        self._timed = False
        kind = "force" if all(t.unit == "N" for t in torques) else "torque"
        lead = LACKS.format(name, kind) if laws else AFTER.format(look.title)
        note = f"{WITH.format(title)} " if title else ""
        self._words.show(
            joined(
                paragraph(lead, "lead"),
                paragraph(f"{note}Rms of {cloud_caption(torques, first)}.", "soft"),
            )
        )

    def _show_residual(self, found: Looked, name: str) -> None:
        k = found.recordings.index(name)
        at = self._context.session.diagnosis.shown_looks[0].found
        start = at if at is not None and name in at.recordings else found
        i = start.recordings.index(name)
        j = worst_channel(start.residual[i])
        channel = start.channels[i][j]
        if channel not in found.channels[k]:
            start, i, j = found, k, worst_channel(found.residual[k])
            channel = found.channels[k][j]
        here = found.channels[k].index(channel)
        one = next((r for r in found.ranking if r.predicted), None) if inviting(found) else None
        predicted = None if one is None else one.predicted[k][:, here]
        unit = next((e.unit for e in found.step.errors if e.channel == channel), "")
        figure = moment_residual(
            channel, found.dt[k], found.residual[k][:, here], predicted,
            "" if one is None else one.title, start.residual[i][:, j], unit,
        )  # fmt: skip
        self._shown = name
        self._residual.show(figure, self._cursor(), RESIDUAL)
        self._cloud.show(None)
        self._timed = True
        caption = residual_caption(
            channel, unit, found.residual[k][:, here], start.residual[i][:, j]
        )
        note = "" if one is None else f" {PREDICTED.format(one.title)}"
        self._words.show(
            joined(
                paragraph(RESIDUAL_OF.format(name), "lead"), paragraph(f"{caption}.{note}", "soft")
            )
        )

    def _looks(self) -> tuple[Look, ...]:
        return self._context.session.diagnosis.shown_looks

    def _hide(self) -> None:
        self._words.show("")
        self._cloud.show(None)
        self._residual.show(None)
        self._timed = False


def _torques(look: Look, name: str) -> tuple[MissingTorque, ...]:
    return next((c.missing_torque for c in look.comparisons if c.recording == name), ())


def _first(found: Looked) -> object:
    return found.ranking[0].effect if found.ranking else None


def _title(kind: str) -> str:
    one = catalogue().get(kind)
    return kind if one is None else one.title
