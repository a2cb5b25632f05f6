"""Working point × frequency."""

from flexgui.views.error_map import error_map
from flexgui.views.layout import Figure
from flexgui.views.of_recording.view import RecordingView, Seen


class ErrorByFrequency(RecordingView):
    """A map of the error's spectrum, a row per recording."""

    kind = "error_by_frequency"
    title = "map: by frequency"
    about = "Working point × frequency [× noise floor]: pale is noise, dark is failing."
    place = 1

    def draw(self, seen: Seen) -> Figure | None:
        return error_map(seen.maps.by_frequency, narrow=True)
