"""Views of a recording's error, found by walking this folder.

*Compare* on the page offers them under *Show*, a script as `Comparison.plot(kind)`.
"""

from __future__ import annotations

from flexgui.core.plugins import discover
from flexgui.views.of_recording.view import RecordingView


def recording_views() -> dict[str, RecordingView]:
    """All views by their kind, in the order of their titles."""
    views = discover(__name__, RecordingView)
    return dict(sorted(views.items(), key=lambda item: (item[1].place, item[1].title)))
