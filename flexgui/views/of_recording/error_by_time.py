"""Working point × time."""

from flexgui.views.error_map import error_map
from flexgui.views.layout import Figure
from flexgui.views.of_recording.view import RecordingView, Seen


class ErrorByTime(RecordingView):
    """A map of the error along the recordings, a row each."""

    kind = "error_by_time"
    title = "map: by time"
    about = "Working point × time [× noise floor]: pale is noise, dark is failing."
    place = 2

    def draw(self, seen: Seen) -> Figure | None:
        return error_map(seen.maps.by_time, narrow=True)
