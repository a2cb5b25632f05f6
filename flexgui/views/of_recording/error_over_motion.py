"""The error against speed, place, acceleration or deflection."""

from flexgui.core.results import ErrorMaps, ErrorOver
from flexgui.views.layout import Figure
from flexgui.views.missing_torque import residual_over
from flexgui.views.of_recording.view import RecordingView, Seen

PATTERN = 0.05
"""Share of the error's variance below which a pattern over the motion is not drawn."""


class ErrorOverMotion(RecordingView):
    """The clearest pattern over each quantity of the motion."""

    kind = "error_over_motion"
    title = "error over the motion"
    about = "Measured minus model over the motion; both directions apart."
    nothing = "The error follows neither speed, place, acceleration nor deflection."
    place = 3

    def draw(self, seen: Seen) -> Figure | None:
        return residual_over(patterns(seen.maps))


def patterns(maps: ErrorMaps) -> list[ErrorOver]:
    """The clearest pattern over each quantity of the motion."""
    best: dict[str, ErrorOver] = {}
    for one in maps.over:
        if one.explained >= PATTERN:
            best.setdefault(one.quantity, one)
    return list(best.values())
