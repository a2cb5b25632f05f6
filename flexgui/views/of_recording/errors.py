"""Where the error lies: by frequency, along the recordings, and over the motion."""

from flexgui.core.results import ErrorMaps, ErrorOver
from flexgui.views.error_map import error_map
from flexgui.views.layout import Figure
from flexgui.views.missing_torque import residual_over
from flexgui.views.of_recording.view import RecordingView, Seen


class ErrorByFrequency(RecordingView):
    """A map of the error's spectrum, a row per recording."""

    kind = "error_by_frequency"
    title = "map: by frequency"
    about = "Error by recording and frequency, in multiples of the noise floor"
    place = 1

    def draw(self, seen: Seen) -> Figure | None:
        return error_map(seen.maps.by_frequency, narrow=True, dark=seen.dark)


class ErrorByTime(RecordingView):
    """A map of the error along the recordings, a row each."""

    kind = "error_by_time"
    title = "map: by time"
    about = "Error by recording and time, in multiples of the noise floor"
    place = 2

    def draw(self, seen: Seen) -> Figure | None:
        return error_map(seen.maps.by_time, narrow=True, dark=seen.dark)


class ErrorOverMotion(RecordingView):
    """The clearest pattern over each quantity of the motion."""

    kind = "error_over_motion"
    title = "error over the motion"
    about = "Measured minus model over the motion, per direction."
    nothing = "The error depends on neither speed, position, acceleration nor deflection."
    place = 3

    def draw(self, seen: Seen) -> Figure | None:
        return residual_over(patterns(seen.maps))


PATTERN = 0.05
"""Share of the error's variance below which a pattern over the motion is not drawn."""


def patterns(maps: ErrorMaps) -> list[ErrorOver]:
    """The clearest pattern over each quantity of the motion."""
    best: dict[str, ErrorOver] = {}
    for one in maps.over:
        if one.explained >= PATTERN:
            best.setdefault(one.quantity, one)
    return list(best.values())
